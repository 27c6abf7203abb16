#include "plan/lattice_body.hpp"
#include "plan/network_body.hpp"

#include <stdexcept>
#include <string>

namespace hybmss {
namespace {

constexpr const char* kFlatRows = "flat-rows";
constexpr const char* kNetwork = "network";
constexpr const char* kColouredSoa = "coloured-soa";

[[noreturn]] void refuse_layout(const std::string& given, const std::vector<std::string>& known) {
    std::string allowed;
    for (const std::string& name : known) {
        allowed += (allowed.empty() ? "" : ", ") + name;
    }
    throw std::invalid_argument("layout \"" + given + "\" is not known for this body: it must be one of " + allowed);
}

} // namespace

std::vector<std::string> lattice_layouts() {
    return {kFlatRows, kNetwork};
}
std::vector<std::string> network_layouts() {
    return {kColouredSoa};
}

template <class T>
std::unique_ptr<Body<T>> make_body(const Lattice& lattice, const Material& material, const PlanOptions& options) {
    validate(material);
    if (options.layout.empty() || options.layout == kFlatRows) {
        return std::make_unique<LatticeBody<T>>(lattice, material, options);
    }
    if (options.layout == kNetwork) {
        return std::make_unique<NetworkBody<T>>(Network::from_lattice(lattice, material), options);
    }
    refuse_layout(options.layout, lattice_layouts());
}

template <class T>
std::unique_ptr<Body<T>> make_body(const Network& network, const PlanOptions& options) {
    validate(network);
    if (options.layout.empty() || options.layout == kColouredSoa) {
        return std::make_unique<NetworkBody<T>>(network, options);
    }
    refuse_layout(options.layout, network_layouts());
}

template std::unique_ptr<Body<float>> make_body(const Lattice&, const Material&, const PlanOptions&);
template std::unique_ptr<Body<double>> make_body(const Lattice&, const Material&, const PlanOptions&);
template std::unique_ptr<Body<float>> make_body(const Network&, const PlanOptions&);
template std::unique_ptr<Body<double>> make_body(const Network&, const PlanOptions&);

} // namespace hybmss
