#include "studies/paper/experiment.hpp"
#include "studies/paper/tables.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hybmss::paper {
namespace {

std::string mesh_text(const Experiment& experiment) {
    const auto [nx, ny, nz] = mesh(experiment);
    return fmt::format("{} x {} x {}", nx, ny, nz);
}

/// The tip of so stiff a beam moves by a thousandth of its length: all is in proportion to the load.
Experiment stiff_beam(int across) {
    return {.kind = Kind::beam, .young_modulus = 1e9, .across = across};
}

} // namespace

Table beam_table(TableContext& context) {
    Table table{"beam",
                "Fig. 5: the tip of the beam under its own weight",
                {"0.4 x 0.4 x 2.4 m, clamped at one end, nu = 0.25, g = 10 m/s^2, 1000 kg/m^3 (the print gives no "
                 "density; this one reproduces its range). The figure of the paper has no numbers: beside it stands "
                 "its analytical curve (6.1), Euler and Bernoulli, which is linear and without shear. `shortening` "
                 "says how far the tip is drawn back: (6.1) knows nothing of it, and at E = 2 MPa it is what counts."},
                {{"young_modulus", "E, MPa"},
                 {"mesh", "mesh"},
                 {"model", "model"},
                 {"euler_bernoulli", "(6.1), m", 4},
                 {"ours", "ours, m", 4},
                 {"calculix", "CalculiX, m", 4},
                 {"to_calculix", "ours to CalculiX, %", 1},
                 {"shortening", "shortening, m", 4}},
                {},
                {}};
    for (const double E : {1e7, 2e6}) {
        for (const int across : {4, 8}) {
            const Experiment beam{.kind = Kind::beam, .young_modulus = E, .across = across};
            const Figures& calculix = context.finite_elements.figures(beam);
            for (const Model model : kModels) {
                context.progress(key(beam) + " " + std::string(name(model)));
                const Figures ours = solve_lattice(beam, model);
                const bool both = ours.good() && calculix.good();
                table.rows.push_back({fmt::format("{:g}", E / 1e6), mesh_text(beam), std::string(name(model)),
                                      beam_theory(beam).bending, ours.good() ? Cell(ours.response) : Cell(),
                                      calculix.good() ? Cell(calculix.response) : Cell(),
                                      both ? Cell(100 * (ours.response / calculix.response - 1)) : Cell(),
                                      ours.good() ? Cell(-ours.pictured.back()[2]) : Cell()});
            }
        }
    }
    table.remarks = {
        "As printed: HybMSS comes nearer as the mesh grows finer, while HybMSS-FD passes the right answer and "
        "grows softer still, because its compressed side wrinkles (Fig. 6).",
        "At nu = 0.25 HybMSS-CF is HybMSS: kappa = 0.", "HybMSS-M has no face diagonals either, and does not wrinkle."};
    return table;
}

Table beam_curve_table(TableContext& context) {
    Table table{
        "beam-curves",
        "Fig. 5: the beam's axis",
        {"Where the points of the axis come to, x along the beam at rest, y upward, each printed method's x and y "
         "in m; clamped at x = 0. [Drawn](../gallery.md#the-papers-figures)."},
        {{"young_modulus", "E, MPa"}, {"rest", "x at rest", 1}, {"euler_bernoulli", "(6.1), y", 4}},
        {},
        {}};
    for (const char* method : {"FD, 4x4x24", "HybMSS, 4x4x24", "FD, 8x8x48", "HybMSS, 8x8x48", "CalculiX, 8x8x48"}) {
        for (const char* axis : {"x", "y"}) {
            table.columns.push_back({fmt::format("{}, {}", method, axis), fmt::format("{}, {}", method, axis), 4});
        }
    }
    for (const double E : context.quick ? std::vector<double>{1e7} : std::vector<double>{1e7, 2e6}) {
        const auto beam = [E](int across) {
            return Experiment{.kind = Kind::beam, .young_modulus = E, .across = across};
        };
        std::vector<Figures> methods;
        for (const int across : {4, 8}) {
            for (const Model model : {Model::hybmss_fd, Model::hybmss}) {
                context.progress(key(beam(across)) + " " + std::string(name(model)));
                methods.push_back(context.quick && across > 4 ? Figures{} : solve_lattice(beam(across), model));
            }
        }
        methods.push_back(context.finite_elements.figures(beam(8)));
        constexpr std::size_t kPoints = 12; // every second node of the coarse mesh
        const double length = 2.4, tip = beam_theory(beam(4)).bending;
        for (std::size_t point = 0; point <= kPoints; ++point) {
            const double part = static_cast<double>(point) / kPoints, x = length * part;
            auto& row = table.rows.emplace_back();
            row = {fmt::format("{:g}", E / 1e6), x, -tip * part * part * (6 - 4 * part + part * part) / 3};
            for (const Figures& figures : methods) {
                const bool good = figures.good() && !figures.pictured.empty();
                const auto& u =
                    good ? figures.pictured[point * (figures.pictured.size() - 1) / kPoints] : std::array<double, 3>{};
                row.push_back(good ? Cell(x + u[2]) : Cell());
                row.push_back(good ? Cell(u[1]) : Cell());
            }
        }
    }
    return table;
}

