/// Checkpoints: a run that was stopped goes on to the same bits, and what is no checkpoint of it is refused.

#include "hybmss/simulation/simulation.hpp"
#include "simulation/run/checkpoint.hpp"
#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <random>
#include <thread>

namespace hybmss {
namespace {

/// Neither the cell size nor the time step is a power of two; the motion ends on the way.
std::string scene_text(const std::string& solver, int cells = 4) {
    return "[body]\ncells = [" + std::to_string(cells) + ", 5, 6]\ncell_size = 0.1\n" +
           "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.45\ndensity = 1000\n"
           "[[fix]]\nwhere = \"y-min\"\n"
           "[[move]]\nwhere = \"y-max\"\nrotate = {axis = \"y\", degrees = 20}\nover = 0.7\n"
           "[gravity]\nacceleration = [0, -10, 0]\n"
           "[damping]\nmass = 0.3\n"
           "[[load]]\nwhere = \"x-max\"\nforce = [1, 0, 2]\n"
           "[output]\nevery = 0.37\n"
           "[[probe]]\nname = \"plate\"\nwhere = \"y-max\"\n" +
           "[solver]\n" + solver;
}

struct Outcome {
    std::vector<std::array<double, 3>> displacements, velocities;
    std::string summary;
    std::vector<double> outputs;

