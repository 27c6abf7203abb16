#include "studies/textbook/problem.hpp"

#include "studies/calculix/program.hpp"
#include "studies/paper/experiment.hpp"
#include "studies/paper/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>

namespace hybmss::textbook {
namespace {

/// Linear problems at strains of 1e-8 agree no better, whatever the mesh.
constexpr double kRounding = 1e-8;

} // namespace

Material unit_material(const Problem& problem, SpringForm springs) {
    const Material material{.young_modulus = 1, .poisson_ratio = problem.poisson_ratio, .density = 1};
    return paper::with_model(material, springs == SpringForm::means ? paper::Model::hybmss_m : paper::Model::hybmss);
}

std::vector<Problem> all_problems() {
    std::vector<Problem> all = static_problems();
    std::ranges::move(motion_problems(), std::back_inserter(all));
    std::ranges::move(vibration_problems(), std::back_inserter(all));
    return all;
}

paper::Table problem_table(bool quick, const std::function<void(const std::string&)>& progress) {
    paper::Table table{
        "problems",
        "Textbook problems",
        {"E = 1 Pa, 1 kg/m^3, lengths of 1 m, in double on one thread; HybMSS with A = 1 and HybMSS-M (springs on "
         "means, A = 0). Linear problems at strains of 1e-8. `order` is that in which the error falls from the row "
         "above; \"rounding\": exact on every mesh, as far as the strain allows; \"theory\": the exact column itself "
         "leaves something out."},
        {{"problem", "problem"},
         {"poisson_ratio", "nu"},
         {"springs", "springs"},
         {"mesh", "mesh"},
         {"exact", "exact", -6},
         {"ours", "ours", -6},
         {"error", "error, %", -3},
         {"order", "order", 2},
         {"seconds", "s", -2}},
        {},
        {"Patch tests: a homogeneous deformation is led on the surface, and is found inside. Stretched bar: thirteen "
         "springs and a volume in closed form. The slope is 0.8, the coefficient of friction 0.5.",
         "Bent bar: 1 x 1 x 4, its ends free to warp and shrink, so that the exact solution is one of three "
         "dimensions. Springs on means bend exactly, and two cells across twist exactly, by their making.",
         "Cantilever: 1 x 1 x 10. Timoshenko's theory knows nothing of the width that the clamp holds; some 0.7 % "
         "remain.",
         "Hung bar: 1 x 1 x 4, held above in the displacements of the exact solution.",
         "Kirsch: a plate in plane strain whose outer edges have the exact displacements; round holes are stairs. The "
         "opening agrees; the greatest stress of a cell does not converge to 3: it grows at the stairs' inner corners.",
         "Lame: radii 1/2 and 1; stairs, of the first order. The radius grows by the work of the pressure.",
         "Hertz: nodes that touch are found one by one; the block's far faces have the displacements of Boussinesq's "
         "point force.",
         "Bouncing rod: contact lasts 2 L / c. A lattice's waves of different lengths run apart, which is why the "
         "order is two thirds.",
         "Hinged bar: 1 x 1 x 5, its ends held across the axis. Column: 1 x 1 x 20, likewise; the load at which the "
         "lowest omega^2 of the pressed bar comes to zero. Euler leaves out shear, 0.6 % of it here, and the "
         "shortening. Slender column: 1 x 1 x 40, by `EquilibriumSolver::buckling`; a fourth of both.",
         "C3D20: by CalculiX, 8 cells across a cube and 6 across a bar of 1 x 1 x 5, with its own masses; equal "
         "frequencies counted once, and all found in the time of the first.",
         "Waves: other directions are in [paper.md](paper.md), by a Bloch wave's matrix."}};
    std::vector<Problem> problems = all_problems();
    if (!quick && calculix::is_installed()) {
        std::ranges::move(calculix_problems(), std::back_inserter(problems));
    }
    for (const Problem& problem : problems) {
        for (const SpringForm springs : {SpringForm::nodes, SpringForm::means}) {
            double before = 0;
            for (std::size_t m = 0; m < problem.meshes.size() && !(quick && m > 1); ++m) {
                const int mesh = problem.meshes[m];
                progress(fmt::format("{}, {} {}", problem.name, mesh, problem.mesh));
                const auto start = std::chrono::steady_clock::now();
                const Answer answer = problem.solve(unit_material(problem, springs), mesh);
                const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
                const double error = answer.error();
                paper::Cell order;
                if (problem.agreement == Agreement::rounding || std::abs(error) < kRounding) {
                    order = std::string("rounding");
                } else if (problem.agreement == Agreement::theory) {
                    order = std::string("theory");
                } else if (m > 0) {
                    order = paper::observed_order(std::abs(before), problem.meshes[m - 1], std::abs(error), mesh);
                }
                before = error;
                table.rows.push_back({problem.name, fmt::format("{:g}", problem.poisson_ratio),
                                      std::string(springs == SpringForm::means ? "means" : "nodes"),
                                      fmt::format("{} {}", mesh, problem.mesh), answer.exact, answer.ours, 100 * error,
                                      order, taken.count()});
            }
        }
    }
    return table;
}

} // namespace hybmss::textbook
