#include "simulation/results/vtu_file.hpp"

#include "layouts/messages.hpp"
#include "simulation/results/atomic_file.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace hybmss {
namespace {

constexpr const char* kByteOrder = std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";

/// VTK counts a hexahedron's corners around its low z face, then around its high one.
constexpr std::size_t kVtkCorners[8] = {0, 1, 3, 2, 4, 5, 7, 6};
constexpr std::uint8_t kHexahedron = 12;

/// A prism's first triangle is seen from outside there.
struct VtuPolyhedron {
    std::uint8_t type;
    std::array<std::size_t, 6> corners;
};
VtuPolyhedron vtu_polyhedron(CellShape shape) {
    switch (shape) {
    case CellShape::tetrahedron:
        return {10, {0, 1, 2, 3}};
    case CellShape::pyramid:
        return {14, {0, 1, 2, 3, 4}};
    default:
        return {13, {0, 2, 1, 3, 5, 4}};
    }
}

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

constexpr std::string_view kDataBegin = "<AppendedData encoding=\"raw\">\n_", kDataEnd = "\n</AppendedData>";

/// The value of an attribute of the first tag; "" where it has none.
std::string_view attribute(std::string_view tag, const char* name) {
    tag = tag.substr(0, tag.find('>'));
    const std::string key = printed(" %s=\"", name);
    const std::size_t at = tag.find(key);
    if (at == std::string_view::npos) {
        return {};
    }
    tag.remove_prefix(at + key.size());
    return tag.substr(0, tag.find('"'));
}

/// The values of an array; none where the header does not name it.
template <class T>
std::vector<T> read_array(std::string_view header, std::string_view data, const char* name) {
    const std::size_t at = header.find(printed(" Name=\"%s\"", name));
    if (at == std::string_view::npos) {
        return {};
    }
    std::size_t offset = 0;
    std::uint64_t bytes = 0;
    const bool placed = parse_number(attribute(header.substr(at), "offset"), offset) && offset <= data.size() &&
                        data.size() - offset >= sizeof bytes;
    if (placed) {
        std::memcpy(&bytes, data.data() + offset, sizeof bytes);
        data.remove_prefix(offset + sizeof bytes);
    }
    if (!placed || bytes > data.size() || bytes % sizeof(T) != 0) {
        throw std::invalid_argument(printed("the array %s is damaged", name));
    }
    std::vector<T> values(bytes / sizeof(T));
    if (bytes > 0) {
        std::memcpy(values.data(), data.data(), bytes);
    }
    return values;
}

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
    std::vector<std::uint8_t> types(grid.cells.size(), kHexahedron);
    for (const Network::Polyhedron& cell : grid.polyhedra) {
        const VtuPolyhedron written = vtu_polyhedron(cell.shape);
        for (std::size_t c = 0; c < cell.node_count(); ++c) {
            connectivity.push_back(cell.nodes[written.corners[c]]);
        }
        offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
        types.push_back(written.type);
    }

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
    header << "<Piece NumberOfPoints=\"" << grid.points.size() << "\" NumberOfCells=\"" << types.size()
           << "\">\n<PointData Vectors=\"displacement\">\n";
    appended.add(header, "Float64", "displacement", 3, grid.displacement);
    appended.add(header, "Float64", "velocity", 3, grid.velocity);
    if (!grid.mass.empty()) {
        appended.add(header, "Float64", "mass", 1, grid.mass);
    }
    if (!grid.reaction.empty()) {
        appended.add(header, "Float64", "reaction", 3, grid.reaction);
    }
    if (!grid.contact.empty()) {
        appended.add(header, "Float64", "contact", 3, grid.contact);
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
    header << "</Cells>\n</Piece>\n</UnstructuredGrid>\n" << kDataBegin;

    AtomicFile file(path);
    file.stream() << header.str() << appended.data() << kDataEnd << "\n</VTKFile>\n";
    file.commit();
}

VtuShape parse_vtu(std::string_view text) {
    const std::size_t begin = text.find(kDataBegin);
    if (!text.starts_with(kVtuBeginning) || begin == std::string_view::npos) {
        throw std::invalid_argument("it is no .vtu file of hybmss");
    }
    const std::string_view header = text.substr(0, begin), data = text.substr(begin + kDataBegin.size());
    VtuShape shape;
    shape.points = read_array<Vector3>(header, data, "Points");
    shape.obstacles = read_array<VtuObstacle>(header, data, "obstacles");
    for (const std::uint8_t type : read_array<std::uint8_t>(header, data, "types")) {
        if (type != kHexahedron) {
            throw std::invalid_argument(printed("it has cells of type %d: hexahedra alone are drawn", type));
        }
    }
    for (const auto& corners : read_array<std::array<std::int32_t, 8>>(header, data, "connectivity")) {
        std::array<std::uint32_t, 8>& cell = shape.cells.emplace_back();
        for (std::size_t c = 0; c < 8; ++c) {
            cell[kVtkCorners[c]] = static_cast<std::uint32_t>(corners[c]);
            if (cell[kVtkCorners[c]] >= shape.points.size()) {
                throw std::invalid_argument(
                    printed("a cell names the point %d, of %zu", corners[c], shape.points.size()));
            }
        }
    }
    return shape;
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

void write_obj(const std::filesystem::path& path, const VtpMesh& mesh) {
    std::string text(kObjBeginning);
    for (const auto& [name, vectors] : {std::pair{"v", mesh.points}, {"vn", mesh.normals}}) {
        for (const Vector3& v : vectors) {
            text += printed("%s %.9g %.9g %.9g\n", name, v[0], v[1], v[2]);
        }
    }
    for (const auto& [a, b, c] : mesh.triangles) { // counted from 1; a vertex and its normal
        text += printed("f %u//%u %u//%u %u//%u\n", a + 1, a + 1, b + 1, b + 1, c + 1, c + 1);
    }
    write_file(path, text);
}

void write_ply(const std::filesystem::path& path, const VtpMesh& mesh) {
    static_assert(std::endian::native == std::endian::little);
    std::string text(kPlyBeginning);
    text += printed("element vertex %zu\n", mesh.points.size());
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz"}) {
        text += printed("property float %s\n", name);
    }
    text += printed("element face %zu\nproperty list uchar uint vertex_indices\nend_header\n", mesh.triangles.size());
    const auto append = [&](const auto& value) { text.append(reinterpret_cast<const char*>(&value), sizeof value); };
    for (std::size_t n = 0; n < mesh.points.size(); ++n) {
        for (const Vector3* v : {&mesh.points[n], &mesh.normals[n]}) {
            for (const double x : *v) {
                append(static_cast<float>(x));
            }
        }
    }
    for (const auto& triangle : mesh.triangles) {
        text += '\3';
        append(triangle);
    }
    write_file(path, text);
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

std::vector<PvdFrame> parse_pvd(std::string_view text) {
    if (text.find("<VTKFile type=\"Collection\"") == std::string_view::npos) {
        throw std::invalid_argument("it is no .pvd file");
    }
    std::vector<PvdFrame> frames;
    constexpr std::string_view kTag = "<DataSet ";
    for (std::size_t at = text.find(kTag); at != std::string_view::npos; at = text.find(kTag, at + 1)) {
        const std::string_view tag = text.substr(at), file = attribute(tag, "file");
        PvdFrame& frame = frames.emplace_back();
        frame.file = file;
        if (!parse_number(attribute(tag, "timestep"), frame.time) || !std::isfinite(frame.time) ||
            !parse_number(attribute(tag, "part"), frame.part) || frame.part < 0 || file.empty()) {
            throw std::invalid_argument(printed("data set %zu has no time, part or file", frames.size()));
        }
        const std::filesystem::path path(file);
        for (const auto& step : path) {
            if (path.is_absolute() || step == "..") {
                throw std::invalid_argument(printed("data set %zu names a file elsewhere", frames.size()));
            }
        }
    }
    return frames;
}

} // namespace hybmss
