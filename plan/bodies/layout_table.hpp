#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"
#include "plan/bodies/body.hpp"

#include <memory>
#include <string>
#include <vector>

namespace hybmss {

// One table, in layout_table.cpp, says what there is to know of each layout by its name; nobody else knows names.

/// Every layout that a lattice can be planned in, its own ones first, each once: "network" is another name of one; and
/// flat-rows along z, which stands for all other axes.
std::vector<std::string> distinct_lattice_layouts();

/// Whether a lattice can be a network too: not with crush resistance, nor with volume forces of its tissues' own.
bool can_be_network(const Lattice& lattice, const Material& material);

/// The layout that a lattice gets where nothing is timed: active-rows where at most six of ten cells are filled (half
/// at `exact`, whose bits stay) and rows cut into vectors of 16 store less than 3/4 of the grid's nodes; else
/// flat-rows. The same on every machine.
std::string estimated_layout(const Lattice& lattice, Accuracy accuracy);

/// The same where steps are taken, unless at `exact`: flat-rows may then have the axes by which a step costs the least,
/// "flat-rows-zxy" with rows along z and planes normal to y. Forces alone stay with rows along x: to bring a caller's
/// nodes into other rows costs more than the sweep gains.
std::string estimated_step_layout(const Lattice& lattice, Accuracy accuracy);
/// What is timed for a lattice: the layouts that it can have, and flat-rows with those axes besides its own that cost
/// the least.
std::vector<std::string> layouts_to_try(const Lattice& lattice, const Material& material);

/// Whether a name is one of a layout that a lattice can have, or a network.
bool is_layout(const std::string& name, bool of_network);
/// Whether PlanOptions::one_tile matters to a layout.
bool has_tiles(const std::string& layout);

/// Whether bodies in a layout can lose cells while they move; and for messages, which can: "flat-rows and active-rows".
bool can_be_cut(const std::string& layout);
std::string layouts_that_can_be_cut();

/// How much there is of a lattice that is not made yet.
struct LatticeExtent {
    double grid_nodes;   ///< of the box around it
    double cells, nodes; ///< that are there
    double active_lanes; ///< of active rows along x, in vectors of 16
};

/// Bytes that a plan of a lattice and its state take at most, about. `layout` "": of the plan's own choice. Throws
/// std::invalid_argument for a layout that is not known.
double plan_bytes(const std::string& layout, const LatticeExtent& extent, Precision precision);

/// Throws std::invalid_argument for a bad material or network, and for a layout that is not one of its kind of body.
template <class T>
std::unique_ptr<Body<T>> make_body(const Lattice& lattice, const Material& material, const PlanOptions& options);
template <class T>
std::unique_ptr<Body<T>> make_body(const Network& network, const PlanOptions& options);

} // namespace hybmss
