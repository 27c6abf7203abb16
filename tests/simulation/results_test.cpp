// How runs end, and what `hybmss run --out` writes.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"
#include "tests/simulation/files.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <vector>

namespace hybmss {
namespace {

using test::vtu_array;

class Results : public testing::Test {
protected:
    static void SetUpTestSuite() {
        directory = new test::TemporaryDirectory;
        test::write_text(directory->path() / "s.toml", test::small_scene());
        run = test::run_program("run s.toml --out made/results", directory->path());
    }
    static void TearDownTestSuite() { delete directory; }
    static std::string text(const std::string& file) {
        return test::read_text(directory->path() / "made/results" / file);
    }
    static inline test::TemporaryDirectory* directory = nullptr;
    static inline test::ProgramResult run;
};

TEST_F(Results, run_succeeds_quietly) {
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    EXPECT_EQ(run.errors, ""); // no progress where there is no terminal
    EXPECT_NE(run.output.find("probe plate"), std::string::npos) << run.output;
    for (const auto& entry : std::filesystem::directory_iterator(directory->path() / "made/results")) {
        EXPECT_NE(entry.path().extension(), ".partial");
    }
}

TEST_F(Results, summary_has_every_key) {
    const nlohmann::json json = nlohmann::json::parse(text("summary.json"));
    EXPECT_TRUE(json.at("converged").get<bool>());
    for (const char* key : {"relative_volume_change", "min_cell_volume_ratio", "max_cell_volume_ratio", "steps",
                            "iterations", "residual", "wall_seconds", "time", "time_step", "critical_time_step"}) {
        EXPECT_TRUE(json.at(key).is_number()) << key;
    }
    for (const char* key : {"springs", "volume", "kinetic", "external"}) {
        EXPECT_TRUE(json.at("energy").at(key).is_number_float()) << key;
    }
    const nlohmann::json& plate = json.at("probes").at("plate");
    for (const char* key : {"force", "torque", "mean_displacement"}) {
        EXPECT_EQ(plate.at(key).size(), 3u) << key;
    }
    EXPECT_NEAR(plate.at("max_displacement").get<double>(), 0.1, 1e-12);
    EXPECT_LT(plate.at("force").at(1).get<double>(), 0);
    EXPECT_TRUE(json.at("version").is_string());
    EXPECT_EQ(json.at("plan").at("nodes"), 3 * 4 * 5);
}

TEST_F(Results, probes_csv_has_a_row_for_each_output) {
    std::istringstream rows(text("probes.csv"));
    std::string line;
    std::getline(rows, line);
    EXPECT_EQ(line, "time,plate.force.x,plate.force.y,plate.force.z,plate.torque.x,plate.torque.y,plate.torque.z,"
                    "plate.mean_displacement.x,plate.mean_displacement.y,plate.mean_displacement.z");
    const nlohmann::json json = nlohmann::json::parse(text("summary.json"));
    std::vector<double> times;
    double last_force = 0;
    while (std::getline(rows, line)) {
        EXPECT_EQ(std::count(line.begin(), line.end(), ','), 9);
        times.push_back(std::stod(line));
        std::istringstream values(line);
        for (int column = 0; column < 3; ++column) {
            std::string value;
            std::getline(values, value, ',');
            last_force = std::stod(value);
        }
    }
    // One at rest, one each half second (at the first step from there on), one at the end.
    ASSERT_GT(times.size(), 3u);
    EXPECT_EQ(times[0], 0.0);
    const double step = json.at("time_step").get<double>();
    EXPECT_GE(times[1], 0.5 - 1e-9);
    EXPECT_LT(times[1], 0.5 + step);
    EXPECT_NEAR(times.back(), json.at("time").get<double>(), 1e-7);
    EXPECT_NEAR(last_force, json["probes"]["plate"]["force"][1].get<double>(), 1e-7 * std::abs(last_force));
    const std::string pvd = text("body.pvd");
    for (std::size_t frame = 0; frame < times.size(); ++frame) {
        char name[32];
        std::snprintf(name, sizeof name, "body_%04zu.vtu", frame);
        EXPECT_NE(pvd.find(name), std::string::npos) << name;
        EXPECT_TRUE(std::filesystem::exists(directory->path() / "made/results" / name)) << name;
    }
}

TEST_F(Results, vtu_holds_right_handed_hexahedra_of_the_deformed_body) {
    const std::string vtu = text("body_0001.vtu");
    const auto points = vtu_array<double>(vtu, "Points");
    const auto displacement = vtu_array<double>(vtu, "displacement");
    const auto connectivity = vtu_array<std::int32_t>(vtu, "connectivity");
    const auto offsets = vtu_array<std::int64_t>(vtu, "offsets");
    const auto types = vtu_array<std::uint8_t>(vtu, "types");
    const auto ratios = vtu_array<double>(vtu, "volume_ratio");
    ASSERT_EQ(points.size(), 3u * 60);
    ASSERT_EQ(displacement.size(), points.size());
    ASSERT_EQ(vtu_array<double>(vtu, "velocity").size(), points.size());
    ASSERT_EQ(types, std::vector<std::uint8_t>(24, 12));
    ASSERT_EQ(connectivity.size(), 8u * 24);
    EXPECT_EQ(offsets.back(), 8 * 24);
    EXPECT_EQ(points[3], 0.5 + displacement[3]); // node 1 lies at x = 0.5
    for (std::size_t cell = 0; cell < types.size(); ++cell) {
        // VTK: corners 0 1 2 3 go around the low face, counter-clockwise seen from above; 4 5 6 7 lie above them. The
        // mean edges a, b, c in that order must span the cell's volume.
        double edges[3][3] = {};
        constexpr int kHigh[3][8] = {{0, 1, 1, 0, 0, 1, 1, 0}, {0, 0, 1, 1, 0, 0, 1, 1}, {0, 0, 0, 0, 1, 1, 1, 1}};
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (std::size_t e = 0; e < 3; ++e) {
                for (std::size_t a = 0; a < 3; ++a) {
                    const double x = points[3 * static_cast<std::size_t>(connectivity[8 * cell + corner]) + a] / 4;
                    edges[e][a] += kHigh[e][corner] ? x : -x;
                }
            }
        }
        const auto& [a, b, c] = edges;
        const double volume = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                              a[2] * (b[0] * c[1] - b[1] * c[0]);
        EXPECT_NEAR(volume / 0.125, ratios[cell], 1e-13);
    }
}

TEST(Run, without_out_writes_nothing) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene());
    EXPECT_EQ(test::run_program("run s.toml --precision float --threads 1", directory.path()).exit_code, 0);
    std::size_t files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(directory.path())) {
        ++files;
    }
    EXPECT_EQ(files, 1u);
}

