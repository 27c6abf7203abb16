// `accuracy = X`: the error that is left, the mesh that is chosen, and what is told of it.

#include "hybmss/simulation/solve_to_accuracy.hpp"
#include "simulation/accuracy/mesh_convergence.hpp"
#include "studies/price/price_tables.hpp"
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
        meshes.push_back({n, {{"still", {1}, 1, 1}, {"q", {3 + std::pow(n, -1.5)}, 3, 3}}});
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

TEST(Accuracy, ChangesWithinTheNoiseDoNotCount) {
    std::vector<MeshFigures> meshes;
    for (const double n : {4.0, 8.0}) {
        meshes.push_back({n, {{"exact", {1e-3 / n}, 1e-2, 100}, {"q", {1 + 1 / n}, 1, 1}}});
    }
    EXPECT_EQ(estimate_error(meshes, 1, 1e-9, 1e-5).finest, "q");
    meshes[0].figures.pop_back();
    meshes[1].figures.pop_back();
    EXPECT_EQ(estimate_error(meshes, 1, 1e-9, 0).finest, "exact");
    const ErrorEstimate none = estimate_error(meshes, 1, 1e-9, 1e-5);
    EXPECT_EQ(none.error, 0);
    EXPECT_EQ(none.cells, 8);
    EXPECT_EQ(none.name + none.finest, "");
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
    EXPECT_NE(result.errors.find(" cells for the volume change ("), std::string::npos) << result.errors;
    EXPECT_FALSE(std::filesystem::exists(directory.path() / "out"));
    EXPECT_EQ(test::run_program("explain s.toml", directory.path()).errors, result.errors);
}

/// Turned by the plate, which may move along its axis; or stretched between plates that let it grow thin.
std::string easy_scene(bool stretched, const std::string& accuracy) {
    std::string text = "[body]\nsize = [1, 1, 2]\n[material]\nyoung_modulus = 1e5\npoisson_ratio = 0.3\n"
                       "density = 1000\n[solver]\nmethod = \"static\"\naccuracy = " +
                       accuracy;
    text += stretched ? "\n[[fix]]\nwhere = \"x-min\"\naxes = \"x\"\n[[fix]]\nwhere = \"y-min\"\naxes = \"y\"\n"
                        "[[fix]]\nwhere = \"z-min\"\naxes = \"z\"\n"
                        "[[move]]\nwhere = \"z-max\"\ntranslate = [0, 0, 0.02]\naxes = \"z\"\n"
                      : "\n[[fix]]\nwhere = \"z-min\"\n"
                        "[[move]]\nwhere = \"z-max\"\nrotate = {axis = \"z\", degrees = 1}\naxes = \"xy\"\n";
    // Side faces share the edges of the plates that turn: what those carry depends on the mesh indeed.
    for (const std::string face : {"z-max", "x-max", "x-min"}) {
        if (stretched || face == "z-max") {
            text += "[[probe]]\nname = \"" + face + "\"\nwhere = \"" + face + "\"\n";
        }
    }
    return text;
}

// Forces and torques that are zero up to rounding ask for no mesh.
TEST(Accuracy, WhatIsZeroBySymmetryDoesNotCount) {
    for (const std::string accuracy : {"0.05", "0.01", "1e-4", "1e-6"}) {
        const nlohmann::json stretch = run(easy_scene(true, accuracy));
        EXPECT_TRUE(stretch["accuracy"]["reached"]) << accuracy;
        EXPECT_EQ(stretch["accuracy"]["meshes"].size(), 2u) << accuracy << stretch["accuracy"];
        for (const auto& offer : stretch["accuracy"]["offers"]) {
            EXPECT_EQ(offer["cells"], (std::vector<int>{8, 8, 16})) << accuracy << offer;
        }
    }
    const nlohmann::json torsion = run(easy_scene(false, "0.05"));
    EXPECT_TRUE(torsion["accuracy"]["reached"]);
    EXPECT_LE(torsion["plan"]["cells"], 2 * 20 * 20 * 20) << torsion["accuracy"];
}

// explain solves on the meshes that run begins with, and all of them where they are small.
TEST(Accuracy, IsJudgedByExplainAsByRun) {
    for (const std::string accuracy : {"0.1", "0.05", "0.02"}) {
        for (const std::string& scene : {static_scene("size = [1, 1, 1]\n", "accuracy = " + accuracy + "\n"),
                                         static_scene("cells = [6, 6, 6]\ncell_size = 0.2\n", "accuracy = 0.1\n"),
                                         easy_scene(false, accuracy), easy_scene(true, accuracy)}) {
            test::TemporaryDirectory directory;
            test::write_text(directory.path() / "s.toml", scene);
            const std::string told = test::run_program("explain s.toml", directory.path()).output;
            const nlohmann::json summary = run(scene);
            const auto holds = [&](const std::string& part) {
                EXPECT_NE(told.find(part), std::string::npos) << accuracy << " " << part << '\n' << told;
            };
            const auto& last = summary["accuracy"]["meshes"].back()["cells"];
            const std::string cells = std::to_string(last[0].get<int>()) + " x " + std::to_string(last[1].get<int>()) +
                                      " x " + std::to_string(last[2].get<int>());
            holds("grid                 " + cells + " cells");
            holds(cells + " cells, solved now");
            holds(summary["accuracy"]["reached"] ? ": within the wish" : ": above the wish");
            holds(summary["accuracy"]["quantity"]);
        }
    }
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
