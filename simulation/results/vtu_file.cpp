#include "simulation/results/vtu_file.hpp"

#include "simulation/results/atomic_file.hpp"

#include <bit>
#include <sstream>

namespace hybmss {
namespace {

constexpr const char* kByteOrder = std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";

/// VTK counts a hexahedron's corners around its low z face, then around its high one.
constexpr std::size_t kVtkCorners[8] = {0, 1, 3, 2, 4, 5, 7, 6};
constexpr std::uint8_t kHexahedron = 12;

/// Appended data: each array is its size in bytes (64 bits), then its values.
class AppendedData {
public:
    /// `attributes`: more of them.
    template <class T>
    void add(std::ostream& header, const char* type, const char* name, int components, std::span<const T> values,
             const std::string& attributes = "") {
        header << "<DataArray type=\"" << type << "\" Name=\"" << name << "\" NumberOfComponents=\"" << components
               << "\" " << attributes << "format=\"appended\" offset=\"" << data_.size() << "\"/>\n";
        const std::uint64_t bytes = values.size_bytes();
        data_.append(reinterpret_cast<const char*>(&bytes), sizeof bytes);
        data_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
    }
    const std::string& data() const { return data_; }

private:
    std::string data_;
};

} // namespace

void write_vtu(const std::filesystem::path& path, const VtuGrid& grid) {
    std::vector<std::int32_t> connectivity;
    std::vector<std::int64_t> offsets;
    connectivity.reserve(8 * grid.cells.size());
    for (const auto& cell : grid.cells) {
        for (std::size_t corner : kVtkCorners) {
            connectivity.push_back(static_cast<std::int32_t>(cell[corner]));
        }
        offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
    }
    const std::vector<std::uint8_t> types(grid.cells.size(), kHexahedron);

    AppendedData appended;
    std::ostringstream header;
    header << kVtuBeginning << "version=\"1.0\" byte_order=\"" << kByteOrder
           << "\" header_type=\"UInt64\">\n<UnstructuredGrid>\n";
    if (!grid.obstacles.empty()) {
        static_assert(sizeof(VtuObstacle) == 16 * sizeof(double));
        header << "<FieldData>\n";
        appended.add(header, "Float64", "obstacles", 16, grid.obstacles,
                     "NumberOfTuples=\"" + std::to_string(grid.obstacles.size()) + "\" ");
        header << "</FieldData>\n";
    }
    header << "<Piece NumberOfPoints=\"" << grid.points.size() << "\" NumberOfCells=\"" << grid.cells.size()
           << "\">\n<PointData Vectors=\"displacement\">\n";
    appended.add(header, "Float64", "displacement", 3, grid.displacement);
    appended.add(header, "Float64", "velocity", 3, grid.velocity);
    if (!grid.mass.empty()) {
        appended.add(header, "Float64", "mass", 1, grid.mass);
    }
    if (!grid.reaction.empty()) {
        appended.add(header, "Float64", "reaction", 3, grid.reaction);
    }
    if (grid.stress) {
        appended.add<double>(header, "Float64", "von_mises", 1, grid.stress->at_points);
    }
    header << "</PointData>\n<CellData Scalars=\"volume_ratio\">\n";
    appended.add(header, "Float64", "volume_ratio", 1, grid.volume_ratio);
    if (!grid.label.empty()) {
        appended.add(header, "UInt8", "label", 1, grid.label);
    }
    if (!grid.fraction.empty()) {
        appended.add(header, "Float32", "fraction", 1, grid.fraction);
    }
    if (grid.stress) {
        appended.add<std::array<double, 6>>(header, "Float64", "cauchy_stress", 6, grid.stress->cauchy_stress);
        appended.add<std::array<double, 6>>(header, "Float64", "green_strain", 6, grid.stress->green_strain);
        appended.add<double>(header, "Float64", "von_mises", 1, grid.stress->von_mises);
        appended.add<double>(header, "Float64", "pressure", 1, grid.stress->pressure);
        appended.add<double>(header, "Float64", "energy_density", 1, grid.stress->energy_density);
    }
    header << "</CellData>\n<Points>\n";
    appended.add(header, "Float64", "Points", 3, grid.points);
    header << "</Points>\n<Cells>\n";
    appended.add(header, "Int32", "connectivity", 1, std::span<const std::int32_t>(connectivity));
    appended.add(header, "Int64", "offsets", 1, std::span<const std::int64_t>(offsets));
    appended.add(header, "UInt8", "types", 1, std::span<const std::uint8_t>(types));
    header << "</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_";

    AtomicFile file(path);
    file.stream() << header.str() << appended.data() << "\n</AppendedData>\n</VTKFile>\n";
    file.commit();
}

void write_vtp(const std::filesystem::path& path, const VtpMesh& mesh) {
    std::vector<std::int32_t> connectivity;
    std::vector<std::int64_t> offsets;
    connectivity.reserve(3 * mesh.triangles.size());
    offsets.reserve(mesh.triangles.size());
    for (const auto& triangle : mesh.triangles) {
        connectivity.insert(connectivity.end(), triangle.begin(), triangle.end());
        offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
    }
    AppendedData appended;
    std::ostringstream header;
    header << kVtpBeginning << "version=\"1.0\" byte_order=\"" << kByteOrder
           << "\" header_type=\"UInt64\">\n<PolyData>\n<Piece NumberOfPoints=\"" << mesh.points.size()
           << "\" NumberOfPolys=\"" << mesh.triangles.size() << "\">\n<PointData Normals=\"normals\">\n";
    appended.add(header, "Float64", "normals", 3, mesh.normals);
    header << "</PointData>\n<Points>\n";
    appended.add(header, "Float64", "Points", 3, mesh.points);
    header << "</Points>\n<Polys>\n";
    appended.add(header, "Int32", "connectivity", 1, std::span<const std::int32_t>(connectivity));
    appended.add(header, "Int64", "offsets", 1, std::span<const std::int64_t>(offsets));
    header << "</Polys>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
    write_file(path, header.str() + appended.data() + "\n</AppendedData>\n</VTKFile>\n");
}

void write_pvd(const std::filesystem::path& path, std::span<const PvdFrame> frames) {
    std::ostringstream text;
    text.precision(17);
    text << "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"" << kByteOrder
         << "\">\n<Collection>\n";
    for (const auto& [time, name, part] : frames) {
        text << "<DataSet timestep=\"" << time << "\" part=\"" << part << "\" file=\"" << name << "\"/>\n";
    }
    text << "</Collection>\n</VTKFile>\n";
    write_file(path, text.str());
}

} // namespace hybmss
