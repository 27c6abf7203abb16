#include "plan/tuning/wisdom_class.hpp"

#include "layouts/lattice/active_rows.hpp"
#include "plan/bodies/plan_description.hpp"
#include "plan/threads/workers.hpp"
#include "plan/tuning/candidates.hpp"
#include "plan/tuning/tuner_sample.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace hybmss {
namespace {

std::string size_class(std::size_t nodes) {
    const auto sized = static_cast<double>(std::clamp<std::size_t>(nodes, 1, kTunerSampleNodes));
    char text[32];
    std::snprintf(text, sizeof text, " nodes:2^%.1f", 0.5 * std::round(2 * std::log2(sized)));
    return text;
}

std::string volume_class(kernels::Volume volume) {
    constexpr const char* kNames[] = {" no-volume", " quadratic", " mean-stretch"};
    return kNames[static_cast<int>(volume)];
}

bool numbered_locally(const Network& network) {
    double sum = 0;
    for (const Network::Spring& spring : network.springs) {
        sum += std::abs(static_cast<double>(spring.b) - spring.a);
    }
    const double mean = sum / static_cast<double>(std::max<std::size_t>(network.springs.size(), 1));
    return mean < std::pow(static_cast<double>(network.masses.size()), 5.0 / 6) / std::sqrt(3.0);
}

/// " fill:3/8 active:4/8": of the cells, and, where that may decide, of the rows.
std::string fill_class(const Lattice& lattice) {
    const auto eighths = [](double part) { return std::to_string(static_cast<int>(std::ceil(8 * part))) + "/8"; };
    const double fill = static_cast<double>(lattice.cell_count()) / static_cast<double>(lattice.cell_scales().size());
    return " fill:" + eighths(fill) + (fill <= 0.5 ? " active:" + eighths(active_share(lattice)) : "");
}

} // namespace

template <class T>
std::string body_class(const Lattice& lattice, const Material& material) {
    return "lattice " + precision_name<T>() +
           (material.face_diagonal_ratio > 0 ? " face-diagonals" : " no-face-diagonals") +
           volume_class(kernel_volume(resolved_volume_energy(material))) + size_class(lattice.nodes().size()) +
           fill_class(lattice);
}

template <class T>
std::string body_class(const Network& network) {
    const auto volume = network.cells.empty() ? kernels::Volume::none : kernel_volume(network.volume_energy);
    return "network " + precision_name<T>() + volume_class(volume) + size_class(network.masses.size()) +
           " numbering:" + (numbered_locally(network) ? "local" : "scattered");
}

std::string wish_class(const PlanOptions& options) {
    const bool any_set = options.instruction_set == InstructionSet::automatic && !instruction_set_is_forced();
    std::string wish =
        "layout:" + (options.layout.empty() ? "any" : options.layout) +
        " isa:" + (any_set ? "any" : std::string(name(resolve(options.instruction_set)))) +
        " accuracy:" + std::string(name(options.accuracy)) + " threads:" +
        std::to_string(useful_threads(options.threads, std::numeric_limits<std::size_t>::max(), options.task_runner));
    if (options.tile_nodes) {
        wish.append(" tile:").append(std::to_string(options.tile_nodes));
    }
    if (options.integration != Integration::automatic) {
        wish.append(" ").append(name(options.integration));
    }
    return wish;
}

template std::string body_class<float>(const Lattice&, const Material&);
template std::string body_class<double>(const Lattice&, const Material&);
template std::string body_class<float>(const Network&);
template std::string body_class<double>(const Network&);

} // namespace hybmss
