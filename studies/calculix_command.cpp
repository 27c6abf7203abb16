#include "app/command_line.hpp"
#include "app/progress_line.hpp"
#include "simulation/geometry/cells.hpp"
#include "simulation/results/results.hpp"
#include "simulation/scene/scene_body.hpp"
#include "studies/calculix/program.hpp"
#include "studies/commands.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

namespace {

using namespace hybmss;

struct CalculixArguments {
    std::string scene, out;
    bool linear = false, force = false;
};

void run_calculix(const CalculixArguments& arguments) {
    const Scene scene = load_scene(arguments.scene);
    check_output("--out", arguments.out, {"<?xmlversion=\"1.0\"?><VTKFile", {arguments.scene}, arguments.force});
    calculix::Problem problem =
        calculix::scene_problem(scene, calculix::ElementType::c3d8i,
                                arguments.linear ? calculix::Geometry::linear : calculix::Geometry::nonlinear);
    problem.stresses = true;
    ProgressLine line(stderr);
    line.show("CalculiX");
    const calculix::Solution solution = calculix::solve(problem);
    line.clear();

    const std::vector<std::array<std::uint32_t, 8>> cells = cell_corners(scene_lattice(scene));
    const std::vector<Vector3>& u = solution.displacements;
    std::vector<Vector3> points = problem.mesh.rest;
    for (std::size_t n = 0; n < points.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            points[n][a] += u[n][a];
        }
    }
    std::vector<CellStress> stresses;
    std::vector<double> ratios;
    for (std::size_t c = 0; c < cells.size(); ++c) {
        stresses.emplace_back().cauchy = solution.stresses[c];
        ratios.push_back(1 + volume_ratio_minus_one(u, cells[c], scene.body.cell_size));
    }
    const VtuStress stress = vtu_stress(stresses, cells, points.size());
    write_vtu(arguments.out, {.points = points,
                              .cells = cells,
                              .displacement = u,
                              .velocity = std::vector<Vector3>(points.size()),
                              .volume_ratio = ratios,
                              .label = {},
                              .stress = &stress});
    fmt::print("{}: {} elements, {:.3g} s\n", arguments.out, cells.size(), solution.seconds);
}

} // namespace

void add_calculix_command(CLI::App& app) {
    const auto arguments = std::make_shared<CalculixArguments>();
    CLI::App* command =
        app.add_subcommand("calculix", "a scene's equilibrium by CalculiX, of a C3D8I element a cell, as a .vtu file");
    command->add_option("SCENE", arguments->scene, "scene file (TOML)")->required();
    command->add_option("--out", arguments->out, "the .vtu file")->required()->check(a_path());
    command->add_flag("--linear", arguments->linear, "small strain; else NLGEOM");
    add_force_option(*command, arguments->force);
    command->callback([arguments] { run_calculix(*arguments); });
}
