#include "plan/bodies/plan_description.hpp"

#include "layouts/messages.hpp"
#include "layouts/network/network_geometry.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace hybmss {
namespace {

constexpr const char* kVolumes[] = {"no volume", "quadratic", "mean_stretch"};

/// `energy` resolved, not automatic.
kernels::Volume kernel_volume(VolumeEnergy energy) {
    switch (energy) {
    case VolumeEnergy::quadratic:
        return kernels::Volume::quadratic;
    case VolumeEnergy::mean_stretch:
        return kernels::Volume::mean_stretch;
    case VolumeEnergy::automatic:
    case VolumeEnergy::none:
        break;
    }
    return kernels::Volume::none;
}

} // namespace

kernels::Volume kernel_volume(const Lattice& lattice, const Material& material) {
    return has_own_volumes(lattice, material) ? kernels::Volume::none : kernel_volume(resolved_volume_energy(material));
}
kernels::Volume kernel_volume(const Network& network) {
    return network.cells.empty() && network.polyhedra.empty() ? kernels::Volume::none
                                                              : kernel_volume(network.volume_energy);
}

NetworkMeans::NetworkMeans(const Network& network)
    : cells(cells_of(network, true).size()), face_diagonals(network.means.springs.face_diagonal > 0),
      alone(cells > 0 && cells == network.cells.size() && network.springs.empty()) {}

std::string network_kernels(const std::string& kind, const NetworkMeans& means, kernels::Volume volume,
                            Accuracy accuracy) {
    std::string kernels;
    if (!means.alone) {
        kernels = kind + "_springs<" + std::string(name(accuracy)) + ">";
        if (volume != kernels::Volume::none) {
            kernels += " + " + kind + "_cells<" + kVolumes[static_cast<int>(volume)] + ">";
        }
    }
    if (means.cells > 0) {
        kernels += (means.alone ? "network_means" : " + network_means") +
                   lattice_variant(means.face_diagonals, volume, accuracy);
    }
    return kernels;
}

std::string lattice_variant(bool face_diagonals, kernels::Volume volume, Accuracy accuracy) {
    return std::string("<") + (face_diagonals ? "face_diagonals" : "no face diagonals") + ", " +
           kVolumes[static_cast<int>(volume)] + ", " + std::string(name(accuracy)) + ">";
}

template <class T>
kernels::MeanConstants<T> mean_constants(const SpringConstants& springs, const PatternConstants& patterns) {
    const double k = springs.cube_diagonal;
    return {static_cast<T>(springs.edge / (16 * k)),       static_cast<T>(springs.face_diagonal / (16 * k)),
            static_cast<T>(patterns.bending / (1024 * k)), static_cast<T>(patterns.coupling),
            static_cast<T>(patterns.twist / (1024 * k)),   static_cast<T>(patterns.joint_twist / (1024 * k)),
            static_cast<T>(patterns.fourth / (64 * k))};
}

template kernels::MeanConstants<float> mean_constants(const SpringConstants&, const PatternConstants&);
template kernels::MeanConstants<double> mean_constants(const SpringConstants&, const PatternConstants&);

std::string to_string(const PlanDescription& d) {
    std::ostringstream text;
    text << "layout           " << d.layout << "\n"
         << "kernel           " << d.kernel << "\n"
         << "instruction set  " << name(d.instruction_set) << "\n"
         << "precision        " << d.precision << "\n"
         << "threads          " << d.threads << "\n"
         << "tiles            " << d.tiles << "\n"
         << "nodes            " << d.nodes << "\n"
         << "springs          " << d.springs << "\n"
         << "cells            " << d.cells << "\n"
         << "bytes            " << d.bytes << "\n"
         << "effort           " << name(d.effort) << "\n"
         << "reason           " << d.reason << "\n";
    for (const CandidateFigure& figure : d.candidates) {
        text << "candidate        " << figure.name << ": " << figure.ns_per_cell_step << " ns a cell and step"
             << (figure.finalist ? "" : " (dropped early)") << "\n";
    }
    return text.str();
}

} // namespace hybmss
