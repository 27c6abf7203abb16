/// Where files are written to and read from: links, pipes, devices, directories in use, full disks, empty names.

#include "simulation/results/atomic_file.hpp"
#include "simulation/results/results.hpp"
#include "tests/program.hpp"

#include <fcntl.h>
#include <nlohmann/json.hpp>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>

namespace hybmss {
namespace {

namespace fs = std::filesystem;

/// Before a command that, without the check under test, reads for ever or until the memory is gone. AddressSanitizer
/// reserves more addresses than any limit leaves.
#ifdef __SANITIZE_ADDRESS__
const std::string kLimits = "timeout 60 ";
#else
const std::string kLimits = "ulimit -v 20000000; timeout 10 ";
#endif

/// A directory with the scene `s.toml`.
class OutputFiles : public testing::Test {
protected:
    OutputFiles() { write("s.toml", test::small_scene()); }
    fs::path path(const std::string& name) const { return directory_.path() / name; }
    void write(const std::string& name, const std::string& text) const { test::write_text(path(name), text); }
    test::ProgramResult run(const std::string& arguments) const {
        return test::run_program(arguments, directory_.path());
    }
    /// By a shell in the directory: its exit code.
    int shell(const std::string& command) const {
        const int status = std::system(("cd '" + directory_.path().string() + "' && " + command).c_str());
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    void expect_refused(const std::string& arguments, const std::string& message, int code = 2) const {
        const test::ProgramResult result = run(arguments);
        EXPECT_EQ(result.exit_code, code) << arguments << "\n" << result.errors;
        EXPECT_NE(result.errors.find(message), std::string::npos) << arguments << "\n" << result.errors;
        EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    }

    test::TemporaryDirectory directory_;
};

TEST_F(OutputFiles, a_link_stays_and_the_file_it_names_is_replaced) {
    fs::create_directory(path("kept"));
    write("kept/record", "hybmss-record, an old one");
    fs::create_symlink("kept/record", path("link"));
    fs::create_symlink("link", path("link_to_link"));
    EXPECT_EQ(run("record s.toml --out link_to_link --states 1").exit_code, 0);
    EXPECT_TRUE(fs::is_symlink(path("link")) && fs::is_symlink(path("link_to_link")));
    EXPECT_GT(fs::file_size(path("kept/record")), 100u);

    fs::create_symlink("kept/new", path("to_nothing"));
    write_file(path("to_nothing"), "text");
    EXPECT_TRUE(fs::is_symlink(path("to_nothing")));
    EXPECT_EQ(test::read_text(path("kept/new")), "text");

    fs::create_symlink("round", path("round"));
    expect_refused("record s.toml --out round --states 1", "round: cannot be written: Too many levels");
}

TEST_F(OutputFiles, a_pipe_is_written_directly) {
    ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
    fs::create_symlink("pipe", path("link"));
    // Without a limit a reader of a pipe that was replaced would wait for ever.
    EXPECT_EQ(shell("{ timeout 20 cat pipe > read & } && timeout 20 '" HYBMSS_APP
                    "' record s.toml --out link --states 1 > out && wait"),
              0);
    EXPECT_TRUE(fs::is_fifo(path("pipe")) && fs::is_symlink(path("link")));
    EXPECT_GT(fs::file_size(path("read")), 100u);
    fs::create_symlink("/dev/stdout", path("stdout")); // as in a_device_stays
    EXPECT_EQ(shell("'" HYBMSS_APP "' explain s.toml --json stdout | grep -q '\"nodes\": 60'"), 0);
}

/// By a link: what is replaced by mistake is not the device.
TEST_F(OutputFiles, a_device_stays_and_tells_that_it_is_full) {
    fs::create_symlink("/dev/full", path("full"));
    expect_refused("record s.toml --out full --states 1", "full: cannot be written: No space left on device", 1);
    EXPECT_TRUE(fs::is_symlink(path("full")));
}

TEST_F(OutputFiles, what_cannot_be_written_is_refused_before_the_work) {
    fs::create_directory(path("folder"));
    expect_refused("explain s.toml --json folder", "--json folder: cannot be written: it is a directory");
    // By its own name the file would be parted from what the shell has opened.
    fs::create_symlink("/dev/stdout", path("stdout"));
    EXPECT_EQ(shell("'" HYBMSS_APP "' explain s.toml --json stdout > out 2> errors"), 2);
    EXPECT_NE(test::read_text(path("errors")).find("it is a file that is open already"), std::string::npos);
    write("target", "");
    fs::create_symlink("target", path("j.partial"));
    EXPECT_EQ(run("explain s.toml --json j").exit_code, 2); // not through a link that somebody put there
    EXPECT_EQ(fs::file_size(path("target")), 0u);
}

TEST_F(OutputFiles, one_file_has_one_writer) {
    AtomicFile first(path("file"));
    first.stream() << "first";
    EXPECT_THROW(AtomicFile second(path("file")), std::runtime_error);
    first.commit();
    EXPECT_EQ(test::read_text(path("file")), "first");
    write("file.partial", "left by a process that was killed");
    write_file(path("file"), "second");
    EXPECT_EQ(test::read_text(path("file")), "second");
    EXPECT_FALSE(fs::exists(path("file.partial")));
}

TEST_F(OutputFiles, a_full_disk_is_told_by_its_reason) {
    ASSERT_EQ(shell("trap '' XFSZ; ulimit -f 2; '" HYBMSS_APP "' run s.toml --out D > /dev/null 2> errors"), 1);
    const std::string errors = test::read_text(path("errors"));
    EXPECT_NE(errors.find("body_0000.vtu: cannot be written: File too large"), std::string::npos) << errors;
    EXPECT_FALSE(fs::exists(path("D/body_0000.vtu.partial")));
}

TEST_F(OutputFiles, standard_output_that_is_full_is_an_error_everywhere) {
    for (const char* arguments : {"--version", "--help", "explain --keys", "explain s.toml"}) {
        EXPECT_EQ(shell("'" HYBMSS_APP "' " + std::string(arguments) + " > /dev/full 2> errors"), 1) << arguments;
    }
}

TEST_F(OutputFiles, frames_of_a_longer_earlier_run_are_removed_and_nothing_foreign) {
    EXPECT_EQ(run("run s.toml --out D").exit_code, 0);
    ASSERT_TRUE(fs::exists(path("D/body_0009.vtu")));
    fs::copy_file(path("D/body_0009.vtu"), path("D/body_12345.vtu")); // as of a very long run
    for (const char* name :
         {"D/body_9.vtu", "D/body_00009.vtu", "D/body_0009.vtu.old", "D/mine_0009.vtu", "kept.vtu"}) {
        fs::copy_file(path("D/body_0009.vtu"), path(name));
    }
    write("D/body_0008.vtu", "not ours");
    fs::remove(path("D/body_0007.vtu"));
    fs::create_symlink("../kept.vtu", path("D/body_0007.vtu"));
    fs::create_directory(path("D/body_0099.vtu"));

    write("s.toml", test::small_scene("every = 0.5", "every = 100"));
    EXPECT_EQ(run("run s.toml --out D").exit_code, 0);
    for (const char* name :
         {"D/body_0000.vtu", "D/body_0001.vtu", "D/body_9.vtu", "D/body_00009.vtu", "D/body_0009.vtu.old",
          "D/mine_0009.vtu", "D/body_0008.vtu", "D/body_0007.vtu", "D/body_0099.vtu", "kept.vtu"}) {
        EXPECT_TRUE(fs::exists(path(name))) << name;
    }
    for (const char* name : {"D/body_0002.vtu", "D/body_0009.vtu", "D/body_12345.vtu"}) {
        EXPECT_FALSE(fs::exists(path(name))) << name;
    }
}

TEST_F(OutputFiles, the_list_of_frames_names_those_that_are_there) {
    Simulation simulation(parse_scene(test::small_scene(), "s.toml"));
    std::string state;
    {
        Results results(path("D"), simulation);
        results.record();
        results.record();
        state = results.state();
        results.record(); // and is killed
    }
    fs::remove(path("D/body_0000.vtu"));
    Results goes_on(path("D"), simulation, state);
    EXPECT_TRUE(fs::exists(path("D/body_0001.vtu")));
    EXPECT_FALSE(fs::exists(path("D/body_0002.vtu")));
    goes_on.record();
    goes_on.finish(simulation.run());
    const std::string list = test::read_text(path("D/body.pvd"));
    EXPECT_EQ(list.find("body_0000.vtu"), std::string::npos) << list;
    EXPECT_NE(list.find("body_0001.vtu"), std::string::npos) << list;
    EXPECT_NE(list.find("body_0002.vtu"), std::string::npos) << list;
}

/// A run that takes long, as a child.
class Child {
public:
    Child(const fs::path& directory, const char* out) : process_(fork()) {
        if (process_ == 0) {
            const int nowhere = open("/dev/null", O_RDWR);
            if (chdir(directory.c_str()) == 0 && dup2(nowhere, 1) == 1 && dup2(nowhere, 2) == 2) {
                execl(HYBMSS_APP, HYBMSS_APP, "run", "s.toml", "--out", out, static_cast<char*>(nullptr));
            }
            _exit(127);
        }
        for (int wait = 0; wait < 2000 && !fs::exists(directory / out / "body_0001.vtu"); ++wait) {
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        }
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;
    ~Child() { end(SIGKILL); }
    /// The wait status.
    int end(int signal) {
        int status = -1;
        if (process_ > 0) {
            kill(process_, signal);
            waitpid(process_, &status, 0);
            process_ = -1;
        }
        return status;
    }

private:
    pid_t process_;
};

std::string long_scene() {
    std::string text = test::small_scene("duration = 30", "duration = 30000");
    text.erase(text.find("tolerance = 1e-4\n"), 17);
    return text;
}

TEST_F(OutputFiles, a_directory_has_one_run_at_a_time) {
    write("s.toml", long_scene());
    write("quick.toml", test::small_scene());
    Child first(directory_.path(), "D");
    expect_refused("run quick.toml --out D", "--out: D: is in use by another run");
    EXPECT_TRUE(fs::exists(path("D/probes.csv.partial")));
    first.end(SIGKILL);
    EXPECT_EQ(run("run quick.toml --out D").exit_code, 0); // what the killed one left is no hindrance
    EXPECT_FALSE(fs::exists(path("D/probes.csv.partial")));
}

TEST_F(OutputFiles, a_run_that_is_stopped_leaves_no_end_of_an_earlier_one) {
    write("quick.toml", test::small_scene());
    ASSERT_EQ(run("run quick.toml --out D").exit_code, 0);
    ASSERT_TRUE(fs::exists(path("D/summary.json")));
    fs::remove(path("D/body_0001.vtu")); // by which a Child is known to run
    write("s.toml", long_scene());
    Child child(directory_.path(), "D");
    child.end(SIGTERM);
    for (const char* name : {"summary.json", "body.pvd", "probes.csv"}) {
        EXPECT_FALSE(fs::exists(path("D") / name)) << name;
    }
    EXPECT_TRUE(fs::exists(path("D/checkpoint")));
}

TEST_F(OutputFiles, a_hangup_stops_a_run_as_a_termination_does) {
    write("s.toml", long_scene());
    Child child(directory_.path(), "D");
    const int status = child.end(SIGHUP);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 128 + SIGHUP) << status;
    EXPECT_TRUE(fs::exists(path("D/checkpoint")));
    EXPECT_FALSE(fs::exists(path("D/probes.csv.partial")));
}

TEST_F(OutputFiles, a_probe_that_is_not_finite_is_told_with_the_cause) {
    write("s.toml", "[body]\ncells = [3, 3, 3]\ncell_size = 1e6\n"
                    "[material]\nyoung_modulus = 1e18\npoisson_ratio = 0.499999999\ndensity = 1\n"
                    "[[fix]]\nwhere = \"y-min\"\n[[move]]\nwhere = \"y-max\"\ntranslate = [0, 1e9, 0]\nover = 0\n"
                    "[solver]\nduration = 10\n[[probe]]\nname = \"p\"\nwhere = \"y-max\"\n");
    const test::ProgramResult result = run("run s.toml --precision float --out D");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.errors.rfind("hybmss: error: s.toml: probe \"p\": the force is not finite: not written; ", 0), 0u)
        << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    for (const char* name : {"summary.json", "body.pvd", "probes.csv", "probes.csv.partial"}) {
        EXPECT_FALSE(fs::exists(path("D") / name)) << name;
    }
}

/// What fails leaves its start, not nodes that have flown away.
TEST_F(OutputFiles, a_solve_without_an_equilibrium_leaves_its_start) {
    write("s.toml", "[body]\ncells = [3, 3, 3]\ncell_size = 0.1\n"
                    "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n"
                    "[[fix]]\nwhere = \"y-min\"\n[[load]]\nwhere = \"y-max\"\nforce = [0, 1e12, 0]\n"
                    "[solver]\nmethod = \"static\"\n[[probe]]\nname = \"p\"\nwhere = \"y-max\"\n");
    const test::ProgramResult result = run("run s.toml --precision float --out D");
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.errors.find("left is the start"), std::string::npos) << result.errors;
    const auto json = nlohmann::json::parse(test::read_text(path("D/summary.json")));
    EXPECT_EQ(json.at("residual").get<double>(), 0);
    EXPECT_EQ(json.at("probes").at("p").at("max_displacement").get<double>(), 0);
}

TEST_F(OutputFiles, options_that_make_no_sense_are_one_line) {
    expect_refused("run s.toml --out ''", "--out: it must not be empty");
    expect_refused("forces s.toml --displacements s.toml --out ''", "--out: it must not be empty");
    expect_refused("record s.toml --out ''", "--out: it must not be empty");
    expect_refused("explain s.toml --json ''", "--json: it must not be empty");
    expect_refused("run s.toml --out D --checkpoint-every nan", "nan: it must be a number at least 0");
    expect_refused("run s.toml --out D --checkpoint-every=-1", "-1: it must be a number at least 0");
    EXPECT_FALSE(fs::exists(path("D")));
}

TEST_F(OutputFiles, what_is_read_whole_is_a_regular_file) {
    ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
    fs::create_symlink("/dev/zero", path("endless"));
    fs::create_directory(path("D"));
    for (const char* name : {"pipe", "endless"}) {
        const std::string no_file = "it is a pipe, a device or a socket; a regular file is needed";
        write("v.toml", test::small_scene("cells = [2, 3, 4]", "voxels = \"" + std::string(name) + "\""));
        const auto limited = [&](const std::string& arguments) {
            EXPECT_EQ(shell(kLimits + "'" HYBMSS_APP "' " + arguments + " > out 2> errors"), 2);
            EXPECT_NE(test::read_text(path("errors")).find(no_file), std::string::npos)
                << arguments << "\n"
                << test::read_text(path("errors"));
        };
        limited("run v.toml");
        limited("run s.toml --effort stored --wisdom " + std::string(name));
        fs::remove(path("D/checkpoint"));
        fs::create_symlink(path(name), path("D/checkpoint"));
        limited("run s.toml --out D --restart");
    }
    fs::remove(path("D/checkpoint"));
    fs::create_directory(path("D/checkpoint"));
    expect_refused("run s.toml --out D --restart", "D/checkpoint: it is a directory");
}

TEST_F(OutputFiles, scenes_records_and_tables_come_by_a_file_or_a_pipe_and_end) {
    fs::create_symlink("/dev/zero", path("endless"));
    write("long.toml", "");
    fs::resize_file(path("long.toml"), 100'000'000); // takes no room on the disk
    const auto refused = [&](const std::string& arguments, const std::string& message) {
        EXPECT_EQ(shell(kLimits + "'" HYBMSS_APP "' " + arguments + " > out 2> errors"), 2);
        EXPECT_NE(test::read_text(path("errors")).find("cannot be read: it is " + message + "\n"), std::string::npos)
            << arguments << "\n"
            << test::read_text(path("errors"));
    };
    for (const char* arguments :
         {"run endless", "explain endless", "replay endless", "forces s.toml --displacements endless"}) {
        refused(arguments, "a device or a socket; a regular file or a pipe is needed");
    }
    refused("run long.toml", "longer than the 67108864 bytes that are read at most");
    refused("forces s.toml --displacements long.toml", "longer than the 28000 bytes that are read at most");

    const auto by_a_pipe = [&](const std::string& file, const std::string& arguments) {
        EXPECT_EQ(shell("cat " + file + " | '" HYBMSS_APP "' " + arguments + " > out 2> errors"), 0)
            << arguments << "\n"
            << test::read_text(path("errors"));
    };
    by_a_pipe("s.toml", "run /dev/stdin");
    ASSERT_EQ(shell("'" HYBMSS_APP "' record s.toml --out record > out 2> errors"), 0);
    by_a_pipe("record", "replay /dev/stdin");
    std::string rows;
    for (int node = 0; node < 60; ++node) {
        rows += "0,0,0\n";
    }
    write("rows.csv", rows);
    by_a_pipe("rows.csv", "forces s.toml --displacements /dev/stdin");
}

} // namespace
} // namespace hybmss