    bool operator==(const Outcome&) const = default;
};

Outcome end_of(Simulation& simulation, Summary summary) {
    summary.wall_seconds = 0;
    const auto& w = summary.work;
    std::string text = std::to_string(summary.steps) + " " + std::to_string(w.newton_iterations) + " " +
                       std::to_string(w.cg_iterations) + " " + w.preconditioner;
    return {simulation.displacements(), simulation.velocities(), text, {}};
}

/// Stopped at every `every`-th check (0: never), and begun again from a checkpoint each time.
Outcome run(const Scene& scene, const SimulationOptions& options, int every) {
    const test::TemporaryDirectory directory;
    const std::string file = directory.path() / "checkpoint";
    Simulation simulation(scene, options);
    std::vector<double> outputs;
    for (;;) {
        int checks = 0;
        RunCallbacks callbacks;
        callbacks.output = [&] { outputs.push_back(simulation.time()); };
        callbacks.checkpoint = [&] {
            if (every == 0 || ++checks < every) {
                return true;
            }
            simulation.write_checkpoint(file, "attached");
            return false;
        };
        const Summary summary = simulation.run(callbacks);
        if (!summary.interrupted) {
            Outcome all = end_of(simulation, summary);
            all.outputs = outputs;
            return all;
        }
        std::string attached;
        simulation = Simulation::restarted(scene, {Precision::float64, {}}, file, &attached);
        EXPECT_EQ(attached, "attached");
    }
}

struct Method {
    const char* name;
    const char* solver;
    Precision precision;
    const char* layout;
    bool one_tile = false;
};

const Method kMethods[] = {
    {"Explicit", "duration = 1.1", Precision::float64, ""},
    {"ExplicitFloat", "duration = 1.1", Precision::float32, "active-rows"},
    {"ExplicitNetwork", "duration = 1.1", Precision::float32, "network"},
    {"ExplicitOneTile", "duration = 1.1", Precision::float32, "flat-rows", true},
    {"ExplicitSettled", "duration = 90\ntolerance = 0.1", Precision::float64, ""},
    {"Leapfrog", "duration = 1.1\nmethod = \"leapfrog\"", Precision::float64, ""},
    {"LeapfrogFloatNetwork", "duration = 1.1\nmethod = \"leapfrog\"", Precision::float32, "network"},
    {"Implicit", "duration = 0.5\nmethod = \"backward-euler\"", Precision::float64, ""},
    {"ImplicitMultigrid", "duration = 0.5\nmethod = \"backward-euler\"\npreconditioner = \"multigrid\"",
     Precision::float64, ""},
    {"ImplicitMultigridFloat", "duration = 0.5\nmethod = \"backward-euler\"\npreconditioner = \"multigrid\"",
     Precision::float32, ""},
};

void PrintTo(const Method& method, std::ostream* out) {
    *out << method.name;
}

class Restart : public testing::TestWithParam<Method> {};

TEST_P(Restart, ends_with_the_same_bits) {
    const Scene scene = parse_scene(scene_text(GetParam().solver), "s.toml");
    SimulationOptions options;
    options.precision = GetParam().precision;
    options.plan.layout = GetParam().layout;
    options.plan.one_tile = GetParam().one_tile;
    const Outcome whole = run(scene, options, 0);
    ASSERT_GT(whole.outputs.size(), 2u);
    for (int every : {1, 3}) {
        const Outcome parts = run(scene, options, every);
        EXPECT_EQ(parts.outputs, whole.outputs);
        EXPECT_EQ(parts.summary, whole.summary);
        EXPECT_TRUE(parts == whole) << "stopped at every " << every;
    }
}

INSTANTIATE_TEST_SUITE_P(Runs, Restart, testing::ValuesIn(kMethods),
                         [](const auto& method) { return std::string(method.param.name); });

/// The files of a finished run, without what tells of the wall clock.
std::map<std::string, std::string> results(const std::filesystem::path& directory) {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::directory_iterator(directory)) {
        files[entry.path().filename()] = test::read_text(entry.path());
    }
    nlohmann::json summary = nlohmann::json::parse(files.at("summary.json"));
    summary.erase("wall_seconds");
    files["summary.json"] = summary.dump();
    return files;
}

/// `hybmss ARGUMENTS`, ended by `signal` after a while. Returns the wait status.
int run_and_kill(const std::filesystem::path& directory, std::vector<std::string> arguments, int signal,
                 std::chrono::microseconds after) {
    arguments.insert(arguments.begin(), HYBMSS_APP);
    const pid_t child = fork();
    if (child == 0) {
        std::vector<char*> argv;
        for (std::string& argument : arguments) {
            argv.push_back(argument.data());
        }
        argv.push_back(nullptr);
        const int nowhere = open("/dev/null", O_RDWR);
        if (chdir(directory.c_str()) == 0 && dup2(nowhere, 1) == 1 && dup2(nowhere, 2) == 2) {
            execv(argv[0], argv.data());
        }
        _exit(127);
    }
    std::this_thread::sleep_for(after);
    kill(child, signal);
    int status = 0;
    waitpid(child, &status, 0);
    return status;
}

class Killed : public testing::TestWithParam<int> {};

TEST_P(Killed, at_any_moment_a_run_goes_on_to_the_same_files) {
    const int signal = GetParam();
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", scene_text("duration = 25", 12));
    const auto start = std::chrono::steady_clock::now();
    ASSERT_EQ(test::run_program("run s.toml --out whole", directory.path()).exit_code, 0);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto whole = results(directory.path() / "whole");
    EXPECT_FALSE(whole.contains("checkpoint"));

    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 engine(seed);
    int stops = 0;
    for (; stops < 60; ++stops) {
        std::vector<std::string> arguments = {"run", "s.toml", "--out", "parts", "--checkpoint-every", "0"};
        if (std::filesystem::exists(directory.path() / "parts/checkpoint")) {
            arguments.push_back("--restart");
        }
        const std::chrono::duration<double> wait(seconds / 3 * std::uniform_real_distribution<>(0, 1)(engine));
        const int status = run_and_kill(directory.path(), arguments, signal,
                                        std::chrono::duration_cast<std::chrono::microseconds>(wait));
        if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
            break;
        }
        // A signal that came before the run began finds nobody who would turn it into an exit code.
        EXPECT_TRUE(WIFSIGNALED(status) || WEXITSTATUS(status) == 128 + signal) << status;
    }
    if (stops == 60) { // never left alone to the end; perhaps killed after it, and begun anew
        const bool begun = std::filesystem::exists(directory.path() / "parts/checkpoint");
        const std::string command = std::string("run s.toml --out parts") + (begun ? " --restart" : "");
        ASSERT_EQ(test::run_program(command, directory.path()).exit_code, 0);
    }
    EXPECT_GE(stops, 2);
    EXPECT_TRUE(results(directory.path() / "parts") == whole);
}