Table beam_mesh_table(TableContext& context) {
    const Experiment fine = stiff_beam(8);
    const ElementChoice quadratic{calculix::ElementType::c3d20, calculix::Geometry::linear};
    const ElementChoice same{calculix::ElementType::c3d8i, calculix::Geometry::linear};
    const Figures& reference = context.finite_elements.figures(fine, quadratic);
    const BeamTheory theory = beam_theory(fine);
    Table table{
        "beam-mesh",
        "Beam deflection and the mesh",
        {"The same beam at E = 1 GPa, where the tip moves by a thousandth of the length and every law is linear; "
         "HybMSS with A = 1, HybMSS-M (springs on means) with A = 0. The last columns are the distances from "
         "CalculiX's fine answer, C3D20 on 8 x 8 x 48, and from Euler and Bernoulli (6.1)."},
        {{"mesh", "mesh"},
         {"ours", "HybMSS, mm", 4},
         {"on_means", "HybMSS-M, mm", 4},
         {"calculix_c3d8i", "C3D8I, mm", 4},
         {"calculix_c3d20", "C3D20, mm", 4},
         {"to_fine", "HybMSS to fine C3D20, %", 2},
         {"on_means_to_fine", "HybMSS-M to fine C3D20, %", 2},
         {"to_euler_bernoulli", "HybMSS to (6.1), %", 2},
         {"order", "observed order", 2}},
        {},
        {}};
    const auto millimeters = [](const Figures& figures) {
        return figures.good() ? Cell(1e3 * figures.response) : Cell();
    };
    double before = 0;
    for (const int across : context.quick ? std::vector<int>{1, 2, 4, 8} : std::vector<int>{1, 2, 4, 8, 16, 32}) {
        const Experiment beam = stiff_beam(across);
        context.progress(key(beam));
        const Figures ours = solve_lattice(beam, Model::hybmss);
        const Figures on_means = solve_lattice(beam, Model::hybmss_m);
        const double error = reference.good() && ours.good() ? ours.response / reference.response - 1 : 0;
        table.rows.push_back(
            {mesh_text(beam), millimeters(ours), millimeters(on_means),
             across <= 8 ? millimeters(context.finite_elements.figures(beam, same)) : Cell(),
             across <= 8 ? millimeters(context.finite_elements.figures(beam, quadratic)) : Cell(),
             error == 0 ? Cell() : Cell(100 * error),
             reference.good() && on_means.good() ? Cell(100 * (on_means.response / reference.response - 1)) : Cell(),
             100 * (ours.response / theory.bending - 1),
             before == 0 || error == 0 ? Cell() : Cell(std::log2(std::abs(before / error)))});
        before = error;
    }
    table.remarks = {
        fmt::format(
            "Euler and Bernoulli: {:.4f} mm, bending alone. Timoshenko adds {:.4f} mm for shear ({:.2f} %): {:.4f} mm.",
            1e3 * theory.bending, 1e3 * theory.shear, 100 * theory.shear / theory.bending,
            1e3 * (theory.bending + theory.shear)),
        fmt::format("The clamp takes {:.2f} % back: it holds the section's width too, which bending wants to change "
                    "(Poisson's ratio), and keeps it plane, which shear does not. Rod theories let both free. So fine "
                    "finite elements stand {:+.2f} % from (6.1), and so does the lattice on a fine mesh.",
                    100 * (theory.bending + theory.shear - reference.response) / theory.bending,
                    100 * (reference.response / theory.bending - 1)),
        "Coarse lattices of HybMSS are stiffer than C3D8I: those elements carry bending modes of their own, while a "
        "lattice's cells bend only by shear. HybMSS-M's cells bend too. Towards the end the "
        "error of the fine C3D20 answer itself, some 0.1 %, shows in the order."};
    return table;
}

} // namespace hybmss::paper
