#pragma once

// What a kernel is compiled for: the choices that scenes and plans make, and a table of functions over all of them.

#include "kernels/arguments.hpp"

#include <cstddef>

namespace hybmss::kernels {

/// One choice, by the values that a kernel has functions for.
template <auto first, auto... others>
struct Axis {
    using Value = decltype(first);
    static constexpr std::size_t kSize = 1 + sizeof...(others);

    /// Which of the values this is; kSize where it is none of them.
    static constexpr std::size_t index(Value value) {
        constexpr Value kValues[] = {first, others...};
        std::size_t i = 0;
        while (i < kSize && !(kValues[i] == value)) {
            ++i;
        }
        return i;
    }
};

using FaceDiagonals = Axis<false, true>;
using Adding = Axis<false, true>; ///< to what is there
using BlockUses = Axis<BlockUse::multiply, BlockUse::first, BlockUse::restart, BlockUse::next>;
using Pulled = Axis<false, true>;    ///< by masses, towards a place
using Residuals = Axis<false, true>; ///< what is left of a right side in place of a product
using WithVolume = Axis<false, true>;
using OnMeans = Axis<false, true>; ///< all springs
using WithNormals = Axis<false, true>;
using Stiffening = Axis<false, true>;
using Driven = Axis<false, true>; ///< by gravity or damping
using Accuracies = Axis<Accuracy::fast, Accuracy::accurate, Accuracy::exact>;
using Volumes = Axis<Volume::none, Volume::quadratic, Volume::mean_stretch>;
using NodeCounts = Axis<4, 5, 6>; ///< of tetrahedra, pyramids, prisms
using Pressures = Axis<Pressure::quadratic, Pressure::mean_stretch, Pressure::of_nodes>;
using WithDirection = Axis<false, true>;
/// Of kernels that are there for the volume alone.
using VolumeEnergies = Axis<Volume::quadratic, Volume::mean_stretch>;
using Laws = Axis<SpringLaw::elastic, SpringLaw::damping, SpringLaw::stiffening, SpringLaw::stiffening_tangent>;
/// Those that have a block.
using BlockLaws = Axis<SpringLaw::elastic, SpringLaw::damping, SpringLaw::stiffening_tangent>;
/// The laws beyond the elastic one are passes over the springs alone.
using LatticeSums =
    Axis<LatticeSum{SpringLaw::elastic, Volume::none}, LatticeSum{SpringLaw::elastic, Volume::quadratic},
         LatticeSum{SpringLaw::elastic, Volume::mean_stretch}, LatticeSum{SpringLaw::damping, Volume::none},
         LatticeSum{SpringLaw::stiffening, Volume::none}, LatticeSum{SpringLaw::stiffening_tangent, Volume::none}>;
using LatticeBlockSums =
    Axis<LatticeSum{SpringLaw::elastic, Volume::none}, LatticeSum{SpringLaw::elastic, Volume::quadratic},
         LatticeSum{SpringLaw::elastic, Volume::mean_stretch}, LatticeSum{SpringLaw::damping, Volume::none},
         LatticeSum{SpringLaw::stiffening_tangent, Volume::none}>;

/// Second derivatives at the level `fast` are those of `accurate`: what a poorer direction costs a solver in iterations
/// is more than estimates save.
struct Tangents : Axis<Accuracy::accurate, Accuracy::exact> {
    static constexpr std::size_t index(Accuracy accuracy) {
        return Axis::index(accuracy == Accuracy::fast ? Accuracy::accurate : accuracy);
    }
};

/// A kernel's functions, one for every combination of its axes' values.
template <class Function, class... Axes>
class Variants {
public:
    /// `kernel.operator()<a value of each axis...>()` is the function for these values.
    template <class Kernel>
    constexpr explicit Variants(Kernel kernel) {
        Function** next = functions_;
        append<>(kernel, next, Axes{}...);
    }

    /// The function for these choices; null where the kernel has none for one of them.
    constexpr Function* operator()(typename Axes::Value... choice) const {
        std::size_t place = 0;
        bool known = true;
        ((place = place * Axes::kSize + Axes::index(choice), known = known && Axes::index(choice) < Axes::kSize), ...);
        return known ? functions_[place] : nullptr;
    }

private:
    template <auto... chosen, class Kernel>
    static constexpr void append(Kernel kernel, Function**& next) {
        *next++ = kernel.template operator()<chosen...>();
    }
    template <auto... chosen, class Kernel, auto... values, class... Others>
    static constexpr void append(Kernel kernel, Function**& next, Axis<values...>, Others... others) {
        (append<chosen..., values>(kernel, next, others...), ...);
    }

    Function* functions_[(std::size_t{1} * ... * Axes::kSize)] = {};
};

} // namespace hybmss::kernels
