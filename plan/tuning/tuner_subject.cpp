#include "plan/tuning/tuner_subject.hpp"

#include "plan/tuning/tuner_sample.hpp"
#include "plan/tuning/wisdom_class.hpp"

#include <algorithm>

namespace hybmss {
namespace {

/// What an estimate takes comes first.
std::vector<std::string> layouts_of(const Lattice& lattice) {
    std::vector<std::string> layouts = lattice_layouts();
    const auto first = std::find(layouts.begin(), layouts.end(), estimated_layout(lattice));
    std::rotate(layouts.begin(), first, first + 1);
    return layouts;
}

} // namespace

template <class T>
TunerSubject<T> subject_of(const Lattice& lattice, const Material& material) {
    const std::size_t cells = lattice.cell_count();
    return {body_class<T>(lattice, material),
            layouts_of(lattice),
            lattice.grid_node_count(),
            cells ? cells : 1,
            [&lattice, &material](const PlanOptions& options) { return make_body<T>(lattice, material, options); },
            [&lattice, &material](std::size_t most_nodes) {
                const auto piece = std::make_shared<Lattice>(sample_of(lattice, most_nodes));
                TunerSubject<T> sample = subject_of<T>(*piece, material);
                sample.make = [piece, make = std::move(sample.make)](const PlanOptions& options) {
                    return make(options);
                };
                return sample;
            }};
}

template <class T>
TunerSubject<T> subject_of(const Network& network) {
    const std::size_t nodes = network.masses.size();
    return {body_class<T>(network),
            network_layouts(),
            nodes,
            network.cells.empty() ? nodes : network.cells.size(),
            [&network](const PlanOptions& options) { return make_body<T>(network, options); },
            [&network](std::size_t most_nodes) {
                const auto piece = std::make_shared<Network>(sample_of(network, most_nodes));
                TunerSubject<T> sample = subject_of<T>(*piece);
                sample.make = [piece, make = std::move(sample.make)](const PlanOptions& options) {
                    return make(options);
                };
                return sample;
            }};
}

template TunerSubject<float> subject_of(const Lattice&, const Material&);
template TunerSubject<double> subject_of(const Lattice&, const Material&);
template TunerSubject<float> subject_of(const Network&);
template TunerSubject<double> subject_of(const Network&);

} // namespace hybmss
