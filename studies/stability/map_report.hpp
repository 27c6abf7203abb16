#pragma once

/// \file
/// The stability map as a table and as JSON.

#include "studies/stability/stability_map.hpp"

#include <nlohmann/json_fwd.hpp>

#include <ostream>

namespace hybmss::stability {

/// One line a material and loading: from which stretch to which the homogeneous lattice is stable, and what ends it.
void print_map(const std::vector<MapRow>& rows, std::ostream& out);

nlohmann::ordered_json map_json(const std::vector<MapRow>& rows);
nlohmann::ordered_json sheets_json(const std::vector<MapSheet>& sheets);

} // namespace hybmss::stability
