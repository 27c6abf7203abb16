/// What `hybmss run --out` writes.

#include "hybmss/simulation/simulation.hpp"
#include "tests/program.hpp"
#include "tests/simulation/vtu_array.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
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

} // namespace
} // namespace hybmss