TEST(Run, same_results_for_any_number_of_threads) {
    const auto displacements = [](int threads) {
        SimulationOptions options;
        options.plan.threads = threads;
        Simulation simulation(parse_scene(test::small_scene(), "s.toml"), options);
        simulation.run();
        return simulation.displacements();
    };
    EXPECT_EQ(displacements(1), displacements(3));
}

TEST(Outcome, not_settled_in_time_is_a_failure_with_results) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene("duration = 30", "duration = 1.1"));
    const test::ProgramResult result = test::run_program("run s.toml --out results", directory.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.errors.rfind("hybmss: error: s.toml: not settled after duration = 1.1 s: residual", 0), 0u)
        << result.errors;
    const nlohmann::json json = nlohmann::json::parse(test::read_text(directory.path() / "results/summary.json"));
    EXPECT_FALSE(json.at("converged").get<bool>());
    EXPECT_TRUE(std::filesystem::exists(directory.path() / "results/body_0003.vtu"));
}

TEST(Outcome, motion_must_end_first) {
    Simulation simulation(parse_scene(test::small_scene("over = 1", "over = 40"), "s.toml"));
    const Summary summary = simulation.run();
    EXPECT_FALSE(summary.converged);
    EXPECT_NE(summary.failure.find("a motion has not ended"), std::string::npos) << summary.failure;
}

TEST(Outcome, without_tolerance_the_whole_duration_is_run) {
    Simulation simulation(parse_scene(test::small_scene("tolerance = 1e-4", ""), "s.toml"));
    const Summary summary = simulation.run();
    EXPECT_EQ(summary.failure, "");
    EXPECT_TRUE(summary.converged);
    EXPECT_NEAR(summary.time, 30, summary.time_step);

    std::string text = test::small_scene("tolerance = 1e-4", "");
    text.replace(text.find("duration = 30"), 13, "duration = 2");
    Simulation shorter(parse_scene(text, "s.toml"));
    const Summary early = shorter.run();
    EXPECT_EQ(early.failure, "");
    EXPECT_FALSE(early.converged);
}

/// Undamped and without load, momentum and energy stay; the settled test must not be fooled by a turning point.
TEST(Outcome, undamped_body_never_settles) {
    std::string text = test::small_scene("mass = 3", "mass = 0");
    Simulation simulation(parse_scene(text, "s.toml"));
    EXPECT_FALSE(simulation.run().converged);
}

