#include "studies/paper/printed_figures.hpp"
#include "studies/paper/tables.hpp"

#include <fmt/format.h>

namespace hybmss::paper {

Table layer_table(TableContext& context) {
    Table table{
        "layers",
        "Fig. 8 and 10: distance of the middle layer from finite elements",
        {"The mean distance between the nodes of the middle layer (shear: z = 2.5 m, 20 %; torsion: y = 2.5 m, 45 "
         "degrees) of the lattice and of finite elements on the same mesh: of LS-DYNA in the print, of CalculiX "
         "here. The cube's edge is 5 m."},
        {{"experiment", "experiment"},
         {"poisson_ratio", "nu"},
         {"model", "model"},
         {"paper_hybmss", "paper, m", 3},
         {"ours", "to CalculiX, m", 4},
         {"ours_neo_hooke", "to neo-Hooke, m", 4},
         {"calculix", "CalculiX to neo-Hooke, m", 4}},
        {},
        {"Two finite element laws (last column) lie as far from each other as the lattice from either: this distance "
         "tells laws apart, not the right model from the wrong.",
         "At nu = 0.499 St Venant and Kirchhoff do not keep the volume (see Table 2); HybMSS and neo-Hooke do.",
         "HybMSS lies nearer to CalculiX than the print to LS-DYNA in most rows: the print compares a motion "
         "after 10 s, and with another law.",
         "HybMSS-FD at nu = 0 has no equilibrium under 45 degrees."}};
    for (const Kind kind : {Kind::shear, Kind::torsion}) {
        for (const double nu : {0.0, 0.25, 0.499}) {
            const Experiment experiment{
                .kind = kind, .amount = kind == Kind::torsion ? 45.0 : 20.0, .poisson_ratio = nu};
            const Figures& calculix = context.finite_elements.figures(experiment);
            const Figures& neo_hooke = context.finite_elements.figures(
                experiment, {.geometry = calculix::Geometry::nonlinear, .law = calculix::Law::neo_hooke});
            const auto distance = [](const Figures& a, const Figures& b) {
                return a.good() && b.good() ? Cell(mean_distance(a, b)) : Cell();
            };
            for (const Model model : kModels) {
                context.progress(key(experiment) + " " + std::string(name(model)));
                const Figures ours = solve_lattice(experiment, model);
                const auto printed = model == Model::hybmss ? printed_distance(experiment) : std::nullopt;
                table.rows.push_back({std::string(name(kind)), fmt::format("{:g}", nu), std::string(name(model)),
                                      printed ? Cell(*printed) : Cell(), distance(ours, calculix),
                                      distance(ours, neo_hooke), distance(calculix, neo_hooke)});
            }
        }
    }
    return table;
}

} // namespace hybmss::paper
