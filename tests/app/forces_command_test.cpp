/// `hybmss forces`: kernels against the scalar reference, and its input files.

#include "tests/program.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <vector>

namespace hybmss {
namespace {

constexpr std::size_t kNodes = 3 * 4 * 5; // of small_scene()

std::string random_displacements(double size) {
    std::mt19937 generator(12345);
    std::uniform_real_distribution<double> component(-size, size);
    std::ostringstream text;
    text.precision(17);
    for (std::size_t n = 0; n < kNodes; ++n) {
        text << component(generator) << "," << component(generator) << ", " << component(generator) << "\n";
    }
    return text.str();
}

std::vector<double> numbers(const std::string& csv) {
    std::istringstream text(csv);
    std::string line;
    std::getline(text, line);
    EXPECT_EQ(line, "x,y,z");
    std::vector<double> values;
    while (std::getline(text, line, ',') || !line.empty()) {
        std::istringstream parts(line);
        for (double value; parts >> value;) {
            values.push_back(value);
        }
        line.clear();
    }
    return values;
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
    EXPECT_EQ(a.size(), 3 * kNodes);
    EXPECT_EQ(b.size(), 3 * kNodes);
    double difference = 0, scale = 0;
    for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
        difference = std::max(difference, std::abs(a[i] - b[i]));
        scale = std::max(scale, std::abs(b[i]));
    }
    return difference / scale;
}

TEST(ForcesCommand, every_kernel_agrees_with_the_reference) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene());
    test::write_text(directory.path() / "u.csv", "ux,uy,uz\n" + random_displacements(0.05));
    const std::string common = "forces s.toml --displacements u.csv --out f.csv ";
    const test::ProgramResult reference = test::run_program(common + "--kernel reference", directory.path());
    ASSERT_EQ(reference.exit_code, 0) << reference.errors;
    const nlohmann::json expected = nlohmann::json::parse(reference.output);
    const std::vector<double> forces = numbers(test::read_text(directory.path() / "f.csv"));
    EXPECT_EQ(expected.at("kernel"), "reference");
    EXPECT_EQ(expected.at("nodes"), kNodes);
    EXPECT_EQ(expected.at("cells"), 24);
    // Edges 2*4*5 + 3*3*5 + 3*4*4, faces 2 * (3*12 + 4*8 + 5*6), cube diagonals 4 * 24.
    EXPECT_EQ(expected.at("springs"), 133 + 196 + 96);
    EXPECT_GT(expected.at("energy").at("volume").get<double>(), 0);

    // Rounding in units of epsilon of the precision: forces of size k h strain cancel among 26 springs and 8 cells.
    const std::pair<const char*, double> cases[] = {{"", 1e-13},
                                                    {"--kernel flat-rows", 1e-13},
                                                    {"--kernel active-rows", 1e-13},
                                                    {"--kernel network", 1e-13},
                                                    {"--precision float", 2e-5},
                                                    {"--precision float --kernel network", 2e-5}};
    for (const auto& [options, tolerance] : cases) {
        const test::ProgramResult result = test::run_program(common + options, directory.path());
        ASSERT_EQ(result.exit_code, 0) << options << result.errors;
        const nlohmann::json json = nlohmann::json::parse(result.output);
        EXPECT_LT(largest_difference(numbers(test::read_text(directory.path() / "f.csv")), forces), tolerance)
            << options;
        for (const char* part : {"springs", "volume"}) {
            const double energy = expected["energy"][part].get<double>();
            EXPECT_NEAR(json["energy"][part].get<double>(), energy, tolerance * energy) << options << " " << part;
        }
        for (const char* key : {"nodes", "springs", "cells"}) {
            EXPECT_EQ(json.at(key), expected.at(key)) << key;
        }
        EXPECT_NE(json.at("kernel"), "reference");
    }
}

void expect_bad(const std::string& csv, const std::string& options, const std::string& message) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", test::small_scene());
    test::write_text(directory.path() / "u.csv", csv);
    const test::ProgramResult result =
        test::run_program("forces s.toml --displacements u.csv --out f.csv " + options, directory.path());
    EXPECT_EQ(result.exit_code, 2) << message;
    EXPECT_EQ(result.output, "");
    EXPECT_EQ(result.errors.rfind("hybmss: error: ", 0), 0u) << result.errors;
    EXPECT_NE(result.errors.find(message), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "f.csv"));
}

TEST(ForcesCommand, bad_input_is_one_line) {
    const std::string good = random_displacements(0.01);
    expect_bad(good + "0,0,0\n", "", "u.csv:61: more rows than the body has nodes; it must be 60 rows");
    expect_bad(good.substr(good.find('\n') + 1), "", "u.csv:59: 59 rows; it must be 60, one a node");
    expect_bad("0,0,0\n0,0\n", "", "u.csv:2: 2 values; a row has three");
    expect_bad("0,0,0\n0,nan,0\n", "", "u.csv:2: \"nan\" is not allowed");
    expect_bad("x,y,z\n0,1e999,0\n", "", "u.csv:2: \"1e999\" is not allowed");
    expect_bad("x,y,z\n0,a,0\n", "", "u.csv:2: \"a\" is not allowed");
    expect_bad("", "", "u.csv:0: 0 rows; it must be 60");
    expect_bad(good, "--kernel spiral",
               "--kernel spiral: not known; allowed are flat-rows, active-rows, network, reference");
    expect_bad(good, "--kernel reference --precision float", "double only");
}

} // namespace
} // namespace hybmss