/// The plate falls through the whole body within a few steps.
TEST(Outcome, divergence_is_told_and_leaves_only_finite_numbers) {
    test::TemporaryDirectory directory;
    std::string text = test::small_scene("translate = [0, -0.1, 0]", "translate = [0, -900000, 0]");
    test::write_text(directory.path() / "s.toml", text);
    const test::ProgramResult result = test::run_program("run s.toml --out results", directory.path());
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_NE(result.errors.find("s.toml: diverged by step "), std::string::npos) << result.errors;
    const std::string summary = test::read_text(directory.path() / "results/summary.json");
    EXPECT_EQ(summary.find("null"), std::string::npos);
    EXPECT_FALSE(nlohmann::json::parse(summary).at("converged").get<bool>());
    for (const auto& entry : std::filesystem::directory_iterator(directory.path() / "results")) {
        const std::string extension = entry.path().extension();
        if (extension == ".csv" || extension == ".json") {
            const std::string content = test::read_text(entry.path());
            EXPECT_EQ(content.find("nan"), std::string::npos) << entry.path();
            EXPECT_EQ(content.find("inf"), std::string::npos) << entry.path();
        }
    }
}

/// Embedders step by call: they are told too, however many steps a call takes.
TEST(Outcome, divergence_is_told_to_who_steps_by_call) {
    const std::string text = test::small_scene("translate = [0, -0.1, 0]", "translate = [0, -900000, 0]");
    for (const long count : {1L, 7L, 1000L}) {
        Simulation simulation(parse_scene(text, "s.toml"));
        try {
            for (int call = 0; call < 1000; ++call) {
                simulation.step(count);
            }
            ADD_FAILURE() << "not told, in calls for " << count;
        } catch (const std::runtime_error& error) {
            EXPECT_EQ(std::string(error.what()).find("diverged by step "), 0u) << error.what();
            EXPECT_LE(simulation.steps(), 1000);
        }
    }
}

/// A free body under gravity alone: v = g t, no strain, and its energy is kept by the external one.
/// A bar of a square section along x, `across` cells wide and ten times as long, held at its low end.
Summary of_bar(int across, const std::string& load, double poisson_ratio = 0, const char* method = "static") {
    const std::string n = std::to_string(across);
    return Simulation(
               parse_scene("[body]\ncells = [" + std::to_string(10 * across) + ", " + n + ", " + n +
                               "]\ncell_size = " + std::to_string(0.12 / across) +
                               "\n[material]\nyoung_modulus = 1e5\npoisson_ratio = " + std::to_string(poisson_ratio) +
                               "\ndensity = 1000\n[[fix]]\nwhere = \"x-min\"\n" + load +
                               "[damping]\nmass = 30\n[solver]\nmethod = \"" + method + "\"\nduration = 0.5\n",
                           "s.toml"))
        .run();
}

/// "makes the body some 49 % too stiff" -> 49; 0 without a warning.
double too_stiff(const Summary& summary) {
    EXPECT_EQ(summary.failure, "");
    if (summary.warnings.empty()) {
        return 0;
    }
    EXPECT_EQ(summary.warnings.size(), 1u);
    double percent = 0;
    EXPECT_EQ(std::sscanf(summary.warnings[0].c_str(),
                          "the mesh is coarse: its cells are bent or twisted, which makes the body some %lf", &percent),
              1)
        << summary.warnings[0];
    return percent;
}

TEST(CoarseMesh, is_told_where_a_body_is_bent_or_twisted) {
    const std::string bent = "[[load]]\nwhere = \"x-max\"\nforce = [0, 0, 0.01]\n";
    const std::string twisted = "[[move]]\nwhere = \"x-max\"\nrotate = {axis = \"x\", degrees = 5}\naxes = \"yz\"\n";
    // Against Timoshenko's beam it is 198/n^2 % too stiff (12.3 measured at 4), and Saint-Venant's bar 27 % at 2.
    EXPECT_NEAR(too_stiff(of_bar(1, bent)), 198, 20);
    EXPECT_NEAR(too_stiff(of_bar(2, bent)), 49.5, 5);
    EXPECT_NEAR(too_stiff(of_bar(3, bent)), 22, 3);
    EXPECT_EQ(too_stiff(of_bar(5, bent)), 0); // 8 %
    EXPECT_NEAR(too_stiff(of_bar(2, twisted)), 27, 6);
    EXPECT_EQ(too_stiff(of_bar(5, twisted)), 0);
    EXPECT_NEAR(too_stiff(of_bar(2, bent, 0, "backward-euler")), 49.5, 10);
    EXPECT_NEAR(too_stiff(of_bar(2, bent, 0, "symplectic-euler")), 49.5, 10);
}

