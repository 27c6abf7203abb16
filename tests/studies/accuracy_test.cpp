// `accuracy = X`: the error that is left, the mesh that is chosen, and what is told of it.

#include "hybmss/simulation/solve_to_accuracy.hpp"
#include "simulation/accuracy/mesh_convergence.hpp"
#include "studies/price/wish_cases.hpp"
#include "tests/program.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <cmath>

namespace hybmss {
namespace {

TEST(Accuracy, IsKept) {
    // A part of the cases, and wishes that coarse meshes grant; `hybmss-study price accuracy` goes further.
    int kept = 0, all = 0;
    for (const price::WishCase& wish : price::wish_cases()) {
        const std::vector<ResultFigure> limit = price::limit_figures(wish.scene, wish.reference_across);
        const price::WishResult result = price::solve_wish(wish, 0.05, limit);
        EXPECT_EQ(result.failure, "") << wish.name;
        EXPECT_LE(result.estimate, 0.05) << wish.name;
        EXPECT_LT(result.error, 0.1) << wish.name;
        ++all;
        kept += result.error < 0.05;
    }
    EXPECT_GE(10 * kept, 9 * all) << kept << " of " << all;
}

TEST(Accuracy, EstimateIsThatOfAKnownOrder) {
    // q(n) = 3 + n^-1.5 beside one that does not change.
    std::vector<MeshFigures> meshes;
    for (const double n : {4.0, 8.0, 20.0}) {
        meshes.push_back({n, {{"still", {1}, 1}, {"q", {3 + std::pow(n, -1.5)}, 3}}});
    }
    const ErrorEstimate estimate = estimate_error(meshes, 1, 1e-4);
    EXPECT_EQ(estimate.name, "q");
    EXPECT_NEAR(estimate.order, 1.5, 1e-9);
    EXPECT_NEAR(estimate.error, std::pow(20, -1.5) / 3, 1e-12);
    EXPECT_NEAR(estimate.cells, std::pow(3e-4, -1 / 1.5), 1e-6);
    // Two meshes: the order that is assumed.
    meshes.pop_back();
    EXPECT_NEAR(estimate_error(meshes, 1, 1e-4).error, (std::pow(4, -1.5) - std::pow(8, -1.5)) / 3, 1e-12);
}

TEST(Accuracy, MeshesFillTheBox) {
    EXPECT_EQ(whole_ratio({0.4, 0.4, 2.4}), (std::array<std::int64_t, 3>{1, 1, 6}));
    EXPECT_EQ(whole_ratio({1, 1.5, 2}), (std::array<std::int64_t, 3>{2, 3, 4}));
    EXPECT_EQ(whole_ratio({1, std::sqrt(2), 1}), (std::array<std::int64_t, 3>{0, 0, 0}));
    Scene scene;
    scene.body.cells = {2, 1, 1};
    scene.body.cell_size = 0.5;
    scene.body.labels = {3, 0};
    const SceneBody fine = MeshFamily(scene).body(2);
    EXPECT_EQ(fine.cell_size, 0.25);
    EXPECT_EQ(fine.labels, (std::vector<std::uint8_t>{3, 3, 0, 0, 3, 3, 0, 0, 3, 3, 0, 0, 3, 3, 0, 0}));
}

std::string static_scene(const std::string& body, const std::string& accuracy) {
    return "[body]\n" + body +
           "[material]\nyoung_modulus = 1e4\npoisson_ratio = 0.3\ndensity = 1000\n[[fix]]\nwhere = \"y-min\"\n"
           "[[move]]\nwhere = \"y-max\"\ntranslate = [0, -0.05, 0]\n[solver]\nmethod = \"static\"\n" +
           accuracy + "[[probe]]\nname = \"plate\"\nwhere = \"y-max\"\n";
}

nlohmann::json run(const std::string& scene, int exit_code = 0, const std::string& options = "") {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", scene);
    const test::ProgramResult result = test::run_program("run s.toml --out out " + options, directory.path());
    EXPECT_EQ(result.exit_code, exit_code) << result.errors;
    return nlohmann::json::parse(test::read_text(directory.path() / "out" / "summary.json"));
}

TEST(Accuracy, ChoosesMeshAndType) {
    const nlohmann::json loose = run(static_scene("size = [1, 1, 1.5]\n", "accuracy = 0.05\n"));
    EXPECT_TRUE(loose["accuracy"]["reached"]);
    EXPECT_EQ(loose["plan"]["precision"], "float");
    EXPECT_EQ(loose["accuracy"]["kernel"], "accurate");
    EXPECT_GE(loose["accuracy"]["meshes"].size(), 2u);
    EXPECT_EQ(loose["accuracy"]["meshes"].back()["cells"][2],
              loose["accuracy"]["meshes"].back()["cells"][0].get<int>() * 3 / 2);
    const nlohmann::json tight =
        run(static_scene("size = [1, 1, 1.5]\n", "accuracy = 0.01\n"), 0, "--precision double");
    EXPECT_EQ(tight["plan"]["precision"], "double");
    EXPECT_GT(tight["plan"]["cells"], loose["plan"]["cells"]);
    // The next digit costs more cells, memory and time.
    const auto& offers = tight["accuracy"]["offers"];
    ASSERT_GE(offers.size(), 3u);
    for (std::size_t i = 1; i < offers.size(); ++i) {
        EXPECT_LT(offers[i]["accuracy"], offers[i - 1]["accuracy"]);
        EXPECT_GT(offers[i]["bytes"], offers[i - 1]["bytes"]);
        EXPECT_GT(offers[i]["seconds"], offers[i - 1]["seconds"]);
    }
}

// Kernels need not be better than what a node may be left unbalanced by.
TEST(Accuracy, ChoosesTheKernelsByTheTolerance) {
    const nlohmann::json summary = run(static_scene("size = [1, 1, 1]\n", "accuracy = 0.1\ntolerance = 0.02\n"));
    EXPECT_EQ(summary["accuracy"]["kernel"], "fast");
    EXPECT_EQ(summary["accuracy"]["offers"][0]["kernel"], "fast");
    EXPECT_TRUE(summary["accuracy"]["reached"]);
}

TEST(Accuracy, OfAGivenMeshIsToldAndNotForced) {
    const nlohmann::json summary = run(static_scene("cells = [4, 4, 4]\ncell_size = 0.25\n", "accuracy = 1e-3\n"));
    EXPECT_EQ(summary["plan"]["cells"], 64);
    EXPECT_FALSE(summary["accuracy"]["reached"]);
    ASSERT_EQ(summary["warnings"].size(), 1u);
    EXPECT_NE(summary["warnings"][0].get<std::string>().find("the mesh is too coarse"), std::string::npos);
    // 3 x 4 x 5 cells have no coarser mesh: a finer one tells, and the results are those of the scene's own.
    const nlohmann::json odd = run(static_scene("cells = [3, 4, 5]\ncell_size = 0.25\n", "accuracy = 0.1\n"));
    EXPECT_EQ(odd["plan"]["cells"], 60);
    EXPECT_EQ(odd["accuracy"]["meshes"].size(), 2u);
}

TEST(Accuracy, WithoutRoomSaysWhatCanBeHad) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", static_scene("size = [1, 1, 1]\n", "accuracy = 1e-9\n"));
    const test::ProgramResult result = test::run_program("run s.toml --out out", directory.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.errors.find("s.toml:14:12: solver.accuracy = 1e-9: it needs about"), std::string::npos)
        << result.errors;
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "out"));
}

TEST(Accuracy, SingleNodesAreRefused) {
    std::string scene = static_scene("size = [1, 1, 1]\n", "accuracy = 0.1\n");
    scene.replace(scene.rfind("\"y-max\""), 7, "{node = 3}");
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", scene);
    const test::ProgramResult result = test::run_program("run s.toml", directory.path());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_NE(result.errors.find("s.toml:17:9: probe.where = {node = 3}: with solver.accuracy"), std::string::npos)
        << result.errors;
}

TEST(Accuracy, IsOfferedByExplain) {
    test::TemporaryDirectory directory;
    test::write_text(directory.path() / "s.toml", static_scene("size = [1, 1, 1]\n", "accuracy = 0.02\n"));
    const test::ProgramResult result = test::run_program("explain s.toml", directory.path());
    EXPECT_EQ(result.exit_code, 0) << result.errors;
    for (const char* part : {"accuracy", "the mesh is free", "  the wish", "0.002", "0.0002"}) {
        EXPECT_NE(result.output.find(part), std::string::npos) << part << '\n' << result.output;
    }
}

} // namespace
} // namespace hybmss