INSTANTIATE_TEST_SUITE_P(Runs, Killed, testing::Values(SIGKILL, SIGTERM),
                         [](const auto& signal) { return signal.param == SIGKILL ? "Kill" : "Terminate"; });

/// A directory with the scene `s.toml` and a checkpoint of it in `out`.
class BadCheckpoint : public testing::Test {
protected:
    BadCheckpoint() {
        const std::string text = scene_text("duration = 25");
        test::write_text(directory_.path() / "s.toml", text);
        std::filesystem::create_directory(directory_.path() / "out");
        Simulation simulation(parse_scene(text, "s.toml"), {});
        simulation.step(5);
        simulation.write_checkpoint(file());
    }
    std::string file() const { return directory_.path() / "out/checkpoint"; }
    void expect_refused(const std::string& message, const std::string& more = "") {
        const test::ProgramResult result =
            test::run_program("run s.toml --out out --restart" + more, directory_.path());
        EXPECT_EQ(result.exit_code, 2);
        EXPECT_NE(result.errors.find(message), std::string::npos) << result.errors;
        EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
        EXPECT_FALSE(std::filesystem::exists(directory_.path() / "out/summary.json"));
    }

    test::TemporaryDirectory directory_;
};

TEST_F(BadCheckpoint, cut_short_at_any_place) {
    const std::string whole = test::read_text(file());
    for (std::size_t length : {std::size_t{0}, std::size_t{5}, std::size_t{20}, std::size_t{27}, std::size_t{60},
                               whole.size() / 2, whole.size() - 9, whole.size() - 1}) {
        test::write_text(file(), whole.substr(0, length));
        expect_refused("out/checkpoint: it is cut short or damaged");
    }
}

TEST_F(BadCheckpoint, any_byte_changed) {
    const std::string whole = test::read_text(file());
    for (std::size_t at = 1; at < whole.size(); at = 2 * at + 19) {
        std::string changed = whole;
        changed[at] = static_cast<char>(changed[at] ^ 4);
        test::write_text(file(), changed);
        EXPECT_THROW(read_checkpoint_file(file()), std::runtime_error) << at;
    }
    expect_refused("out/checkpoint: it is cut short or damaged: its bytes do not match its digest");
}

TEST_F(BadCheckpoint, foreign_or_missing) {
    test::write_text(file(), "something else altogether");
    expect_refused("out/checkpoint: it is no checkpoint of hybmss");
    std::filesystem::remove(file());
    expect_refused("out/checkpoint: it cannot be read: No such file or directory");
}

TEST_F(BadCheckpoint, of_another_version) {
    CheckpointSections sections = read_checkpoint_file(file());
    sections.put("version", std::string("0.0.0"));
    write_checkpoint_file(file(), sections);
    expect_refused("out/checkpoint: it was written by hybmss 0.0.0, this is ");
}

/// With a digest that fits.
TEST_F(BadCheckpoint, of_numbers_that_lead_out_of_arrays) {
    const CheckpointSections good = read_checkpoint_file(file());
    const auto changed = [&](const std::string& name, auto values) {
        CheckpointSections sections = good;
        sections.put(name, values);
        write_checkpoint_file(file(), sections);
    };
    changed("removed", std::vector<std::uint32_t>{3, 4000000000u});
    expect_refused("out/checkpoint: its removed cell 4000000000 is none of the body's 120");
    changed("bites", std::vector<double>(good.values<double>("bites").size() + 1, 0.0));
    expect_refused("out/checkpoint: its section \"bites\" has ");
    changed("run", std::vector<std::int64_t>{std::numeric_limits<std::int64_t>::max(), 0, 0, 0, 0});
    expect_refused("out/checkpoint: its section \"run\" counts 9223372036854775807");
}