TEST(CoarseMesh, is_no_matter_where_nothing_is_bent) {
    EXPECT_EQ(too_stiff(of_bar(1, "")), 0); // at rest
    EXPECT_EQ(too_stiff(of_bar(1, "[[move]]\nwhere = \"x-max\"\ntranslate = [-0.1, 0, 0]\n", 0.3)), 0);
    EXPECT_EQ(too_stiff(of_bar(1, "[gravity]\nacceleration = [10, 0, 0]\n", 0.3)), 0);
    for (const int n : {1, 2, 3, 4}) {
        const std::string cells = std::to_string(n);
        Scene scene = load_scene(test::example("compression_nu025"));
        scene.solver.method = SolverMethod::static_equilibrium;
        scene.solver.tolerance = 1e-6;
        scene.body.cells = {n, n, n};
        scene.body.cell_size = 5.0 / n;
        EXPECT_EQ(too_stiff(Simulation(scene).run()), 0) << n;
    }
    Scene drop = load_scene(test::example("dropped_cube"));
    drop.body.cells = {2, 2, 2};
    drop.body.cell_size = 0.1;
    drop.solver.tolerance.reset();
    EXPECT_EQ(too_stiff(Simulation(drop).run()), 0);
}

TEST(Outcome, free_fall) {
    std::string text = test::small_scene("[[fix]]", "[gravity]\nacceleration = [0, -10, 0]\n[[fix]]");
    text.erase(text.find("[[fix]]"), text.find("[damping]") - text.find("[[fix]]"));
    text.replace(text.find("mass = 3"), 8, "mass = 0");
    Simulation simulation(parse_scene(text, "s.toml"));
    simulation.step(100);
    const double t = simulation.time();
    for (const auto& v : simulation.velocities()) {
        EXPECT_NEAR(v[1], -10 * t, 1e-9 * t);
    }
    const Energies energies = simulation.energies();
    const double mass = 1000 * 0.125 * 24;
    EXPECT_NEAR(energies.kinetic, 0.5 * mass * 100 * t * t, 1e-9 * energies.kinetic);
    EXPECT_LT(energies.springs + std::abs(energies.volume), 1e-15 * energies.kinetic);
    // The method is of first order: the fall is g t (t + dt) / 2.
    EXPECT_NEAR(-energies.external, mass * 100 * t * (t + simulation.time_step()) / 2, 1e-9 * energies.kinetic);
    EXPECT_FALSE(simulation.settlement().settled);
}

/// Rollers on x-min share an edge with the plate, which holds y alone there.
std::string rollers(const std::string& where) {
    std::string text = test::small_scene("over = 1", "axes = \"y\"\nover = 0");
    text.replace(text.find("where = \"y-min\"\n"), 16,
                 "where = \"y-min\"\naxes = \"y\"\n"
                 "[[fix]]\nwhere = \"x-min\"\naxes = \"x\"\n"
                 "[[fix]]\nwhere = {node = 0}\naxes = \"z\"\n");
    text.replace(text.find("method = \"symplectic-euler\"\nduration = 30"), 41, "method = \"static\"");
    return text.replace(text.rfind("where = \"y-max\""), 15, "where = " + where);
}

TEST(Probe, tells_of_supports_that_it_shares_with_another_face) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", rollers("\"y-max\""));
    const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    const std::string told =
        "s.toml: probe plate, where = \"y-max\": 5 of its 15 held nodes are held by others of "
        "\"x-min\" too, whose forces there it reads; where = {of = \"y-max\", without = [\"x-min\"]} "
        "leaves these nodes out\n";
    EXPECT_EQ(run.errors, "hybmss: warning: " + told);
    const test::ProgramResult explain = test::run_program("explain s.toml", directory.path());
    EXPECT_EQ(explain.errors, "hybmss: warning: " + told);
    EXPECT_NE(explain.output.find("15 held nodes, 5 of them shared"), std::string::npos) << explain.output;
    const auto plate = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"))["probes"]["plate"];
    EXPECT_EQ(plate.at("reaction_nodes"), 15);
    EXPECT_EQ(plate.at("shared_reaction_nodes"), 5);

    Simulation without(parse_scene(rollers("{of = \"y-max\", without = [\"x-min\"]}"), "s.toml"));
    const Summary summary = without.run();
    EXPECT_EQ(summary.probes.at(0).reaction_nodes, 10u);
    EXPECT_EQ(summary.probes.at(0).shared_reaction_nodes, 0u);
    EXPECT_TRUE(summary.warnings.empty()) << summary.warnings[0];
    // Half of a plate is read in part on purpose.
    Simulation part(parse_scene(rollers("{box = [[0.4, 1.4, 0], [0.6, 1.6, 9]]}"), "s.toml"));
    EXPECT_TRUE(part.shared_supports().empty());
    EXPECT_EQ(part.probes().at(0).reaction_nodes, 5u);
}

