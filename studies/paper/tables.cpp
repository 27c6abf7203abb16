#include "studies/paper/tables.hpp"

#include "hybmss/version.hpp"

#include <nlohmann/json.hpp>

#include <ostream>

namespace hybmss::paper {

const std::vector<TableEntry>& tables() {
    static const std::vector<TableEntry> all = {
        {"compression", [](TableContext& c) { return plate_table(Kind::compression, c); }},
        {"tension", [](TableContext& c) { return plate_table(Kind::tension, c); }},
        {"shear", [](TableContext& c) { return plate_table(Kind::shear, c); }},
        {"torsion", [](TableContext& c) { return plate_table(Kind::torsion, c); }},
        {"motions", motion_table},
        {"beam", beam_table},
        {"beam-curves", beam_curve_table},
        {"layers", layer_table},
        {"timing", timing_table},
        {"strain", strain_table},
        {"stress", stress_table},
        {"beam-mesh", beam_mesh_table},
        {"order", order_table},
        {"waves", wave_table},
        {"surfaces", surface_table},
    };
    return all;
}

void write_page(const std::vector<Table>& tables, const std::string& calculix, std::ostream& out) {
    out << R"(Printed by `hybmss-study paper --markdown docs/report/paper.md`.

# The paper's experiments

Section 6 of Golec et al. 2020 (see [model.md](../model.md)), every experiment, beside the print and beside finite elements.

- **ours**: the lattice at rest, by `solver.method = "static"` in double to a residual of 1e-8, where the paper stops a motion
  after 10 s. HybMSS has A = 1, HybMSS-FD no face diagonals, HybMSS-CF no volume force. HybMSS-M is ours: springs on means
  and A = 0 ([springs-on-means.md](../springs-on-means.md)).
)"
        << "- **CalculiX**: " << calculix
        << R"(; C3D8I elements on the same mesh, NLGEOM (St Venant and Kirchhoff) unless
  a heading says otherwise. `hybmss-study paper --calculix` runs the program anew;
  `--store studies/paper/calculix_results.json` keeps what it finds.
- **against print**: "agrees" within 2 %, or within the last printed digit of e, with the equilibrium under the
  paper's own energy (below nu = 1/4 the row "(J - 1)^2"); else where the figure was found, by the letters below each
  table. Looked for, one after the other: the size of the plate's force, springs by the E-forms of (5.12), the
  paper's own motion. What none of these gives is unexplained. "FEM" is of the printed finite elements.

)";
    for (const Table& table : tables) {
        print_markdown(table, out);
    }
}

void write_json(const std::vector<Table>& tables, const std::string& calculix, std::ostream& out) {
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const Table& table : tables) {
        all.push_back(to_json(table));
    }
    out << nlohmann::ordered_json{{"version", kVersion}, {"finite_elements", calculix}, {"tables", all}}.dump(1)
        << '\n';
}

} // namespace hybmss::paper
