#pragma once

/// \file
/// VTK's XML formats: unstructured grids of solid cells with nodal vectors and values of the cells, and triangles.

#include "hybmss/network.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hybmss {

using Vector3 = std::array<double, 3>;

/// A rigid obstacle: what it is, how large, and where.
struct VtuObstacle {
    double kind; ///< 0: plane, 1: sphere, 2: box, 3: capsule, 4: hull, 5: mesh, 6: height field
    /// The plane's normal; the sphere's radius, 0, 0; the box's edges; the capsule's radius, its axis' length, along y,
    /// 0; of others 0, 0, 0.
    Vector3 size;
    Vector3 position;
    std::array<double, 9> rotation; ///< row by row: from the obstacle's axes to space
};

/// Components of symmetric tensors: xx, yy, zz, xy, yz, xz.
struct VtuStress {
    std::vector<std::array<double, 6>> cauchy_stress, green_strain;     ///< of the cells
    std::vector<double> von_mises, pressure, energy_density, at_points; ///< of the cells; von Mises of the points
};

/// What one .vtu file holds. Corners by the bits of their number (bit 0: high side in x, bit 1: y, bit 2: z).
struct VtuGrid {
    std::span<const Vector3> points; ///< deformed positions, m
    std::span<const std::array<std::uint32_t, 8>> cells;
    std::span<const Vector3> displacement;               ///< m, one a point
    std::span<const Vector3> velocity;                   ///< m/s, one a point
    std::span<const double> volume_ratio;                ///< one a cell
    std::span<const std::uint8_t> label;                 ///< one a cell, or none
    std::span<const float> fraction = {};                ///< one a cell, or none
    std::span<const VtuObstacle> obstacles = {};         ///< as the field array "obstacles": the 16 numbers of each
    std::span<const double> mass = {};                   ///< kg, one a point, or none
    std::span<const Vector3> reaction = {};              ///< N, one a point, or none
    std::span<const Vector3> contact = {};               ///< likewise
    const VtuStress* stress = nullptr;                   ///< or none
    std::span<const Network::Polyhedron> polyhedra = {}; ///< behind the cells
};

/// How every such file begins.
inline constexpr std::string_view kVtuBeginning = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" ";

/// Binary (appended raw data, little endian as the machine is), written whole or not at all.
void write_vtu(const std::filesystem::path& path, const VtuGrid& grid);

/// What is read of such a file again.
struct VtuShape {
    std::vector<Vector3> points; ///< m
    std::vector<std::array<std::uint32_t, 8>> cells;
    std::vector<VtuObstacle> obstacles;
};
/// The text of a file by write_vtu(). Throws std::invalid_argument that says why it is none, and for other cells than
/// hexahedra.
VtuShape parse_vtu(std::string_view text);

/// Likewise of triangles; one normal a point.
struct VtpMesh {
    std::span<const Vector3> points; ///< m
    std::span<const Vector3> normals;
    std::span<const std::array<std::uint32_t, 3>> triangles;
};
inline constexpr std::string_view kVtpBeginning = "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" ";
void write_vtp(const std::filesystem::path& path, const VtpMesh& mesh);

/// As Wavefront's .obj, in text, and as .ply in binary, little endian, in float.
inline constexpr std::string_view kObjBeginning = "# triangles of a body, written by hybmss\n";
inline constexpr std::string_view kPlyBeginning = "ply\nformat binary_little_endian 1.0\ncomment written by hybmss\n";
void write_obj(const std::filesystem::path& path, const VtpMesh& mesh);
void write_ply(const std::filesystem::path& path, const VtpMesh& mesh);

/// The list of (time in s, file name) that ParaView opens as one animation.
struct PvdFrame {
    double time; ///< s
    std::string file;
    int part = 0; ///< of those at one time
};
void write_pvd(const std::filesystem::path& path, std::span<const PvdFrame> frames);
/// The text of a file by write_pvd(). Throws std::invalid_argument where it is none, or names a file elsewhere than in
/// its folder or those below.
std::vector<PvdFrame> parse_pvd(std::string_view text);

} // namespace hybmss