TEST(VtuFields, mass_and_reaction_are_written_where_they_are_asked_for) {
    const test::TemporaryDirectory directory;
    for (const bool cut : {false, true}) {
        std::string text = test::small_scene("every = 0.5", "mass = true\nreaction = true");
        if (cut) {
            text += "[[cut]]\nat = 2\nbox = [[-1, -1, 1.6], [9, 9, 9]]\n";
        }
        test::write_text(directory.path() / "s.toml", text);
        const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
        ASSERT_EQ(run.exit_code, 0) << run.errors;
        const std::string vtu = test::read_text(directory.path() / "r/body_0001.vtu");
        const std::vector<double> mass = vtu_array<double>(vtu, "mass"), reaction = vtu_array<double>(vtu, "reaction"),
                                  points = vtu_array<double>(vtu, "Points");
        ASSERT_EQ(points.size(), 3u * (cut ? 48 : 60));
        ASSERT_EQ(mass.size(), points.size() / 3);
        ASSERT_EQ(reaction.size(), points.size());
        double sum = 0, plate = 0;
        for (std::size_t n = 0; n < mass.size(); ++n) {
            sum += mass[n];
            plate += points[3 * n + 1] > 1.39 ? reaction[3 * n + 1] : 0;
            EXPECT_TRUE(points[3 * n + 1] > 1.39 || points[3 * n + 1] < 0.01 || reaction[3 * n] == 0);
        }
        EXPECT_NEAR(sum, 1000 * (cut ? 18 : 24) * 0.125, 1e-9 * sum);
        const auto json = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"));
        EXPECT_NEAR(plate, json["probes"]["plate"]["force"][1].get<double>(), 1e-9 * std::abs(plate));
        EXPECT_LT(plate, -100);
        // Of each fix and move what its nodes' reactions sum up to.
        ASSERT_EQ(json["supports"].size(), 2u);
        EXPECT_EQ(json["supports"][1]["kind"], "move");
        EXPECT_EQ(json["supports"][1]["where"], "y-max");
        EXPECT_NEAR(json["supports"][1]["force"][1].get<double>(), plate, 1e-9 * std::abs(plate));
        EXPECT_EQ(vtu.find("\"contact\""), std::string::npos); // there are no obstacles
    }
    test::write_text(directory.path() / "s.toml", test::small_scene());
    EXPECT_EQ(test::run_program("run s.toml --out r", directory.path()).exit_code, 0);
    EXPECT_EQ(test::read_text(directory.path() / "r/body_0000.vtu").find("\"mass\""), std::string::npos);
}

TEST(VtuFields, contact_forces_sum_up_to_what_obstacles_exert) {
    const test::TemporaryDirectory directory;
    for (const char* precision : {"float", "double"}) {
        test::write_text(directory.path() / "s.toml",
                         "[body]\ncells = [3, 3, 3]\ncell_size = 0.1\n[material]\n"
                         "young_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n"
                         "[gravity]\nacceleration = [2, -9, 0]\n[damping]\nmass = 5\n"
                         "[[obstacle]]\nname = \"floor\"\nplane = {point = [0, 0, 0], normal = [0, 1, 0]}\n"
                         "friction = 0.1\n[[obstacle]]\nname = \"wall\"\n"
                         "plane = {point = [0.31, 0, 0], normal = [-1, 0, 0]}\n"
                         "[solver]\nduration = 1\n[output]\nreaction = true\n");
        const auto run =
            test::run_program("run s.toml --out r --force --precision " + std::string(precision), directory.path());
        ASSERT_EQ(run.exit_code, 0) << run.errors;
        const std::string vtu = test::read_text(directory.path() / "r/body_0001.vtu");
        const std::vector<double> contact = vtu_array<double>(vtu, "contact"),
                                  points = vtu_array<double>(vtu, "Points");
        ASSERT_EQ(contact.size(), points.size());
        std::array<double, 3> sum{}, expected{};
        for (std::size_t n = 0; n < contact.size(); n += 3) {
            for (std::size_t a = 0; a < 3; ++a) {
                sum[a] += contact[n + a];
            }
            EXPECT_TRUE(points[n + 1] <= 0 || contact[n + 1] == 0) << n; // the wall has no friction
            EXPECT_TRUE(points[n + 1] <= 0 || points[n] >= 0.31 || contact[n] == 0) << n;
        }
        const auto json = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"));
        for (const char* name : {"floor", "wall"}) {
            for (std::size_t a = 0; a < 3; ++a) {
                expected[a] += json["obstacles"][name]["force"][a].get<double>();
            }
        }
        EXPECT_GT(expected[1], 100);
        EXPECT_LT(expected[0], -10);
        for (std::size_t a = 0; a < 3; ++a) {
            EXPECT_NEAR(sum[a], expected[a], (precision == std::string("float") ? 1e-5 : 1e-11) * expected[1]);
        }
    }
}

