#include "studies/paper/tables.hpp"

namespace hybmss::paper {

const std::vector<TableEntry>& tables() {
    static const std::vector<TableEntry> all = {
        {"compression", [](TableContext& c) { return plate_table(Kind::compression, c); }},
        {"tension", [](TableContext& c) { return plate_table(Kind::tension, c); }},
        {"shear", [](TableContext& c) { return plate_table(Kind::shear, c); }},
        {"torsion", [](TableContext& c) { return plate_table(Kind::torsion, c); }},
        {"beam", beam_table},
        {"layers", layer_table},
        {"timing", timing_table},
        {"strain", strain_table},
        {"beam-mesh", beam_mesh_table},
        {"order", order_table},
    };
    return all;
}

} // namespace hybmss::paper
