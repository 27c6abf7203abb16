#include "layouts/lattice/active_rows.hpp"
#include "plan/bodies/lattice_body.hpp"
#include "plan/bodies/network_body.hpp"
#include "plan/bodies/packed_network_body.hpp"
#include "plan/bodies/stiffened_body.hpp"
#include "plan/tuning/candidates.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

constexpr const char* kNetwork = "network";
constexpr const char* kPackedXyzw = "packed-xyzw";
constexpr const char* kColouredSoa = "coloured-soa";

[[noreturn]] void refuse_layout(const std::string& given, const std::vector<std::string>& known) {
    std::string allowed;
    for (const std::string& name : known) {
        allowed += (allowed.empty() ? "" : ", ") + name;
    }
    throw std::invalid_argument("layout \"" + given + "\" is not known for this body: it must be one of " + allowed);
}

/// Names that are not known are refused elsewhere.
void require_fusing(const PlanOptions& options, const std::string& layout) {
    if (options.integration == Integration::fused && !can_fuse(layout)) {
        throw std::invalid_argument("integration = fused is not allowed in the layout " + layout +
                                    ": only flat-rows and active-rows can; it must be automatic or split");
    }
}

/// "": packed-xyzw, which no other layout has beaten on any network measured.
template <class T>
std::unique_ptr<Body<T>> network_body(const Network& network, const PlanOptions& options, const std::string& layout) {
    if (layout.empty() || layout == kPackedXyzw) {
        return std::make_unique<PackedNetworkBody<T>>(network, options);
    }
    if (layout == kColouredSoa) {
        return std::make_unique<NetworkBody<T>>(network, options);
    }
    refuse_layout(layout, network_layouts());
}

template <class T>
std::unique_ptr<Body<T>> stiffened(std::unique_ptr<Body<T>> body, const SpringStiffening& stiffening) {
    if (!stiffening.any()) {
        return body;
    }
    return std::make_unique<StiffenedBody<T>>(std::move(body), stiffening);
}

template <class T>
std::unique_ptr<Body<T>> plain_body(const Lattice& lattice, const Material& material, const PlanOptions& options) {
    const std::string layout = options.layout.empty() ? estimated_layout(lattice) : options.layout;
    require_fusing(options, layout);
    if (layout == kFlatRows || layout == kActiveRows) {
        return std::make_unique<LatticeBody<T>>(lattice, material, options, layout);
    }
    if (options.layout == kNetwork) {
        return network_body<T>(Network::from_lattice(lattice, material), options, "");
    }
    // A network's layouts by their own names too, so that what a plan says it chose can be asked for again.
    if (const auto known = network_layouts(); std::find(known.begin(), known.end(), options.layout) != known.end()) {
        return network_body<T>(Network::from_lattice(lattice, material), options, options.layout);
    }
    refuse_layout(options.layout, lattice_layouts());
}

} // namespace

std::vector<std::string> lattice_layouts() {
    return {kFlatRows, kActiveRows, kNetwork};
}
std::vector<std::string> network_layouts() {
    return {kPackedXyzw, kColouredSoa};
}

bool has_tiles(const std::string& layout) {
    return layout == kFlatRows || layout == kActiveRows || layout == kNetwork || layout == kPackedXyzw;
}
bool can_fuse(const std::string& layout) {
    return layout == kFlatRows || layout == kActiveRows;
}

std::vector<std::string> distinct_lattice_layouts() {
    std::vector<std::string> layouts = lattice_layouts();
    std::erase(layouts, kNetwork);
    const std::vector<std::string> networks = network_layouts();
    layouts.insert(layouts.end(), networks.begin(), networks.end());
    return layouts;
}

std::string estimated_layout(const Lattice& lattice) {
    // A vector of active rows costs what one of flat rows does, and a body this full has no rows to leave out.
    const double cells = static_cast<double>(lattice.cell_scales().size());
    const bool sparse = static_cast<double>(lattice.cell_count()) <= 0.5 * cells;
    return sparse && active_share(lattice) < 0.75 ? kActiveRows : kFlatRows;
}

template <class T>
std::unique_ptr<Body<T>> make_body(const Lattice& lattice, const Material& material, const PlanOptions& options) {
    validate(material);
    return stiffened(plain_body<T>(lattice, material, options), material.stiffening);
}

template <class T>
std::unique_ptr<Body<T>> make_body(const Network& network, const PlanOptions& options) {
    validate(network);
    require_fusing(options, options.layout.empty() ? kPackedXyzw : options.layout);
    return stiffened(network_body<T>(network, options, options.layout), network.stiffening);
}

template std::unique_ptr<Body<float>> make_body(const Lattice&, const Material&, const PlanOptions&);
template std::unique_ptr<Body<double>> make_body(const Lattice&, const Material&, const PlanOptions&);
template std::unique_ptr<Body<float>> make_body(const Network&, const PlanOptions&);
template std::unique_ptr<Body<double>> make_body(const Network&, const PlanOptions&);

} // namespace hybmss