TEST(VtuFields, stress_is_written_where_it_is_asked_for) {
    const test::TemporaryDirectory directory;
    for (const bool cut : {false, true}) {
        std::string text = test::small_scene("every = 0.5", "stress = true");
        if (cut) {
            text += "[[cut]]\nat = 2\nbox = [[-1, -1, 1.6], [9, 9, 9]]\n";
        }
        test::write_text(directory.path() / "s.toml", text);
        const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
        ASSERT_EQ(run.exit_code, 0) << run.errors;
        EXPECT_NE(run.output.find("von Mises"), std::string::npos);
        const std::string vtu = test::read_text(directory.path() / "r/body_0001.vtu");
        const std::vector<double> cauchy = vtu_array<double>(vtu, "cauchy_stress"),
                                  pressure = vtu_array<double>(vtu, "pressure"),
                                  points = vtu_array<double>(vtu, "von_mises"), // the first of the name
            density = vtu_array<double>(vtu, "energy_density");
        const std::size_t cells = cut ? 18 : 24;
        ASSERT_EQ(cauchy.size(), 6 * cells);
        ASSERT_EQ(vtu_array<double>(vtu, "green_strain").size(), 6 * cells);
        ASSERT_EQ(points.size(), cut ? 48u : 60u);
        double energy = 0, largest = 0;
        for (std::size_t n = 0; n < cells; ++n) {
            CellStress stress;
            std::copy_n(cauchy.begin() + static_cast<std::ptrdiff_t>(6 * n), 6, stress.cauchy.begin());
            EXPECT_DOUBLE_EQ(pressure.at(n), stress.pressure());
            largest = std::max(largest, stress.von_mises());
            energy += 0.125 * density.at(n);
        }
        const auto json = nlohmann::json::parse(test::read_text(directory.path() / "r/summary.json"));
        EXPECT_NEAR(energy, json["energy"]["springs"].get<double>() + json["energy"]["volume"].get<double>(),
                    1e-9 * energy);
        EXPECT_NEAR(json["stress"]["max_von_mises"].get<double>(), largest, 1e-9 * largest);
        EXPECT_GT(largest, 100);
        EXPECT_LT(*std::max_element(points.begin(), points.end()), largest * (1 + 1e-9));
        EXPECT_LT(json["stress"]["mean"][1].get<double>(), -100); // it is pressed along y
    }
    test::write_text(directory.path() / "s.toml", test::small_scene());
    EXPECT_EQ(test::run_program("run s.toml --out r", directory.path()).exit_code, 0);
    EXPECT_EQ(test::read_text(directory.path() / "r/body_0000.vtu").find("stress"), std::string::npos);
    EXPECT_EQ(test::read_text(directory.path() / "r/summary.json").find("stress"), std::string::npos);
}