TEST_F(BadCheckpoint, of_another_scene) {
    const std::string text = test::read_text(directory_.path() / "s.toml");
    const auto changed = [&](const std::string& from, const std::string& to) {
        std::string other = text;
        other.replace(other.find(from), from.size(), to);
        test::write_text(directory_.path() / "s.toml", other);
    };
    for (const auto& [from, to] : {std::pair{"mass = 0.3", "mass = 0.4"}, std::pair{"degrees = 20", "degrees = 21"},
                                   std::pair{"every = 0.37", "every = 0.38"}, std::pair{"[4, 5, 6]", "[6, 5, 4]"}}) {
        changed(from, to);
        expect_refused("out/checkpoint: it belongs to another scene, or to this one before it was changed");
    }
    changed("mass = 0.3", "# as measured\nmass = 0.3");
    EXPECT_EQ(test::run_program("run s.toml --out out --restart", directory_.path()).exit_code, 0);
}

/// The surface of the same cells, moved in space.
TEST_F(BadCheckpoint, of_a_body_that_lies_elsewhere) {
    std::string text = scene_text("duration = 25");
    text.replace(text.find("cells = [4, 5, 6]"), 17, "surface = \"box.obj\"");
    const auto write_box = [&](double x) {
        std::ofstream box(directory_.path() / "box.obj");
        for (int corner = 0; corner < 8; ++corner) {
            box << "v " << x + (corner & 1) << " " << (corner >> 1 & 1) << " " << (corner >> 2 & 1) << "\n";
        }
        box << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    };
    write_box(2);
    const std::string scene = directory_.path() / "s.toml";
    test::write_text(scene, text);
    try {
        load_scene(scene);
    } catch (const SceneError& error) {
        GTEST_SKIP() << error.what(); // a build without surfaces
    }
    {
        Simulation simulation(load_scene(scene));
        simulation.step(5);
        simulation.write_checkpoint(file());
    }
    EXPECT_NO_THROW(Simulation::restarted(load_scene(scene), {}, file()));
    write_box(3);
    expect_refused("out/checkpoint: it belongs to a body that lies elsewhere: box.obj was moved");

    const CheckpointSections sections = read_checkpoint_file(file());
    CheckpointSections older;
    for (const auto& [name, bytes] : sections.all()) {
        if (name != "origin") {
            older.put(name, bytes);
        }
    }
    write_checkpoint_file(file(), older);
    expect_refused("out/checkpoint: it is an older one, which does not tell where the body lies");
}

/// An older build wrote which tiles and which integration were asked for.
TEST_F(BadCheckpoint, of_tiles_that_are_no_more) {
    const CheckpointSections good = read_checkpoint_file(file());
    for (const auto& [tile_nodes, integration, refused] :
         {std::tuple(0, "automatic", false), std::tuple(40, "automatic", true), std::tuple(0, "split", true)}) {
        CheckpointSections older;
        for (const auto& [name, bytes] : good.all()) {
            if (name != "one_tile") {
                older.put(name, bytes);
            }
        }
        older.put("tile_nodes", std::vector<std::uint64_t>{static_cast<std::uint64_t>(tile_nodes)});
        older.put("integration", std::string(integration));
        write_checkpoint_file(file(), older);
        if (refused) {
            expect_refused("out/checkpoint: it goes on in tiles of another size, or with split integration, which are "
                           "no more");
        } else {
            EXPECT_NO_THROW(Simulation::restarted(load_scene((directory_.path() / "s.toml").string()), {}, file()));
        }
    }
}

TEST_F(BadCheckpoint, options_that_it_fixes) {
    expect_refused("--precision excludes --restart", " --precision float");
    expect_refused("--one-tile excludes --restart", " --one-tile");
    expect_refused("--layout excludes --restart: what the checkpoint holds goes on", " --layout flat-rows");
}

TEST_F(BadCheckpoint, of_a_static_scene) {
    test::write_text(directory_.path() / "s.toml", scene_text("method = \"static\""));
    expect_refused("out/checkpoint: a static scene has no time to go on from");
}

} // namespace
} // namespace hybmss
