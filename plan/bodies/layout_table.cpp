#include "plan/bodies/layout_table.hpp"

#include "layouts/lattice/lattice_arrays.hpp"
#include "layouts/messages.hpp"
#include "plan/bodies/lattice_body.hpp"
#include "plan/bodies/network_body.hpp"
#include "plan/bodies/packed_network_body.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>

namespace hybmss {
namespace {

// ---- the table

/// What a body is made of: a lattice with its material, or a network.
struct Given {
    const Lattice* lattice;
    const Material* material;
    const Network* network;
};

template <class T>
using Make = std::unique_ptr<Body<T>> (*)(const Given&, const PlanOptions&);

/// A row: a layout's name, and all that depends on it.
struct Layout {
    const char* name;
    bool of_networks; ///< else of lattices
    bool can_be_cut;
    bool has_tiles;
    /// Of a plan and its state, for numbers of `real` bytes.
    double (*bytes)(const LatticeExtent& extent, double real);
    std::tuple<Make<float>, Make<double>> make;
};

// Nine components of state and force, up to eight weights.
double flat_rows_bytes(const LatticeExtent& extent, double real) {
    return 17 * real * extent.grid_nodes;
}
/// A node of sparse rows may be a run of its own.
double active_rows_bytes(const LatticeExtent& extent, double real) {
    return 17 * real * extent.active_lanes + 32 * extent.nodes;
}
/// 13 springs and one cell a node: as given, coloured, and while they are sorted.
double network_bytes(const LatticeExtent& extent, double real) {
    return extent.nodes * (17 * real + 13 * 2 * 48.0 + 2 * 64.0);
}

/// The axes that a name asks for, "flat-rows-zxy" for rows along z and planes normal to y.
std::optional<LatticeAxes> axes_of(std::string_view name);

template <class T>
std::unique_ptr<Body<T>> make_flat(const Given& given, const PlanOptions& options) {
    const LatticeAxes axes = axes_of(options.layout).value_or(plain_axes(*given.lattice));
    return std::make_unique<LatticeBody<T>>(*given.lattice, *given.material, options, LatticeRows{false, axes});
}
template <class T>
std::unique_ptr<Body<T>> make_active(const Given& given, const PlanOptions& options) {
    return std::make_unique<LatticeBody<T>>(*given.lattice, *given.material, options, LatticeRows{true, {}});
}
template <class T>
std::unique_ptr<Body<T>> make_packed(const Given& given, const PlanOptions& options) {
    return std::make_unique<PackedNetworkBody<T>>(*given.network, options);
}
template <class T>
std::unique_ptr<Body<T>> make_coloured(const Given& given, const PlanOptions& options) {
    return std::make_unique<NetworkBody<T>>(*given.network, options);
}

// clang-format off
//   name            of networks  can be cut  has tiles  bytes              make
constexpr Layout kLayouts[] = {
    {"flat-rows",    false,       true,       true,      flat_rows_bytes,   {make_flat<float>, make_flat<double>}},
    {"active-rows",  false,       true,       true,      active_rows_bytes, {make_active<float>, make_active<double>}},
    {"packed-xyzw",  true,        false,      true,      network_bytes,     {make_packed<float>, make_packed<double>}},
    {"coloured-soa", true,        false,      false,     network_bytes,     {make_coloured<float>, make_coloured<double>}},
};
// clang-format on

constexpr const Layout& kDense = kLayouts[0];
constexpr const Layout& kSparse = kLayouts[1];
/// Which no other layout has beaten on any network measured.
constexpr const Layout& kOfNetworks = kLayouts[2];
/// For a lattice, another name of that.
constexpr const char* kNetwork = "network";

// ---- names

std::string with_axes(const LatticeAxes& axes) {
    return std::string(kDense.name) + "-" + word_of(axes);
}

std::optional<LatticeAxes> axes_of(std::string_view name) {
    LatticeAxes axes = {0, 1, 2};
    do {
        if (name == with_axes(axes)) {
            return axes;
        }
    } while (std::next_permutation(axes.begin(), axes.end()));
    return std::nullopt;
}

const Layout* find(const std::string& name) {
    if (name == kNetwork) {
        return &kOfNetworks;
    }
    if (axes_of(name)) {
        return &kDense;
    }
    const auto* found = std::find_if(std::begin(kLayouts), std::end(kLayouts),
                                     [&](const Layout& layout) { return layout.name == name; });
    return found == std::end(kLayouts) ? nullptr : found;
}

template <class Holds>
std::vector<std::string> names_where(const Holds& holds) {
    std::vector<std::string> names;
    for (const Layout& layout : kLayouts) {
        if (holds(layout)) {
            names.emplace_back(layout.name);
        }
    }
    return names;
}

[[noreturn]] void refuse_layout(const std::string& given, const std::vector<std::string>& known) {
    throw std::invalid_argument("layout \"" + given + "\" is not known for this body: it must be one of " +
                                joined(known, ", "));
}

/// Of a lattice: a network's layouts by their own names too, so that what a plan says it chose can be asked for again.
const Layout& lattice_layout(const std::string& name) {
    const Layout* layout = find(name);
    if (!layout) {
        refuse_layout(name, lattice_layouts());
    }
    return *layout;
}

/// How many orders of the axes beside the plain one are worth a try, those that cost the least.
constexpr std::size_t kOrders = 2;

/// Few enough of the cells are there: in a ball, a little more than half.
bool is_sparse(double cells, double grid_cells, Accuracy accuracy) {
    return cells <= (accuracy == Accuracy::exact ? 0.5 : 0.6) * grid_cells;
}

// ---- bodies

template <class T>
std::unique_ptr<Body<T>> make(const Layout& layout, const Given& given, const PlanOptions& options) {
    PlanOptions named = options;
    named.layout = axes_of(options.layout) ? options.layout : layout.name;
    return std::get<Make<T>>(layout.make)(given, named);
}

} // namespace

std::vector<std::string> lattice_layouts() {
    std::vector<std::string> names = names_where([](const Layout& layout) { return !layout.of_networks; });
    names.emplace_back(kNetwork);
    return names;
}
bool can_be_network(const Lattice& lattice, const Material& material) {
    return !material.crush.any() && !has_own_volumes(lattice, material);
}
std::vector<std::string> network_layouts() {
    return names_where([](const Layout& layout) { return layout.of_networks; });
}
std::vector<std::string> distinct_lattice_layouts() {
    std::vector<std::string> names = names_where([](const Layout&) { return true; });
    names.push_back(with_axes({2, 0, 1}));
    return names;
}

std::string estimated_layout(const Lattice& lattice, Accuracy accuracy) {
    // A vector of active rows costs what one of flat rows does, and a body this full has no rows to leave out.
    const bool sparse = is_sparse(static_cast<double>(lattice.cell_count()),
                                  static_cast<double>(lattice.cell_scales().size()), accuracy);
    return sparse && active_share(lattice) < 0.75 ? kSparse.name : kDense.name;
}

std::string estimated_step_layout(const Lattice& lattice, Accuracy accuracy) {
    const std::string layout = estimated_layout(lattice, accuracy);
    const LatticeAxes axes = axes_by_cost(lattice, true).front();
    return layout != kDense.name || accuracy == Accuracy::exact || axes == plain_axes(lattice) ? layout
                                                                                               : with_axes(axes);
}

std::vector<std::string> layouts_to_try(const Lattice& lattice, const Material& material) {
    std::vector<std::string> names = names_where([](const Layout& layout) { return !layout.of_networks; });
    if (can_be_network(lattice, material)) {
        names.emplace_back(kNetwork);
        for (const std::string& layout : network_layouts()) {
            if (layout != kOfNetworks.name) { // which is there by its other name
                names.push_back(layout);
            }
        }
    }
    std::size_t orders = 0;
    for (const LatticeAxes& axes : axes_by_cost(lattice, false)) {
        if (orders < kOrders && axes != plain_axes(lattice)) {
            names.push_back(with_axes(axes));
            ++orders;
        }
    }
    return names;
}

bool is_layout(const std::string& name, bool of_network) {
    const Layout* layout = find(name);
    return layout && (!of_network || (layout->of_networks && name != kNetwork));
}
bool has_tiles(const std::string& layout) {
    const Layout* known = find(layout);
    return known && known->has_tiles;
}
bool can_be_cut(const std::string& layout) {
    const Layout* known = find(layout);
    return known && known->can_be_cut;
}
std::string layouts_that_can_be_cut() {
    return joined(names_where([](const Layout& layout) { return layout.can_be_cut; }), " and ");
}

double plan_bytes(const std::string& layout, const LatticeExtent& extent, Precision precision) {
    const double real = precision == Precision::float32 ? 4 : 8;
    if (!layout.empty()) {
        return lattice_layout(layout).bytes(extent, real);
    }
    const double dense = kDense.bytes(extent, real);
    return is_sparse(extent.cells, extent.grid_nodes, Accuracy::accurate) ? std::min(kSparse.bytes(extent, real), dense)
                                                                          : dense;
}

template <class T>
std::unique_ptr<Body<T>> make_body(const Lattice& lattice, const Material& material, const PlanOptions& options) {
    validate(lattice, material);
    const Layout& layout =
        lattice_layout(options.layout.empty() ? estimated_layout(lattice, options.accuracy) : options.layout);
    if (!layout.of_networks) {
        return make<T>(layout, {&lattice, &material, nullptr}, options);
    }
    const Network network = Network::from_lattice(lattice, material);
    return make<T>(layout, {nullptr, nullptr, &network}, options);
}

template <class T>
std::unique_ptr<Body<T>> make_body(const Network& network, const PlanOptions& options) {
    validate(network);
    if (!options.layout.empty() && !is_layout(options.layout, true)) {
        refuse_layout(options.layout, network_layouts());
    }
    const Layout* layout = options.layout.empty() ? &kOfNetworks : find(options.layout);
    return make<T>(*layout, {nullptr, nullptr, &network}, options);
}

template std::unique_ptr<Body<float>> make_body(const Lattice&, const Material&, const PlanOptions&);
template std::unique_ptr<Body<double>> make_body(const Lattice&, const Material&, const PlanOptions&);
template std::unique_ptr<Body<float>> make_body(const Network&, const PlanOptions&);
template std::unique_ptr<Body<double>> make_body(const Network&, const PlanOptions&);

} // namespace hybmss