TEST(Skin, of_a_scene_is_the_boundary_of_its_cells_at_every_moment) {
    const test::TemporaryDirectory directory;
    std::string text = test::small_scene("every = 0.5", "skin = true");
    text += "[[cut]]\nat = 2\nbox = [[-1, -1, 1.6], [9, 9, 9]]\n";
    test::write_text(directory.path() / "s.toml", text);
    ASSERT_EQ(test::run_program("run s.toml --out r", directory.path()).exit_code, 0);
    for (const int frame : {0, 1}) {
        const std::string vtp = test::read_text(directory.path() / ("r/skin_000" + std::to_string(frame) + ".vtp"));
        const std::string vtu = test::read_text(directory.path() / ("r/body_000" + std::to_string(frame) + ".vtu"));
        const std::vector<double> points = vtu_array<double>(vtp, "Points"), nodes = vtu_array<double>(vtu, "Points");
        const std::vector<std::int32_t> triangles = vtu_array<std::int32_t>(vtp, "connectivity");
        // 2 x 3 x 4 cells, of which the upper layer is cut away: their boundary's faces, two triangles each.
        EXPECT_EQ(triangles.size(), 3u * 2 * (frame == 0 ? 2 * (6 + 8 + 12) : 2 * (6 + 6 + 9)));
        EXPECT_EQ(vtu_array<double>(vtp, "normals").size(), points.size());
        double volume = 0;
        for (std::size_t t = 0; t < triangles.size(); t += 3) {
            const double* const a = points.data() + 3 * triangles[t];
            const double* const b = points.data() + 3 * triangles[t + 1];
            const double* const c = points.data() + 3 * triangles[t + 2];
            volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                       a[2] * (b[0] * c[1] - b[1] * c[0])) /
                      6;
        }
        double cells = 0;
        for (const double ratio : vtu_array<double>(vtu, "volume_ratio")) {
            cells += 0.125 * ratio;
        }
        EXPECT_NEAR(volume, cells, 0.02 * cells); // faces of cells are bent a little
        for (std::size_t p = 0; p < points.size(); p += 3) {
            double nearest = 1;
            for (std::size_t n = 0; n < nodes.size(); n += 3) {
                nearest = std::min(nearest, std::hypot(points[p] - nodes[n], points[p + 1] - nodes[n + 1],
                                                       points[p + 2] - nodes[n + 2]));
            }
            EXPECT_LT(nearest, 1e-12);
        }
    }
    EXPECT_NE(test::read_text(directory.path() / "r/skin.pvd").find("skin_0001.vtp"), std::string::npos);
    // A run without it leaves none of them behind.
    test::write_text(directory.path() / "s.toml", test::small_scene());
    ASSERT_EQ(test::run_program("run s.toml --out r", directory.path()).exit_code, 0);
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "r/skin_0000.vtp"));
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "r/skin.pvd"));
}

TEST(Skin, is_the_same_in_every_kind_of_file) {
    const test::TemporaryDirectory directory;
    const auto run = [&](const std::string& lines) {
        test::write_text(directory.path() / "s.toml", test::small_scene("every = 0.5", lines));
        return test::run_program("run s.toml --out r", directory.path());
    };
    for (const std::string smooth : {"", "\nsmooth = true"}) {
        ASSERT_EQ(run("skin = \"vtp\"" + smooth).exit_code, 0);
        const std::string vtp = test::read_text(directory.path() / "r/skin_0001.vtp");
        const std::vector<double> points = vtu_array<double>(vtp, "Points"),
                                  normals = vtu_array<double>(vtp, "normals");
        const std::vector<std::int32_t> triangles = vtu_array<std::int32_t>(vtp, "connectivity");

        ASSERT_EQ(run("skin = \"obj\"" + smooth).exit_code, 0);
        EXPECT_FALSE(std::filesystem::exists(directory.path() / "r/skin_0001.vtp"));
        EXPECT_FALSE(std::filesystem::exists(directory.path() / "r/skin.pvd"));
        std::istringstream obj(test::read_text(directory.path() / "r/skin_0001.obj"));
        std::vector<double> v, vn;
        std::vector<std::int32_t> f;
        for (std::string line; std::getline(obj, line);) {
            std::istringstream words(line);
            std::string kind;
            words >> kind;
            for (std::string word; kind != "#" && words >> word;) {
                if (kind == "f") {
                    EXPECT_EQ(word, std::to_string(std::stoi(word)) + "//" + std::to_string(std::stoi(word)));
                    f.push_back(std::stoi(word) - 1);
                } else {
                    (kind == "v" ? v : vn).push_back(std::stod(word));
                }
            }
        }
        EXPECT_EQ(f, triangles);
        ASSERT_EQ(v.size(), points.size());
        ASSERT_EQ(vn.size(), points.size());

        ASSERT_EQ(run("skin = \"ply\"" + smooth).exit_code, 0);
        EXPECT_FALSE(std::filesystem::exists(directory.path() / "r/skin_0001.obj"));
        const std::string ply = test::read_text(directory.path() / "r/skin_0001.ply");
        const std::size_t begin = ply.find("end_header\n") + 11, faces = begin + 24 * (points.size() / 3);
        EXPECT_NE(ply.find("element vertex " + std::to_string(points.size() / 3) + "\n"), std::string::npos);
        ASSERT_EQ(ply.size(), faces + 13 * (triangles.size() / 3));
        for (std::size_t n = 0; n < points.size(); ++n) {
            EXPECT_NEAR(v[n], points[n], 1e-8);
            EXPECT_NEAR(vn[n], normals[n], 1e-8);
            std::array<float, 2> read{};
            std::memcpy(read.data(), ply.data() + begin + 24 * (n / 3) + 4 * (n % 3), 4);
            std::memcpy(&read[1], ply.data() + begin + 24 * (n / 3) + 4 * (n % 3) + 12, 4);
            EXPECT_EQ(read[0], static_cast<float>(points[n]));
            EXPECT_EQ(read[1], static_cast<float>(normals[n]));
        }
        for (std::size_t n = 0; n < triangles.size(); ++n) {
            std::int32_t vertex = 0;
            std::memcpy(&vertex, ply.data() + faces + 13 * (n / 3) + 1 + 4 * (n % 3), 4);
            EXPECT_EQ(vertex, triangles[n]);
        }
    }
    EXPECT_NE(run("skin = \"stl\"").errors.find("vtp"), std::string::npos);
    EXPECT_NE(run("smooth = true").errors.find("must be given with skin"), std::string::npos);
}

