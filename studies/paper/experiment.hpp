#pragma once

/// \file
/// The experiments of section 6.1 of Golec et al. 2020 as static scenes, and what the theories of rods say of its beam.

#include "hybmss/simulation/scene.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss::paper {

enum class Kind {
    compression, ///< 5 m cube between clamped plates that approach each other along y
    tension,     ///< bar of 0.4 x 0.4 x 2.4 m between clamped plates, pulled along z
    shear,       ///< the cube, its upper plate led along x
    torsion,     ///< the cube, its upper plate turned about y
    beam         ///< the bar clamped at z = 0, bent by its own weight along -y
};

/// "compression", ...
std::string_view name(Kind kind);

/// The paper's variants of the model, and springs on means.
enum class Model {
    hybmss_fd, ///< A = 0: no face diagonals
    hybmss_cf, ///< no volume force
    hybmss,    ///< A = 1, with volume force
    hybmss_m   ///< A = 0, springs on means, with volume force
};
inline constexpr Model kModels[] = {Model::hybmss_fd, Model::hybmss_cf, Model::hybmss, Model::hybmss_m};

/// "HybMSS-FD", "HybMSS-CF", "HybMSS" or "HybMSS-M".
std::string_view name(Model model);

/// The material of a variant: E and nu stay.
Material with_model(Material material, Model model);

struct Experiment {
    Kind kind = Kind::compression;
    double amount = 0; ///< strain in percent, or the torsion's angle in degrees; a beam has none
    double poisson_ratio = 0.25;
    double young_modulus = 1e4; ///< Pa
    int across = 0;             ///< cells along the shortest edge; 0: the paper's, 10 for the cube, 4 for the bar
};

/// All that tells one experiment from the others, in one line: "compression 20 % nu=0.25 10x10x10".
std::string key(const Experiment& experiment);

/// "5 %" or "1 degree"; "" for a beam.
std::string amount_text(const Experiment& experiment);

std::array<int, 3> mesh(const Experiment& experiment);

/// A static scene, A = 1; its probe "plate" is what moves: the plate, or the beam's free end.
Scene scene(const Experiment& experiment);

/// Along which axis the response of the probe is read: of its force, of its torque, or of a beam's deflection.
std::size_t response_axis(Kind kind);

/// Nodes of the paper's pictures: of a shear by 20 % the middle layer z = 2.5 m (Fig. 8), of a torsion by 45 degrees
/// y = 2.5 m (Fig. 10), of a beam those on its axis (Fig. 5); none otherwise.
std::vector<std::uint32_t> pictured_nodes(const Experiment& experiment);

/// Cells whose stresses are compared: of a compression of the paper's cube at nu = 1/4 by up to 5 % those with no
/// face on its surface, in the octant at the origin, as the others are their mirror images; none otherwise.
std::vector<std::uint32_t> compared_cells(const Experiment& experiment);

/// Timoshenko's coefficient of a rectangular section, by Cowper: 10 (1 + nu) / (12 + 11 nu).
double shear_coefficient(double poisson_ratio);

/// Timoshenko's omega^2 (1/s^2) of waves of the length 2 pi / q (m) in a bar of square section: the lower root of
///   rho r^2 / (k G) omega^4 - (1 + q^2 r^2 (1 + E / (k G))) omega^2 + E r^2 / rho q^4 = 0,   r^2 = width^2 / 12.
double timoshenko_eigenvalue(const Material& material, double width, double wave_number);

/// The deflections of the free end, m.
struct BeamTheory {
    double bending = 0; ///< rho g A L^4 / (8 E I), Euler and Bernoulli: (6.1) at x = L
    double shear = 0;   ///< what Timoshenko adds, rho g L^2 / (2 k G)
};
BeamTheory beam_theory(const Experiment& beam);

} // namespace hybmss::paper