TEST(Skin, of_a_surface_is_its_mesh_less_what_is_cut_away_and_with_what_that_lays_bare) {
    const test::TemporaryDirectory directory;
    test::write_text(directory.path() / "c.obj", R"(v 1 1 1
v 3 1 1
v 3 3 1
v 1 3 1
v 1 1 5
v 3 1 5
v 3 3 5
v 1 3 5
f 1 4 3 2
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
)");
    test::write_text(directory.path() / "s.toml", R"([body]
surface = "c.obj"
cell_size = 0.5
[material]
young_modulus = 1e4
poisson_ratio = 0.3
density = 1000
[[fix]]
where = "z-min"
[solver]
method = "symplectic-euler"
duration = 1
[output]
skin = true
[[cut]]
at = 0.5
box = [[0, 0, 4.1], [9, 9, 9]]
)");
    const test::ProgramResult run = test::run_program("run s.toml --out r", directory.path());
    if (run.errors.find("assimp") != std::string::npos) {
        GTEST_SKIP() << "built without assimp";
    }
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const std::string before = test::read_text(directory.path() / "r/skin_0000.vtp");
    EXPECT_EQ(vtu_array<std::int32_t>(before, "connectivity").size(), 3u * 12);
    EXPECT_EQ(vtu_array<double>(before, "Points").size(), 3u * 8);
    // The bottom is left; the sides reach into what is gone, where 4 x 4 faces of cells close the body.
    const std::string after = test::read_text(directory.path() / "r/skin_0001.vtp");
    const std::vector<std::int32_t> triangles = vtu_array<std::int32_t>(after, "connectivity");
    const std::vector<double> points = vtu_array<double>(after, "Points");
    ASSERT_EQ(triangles.size(), 3u * (2 + 32));
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        EXPECT_NEAR(points.at(3 * static_cast<std::size_t>(triangles[t]) + 2), t < 6 ? 1 : 4, 1e-12) << t;
    }
}

TEST(Stress, of_an_equilibrium_sums_up_to_what_supports_and_loads_carry) {
    Simulation simulation(parse_scene(R"([body]
size = [0.4, 0.3, 0.8]
cell_size = 0.1
[material]
young_modulus = 2e4
poisson_ratio = 0.45
density = 1000
[gravity]
acceleration = [0, 0, -5]
[[fix]]
where = "z-min"
[[move]]
where = "z-max"
translate = [0.02, 0.01, -0.1]
[solver]
method = "static"
)",
                                      "s.toml"));
    ASSERT_TRUE(simulation.run().converged);
    std::array<double, 9> inside{}, outside{};
    for (const CellStress& stress : simulation.cell_stresses()) {
        for (std::size_t e = 0; e < 9; ++e) {
            inside[e] += 1e-3 * stress.first_piola[e];
        }
    }
    const std::vector<std::array<double, 3>> reactions = simulation.reactions();
    double size = 0;
    for (std::size_t n = 0; n < reactions.size(); ++n) {
        const std::array<double, 3> weight = {0, 0, -5 * simulation.masses()[n]};
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) {
                outside[3 * i + j] += (reactions[n][i] + weight[i]) * simulation.rest_positions()[n][j];
                size = std::max(size, std::abs(inside[3 * i + j]));
            }
        }
    }
    for (std::size_t e = 0; e < 9; ++e) {
        EXPECT_NEAR(inside[e], outside[e], 1e-7 * size) << e;
    }
}

} // namespace
} // namespace hybmss
