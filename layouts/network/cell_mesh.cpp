#include "hybmss/polyhedra.hpp"

#include "layouts/messages.hpp"
#include "layouts/network/network_geometry.hpp"
#include "layouts/read_file.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <stdexcept>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace hybmss {
namespace {

// ---- files

/// A word of a file, and what is wrong with it.
std::string given(std::string_view word, const char* why) {
    return printed("\"%s\" given%s", one_line(std::string(word.substr(0, 40))).c_str(), why);
}

/// Words of a text, one after the other.
class Words {
public:
    Words(std::string path, std::string_view text) : path_(std::move(path)), text_(text) {}

    [[noreturn]] void refuse(const std::string& why) const {
        const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(last_), '\n');
        throw std::invalid_argument(path_ + ":" + std::to_string(line) + ": " + why);
    }
    bool at_end() {
        skip();
        return at_ == text_.size();
    }
    std::string_view next() {
        skip();
        last_ = at_;
        while (at_ < text_.size() && !is_blank(text_[at_])) {
            ++at_;
        }
        return text_.substr(last_, at_ - last_);
    }
    double number() {
        const std::string_view word = next();
        double value = 0;
        if (!parse_number(word, value) || !std::isfinite(value)) {
            refuse(given(word, ", a finite number wanted"));
        }
        return value;
    }
    /// Not negative, and no more than a file of this length can hold.
    std::size_t count() {
        const std::string_view word = next();
        std::size_t value = 0;
        if (!parse_number(word, value) || value > text_.size()) {
            refuse(given(word, ", a count or number within the file wanted"));
        }
        return value;
    }
    /// A tag: any integer.
    std::int64_t tag() {
        const double value = number();
        if (value != std::floor(value) || std::abs(value) > 9e15) {
            refuse("an integer wanted");
        }
        return static_cast<std::int64_t>(value);
    }
    void skip_words(std::size_t words) {
        for (std::size_t w = 0; w < words && !at_end(); ++w) {
            next();
        }
    }
    void skip_line() { at_ = std::min(text_.find('\n', at_), text_.size()); }
    /// Whether the word comes; then what follows it is next.
    bool find(std::string_view word) {
        while (!at_end()) {
            if (next() == word) {
                return true;
            }
        }
        return false;
    }

private:
    static bool is_blank(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }
    void skip() {
        while (at_ < text_.size() && is_blank(text_[at_])) {
            ++at_;
        }
    }

    std::string path_;
    std::string_view text_;
    std::size_t at_ = 0, last_ = 0;
};

/// The cells that are read, and what they are in files.
struct CellKind {
    CellShape shape;
    std::size_t gmsh, vtk;
    const char* name;
};
constexpr CellKind kKinds[] = {{CellShape::tetrahedron, 4, 10, "a tetrahedron"},
                               {CellShape::pyramid, 7, 14, "a pyramid"},
                               {CellShape::prism, 6, 13, "a prism"}};
/// Types that are no solids, and are passed over: points, lines and surfaces, of any degree.
constexpr std::size_t kGmshFlat[] = {1, 2, 3, 8, 9, 10, 15, 16}, kVtkFlat[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 21, 22, 23};

/// Nodes by the tags of a file.
class TaggedMesh {
public:
    explicit TaggedMesh(bool only_tetrahedra) : only_tetrahedra_(only_tetrahedra) {}

    /// Of a type, or none where such cells are passed over.
    const CellKind* kind(Words& words, std::size_t type, std::size_t CellKind::*of, std::span<const std::size_t> flat) {
        const auto* const known =
            std::find_if(std::begin(kKinds), std::end(kKinds), [&](const CellKind& k) { return k.*of == type; });
        const bool is_known = known != std::end(kKinds);
        if (!is_known && !only_tetrahedra_ && std::find(flat.begin(), flat.end(), type) == flat.end()) {
            words.refuse("solid cells of type " + std::to_string(type) +
                         " given: tetrahedra, pyramids and prisms with nodes at their corners are wanted");
        }
        return is_known && (!only_tetrahedra_ || known->shape == CellShape::tetrahedron) ? known : nullptr;
    }
    void add_node(std::int64_t tag, const std::array<double, 3>& at) { places_[tag] = at; }
    void add_cell(Words& words, const CellKind& kind, std::span<const std::int64_t> tags) {
        std::array<std::int32_t, 6> nodes{};
        for (std::size_t c = 0; c < tags.size(); ++c) {
            const auto place = places_.find(tags[c]);
            if (place == places_.end()) {
                words.refuse(kind.name + (" has the node " + std::to_string(tags[c])) + ", which is not there");
            }
            const auto [number, is_new] = numbers_.try_emplace(tags[c], static_cast<std::int32_t>(mesh_.nodes.size()));
            if (is_new) {
                mesh_.nodes.push_back(place->second);
            }
            nodes[c] = number->second;
        }
        mesh_.cells.push_back({kind.shape, nodes, 0});
    }
    /// Of Gmsh, with its tags next.
    void read_cell(Words& words, const CellKind& kind) {
        std::array<std::int64_t, 6> tags{};
        const auto used = std::span(tags).first(static_cast<std::size_t>(kind.shape));
        for (std::int64_t& tag : used) {
            tag = words.tag();
        }
        add_cell(words, kind, used);
    }
    CellMesh take(const Words& words) && {
        if (mesh_.cells.empty()) {
            words.refuse(only_tetrahedra_ ? "no tetrahedra given: some are wanted"
                                          : "no tetrahedra, pyramids or prisms given: some are wanted");
        }
        return std::move(mesh_);
    }

private:
    bool only_tetrahedra_;
    std::unordered_map<std::int64_t, std::array<double, 3>> places_;
    std::unordered_map<std::int64_t, std::int32_t> numbers_;
    CellMesh mesh_;
};

std::array<double, 3> position(Words& words) {
    const double x = words.number(), y = words.number(), z = words.number();
    return {x, y, z};
}

/// Nodes of Gmsh's cells by their type, from 1 on.
constexpr std::size_t kGmshNodes[] = {0, 2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13};

std::size_t gmsh_nodes(Words& words, std::size_t type) {
    if (type == 0 || type >= std::size(kGmshNodes)) {
        words.refuse("cells of type " + std::to_string(type) + " given: types 1 to 19 are known");
    }
    return kGmshNodes[type];
}

void read_gmsh2(Words& words, TaggedMesh& mesh) {
    if (!words.find("$Nodes")) {
        words.refuse("no $Nodes given");
    }
    for (std::size_t left = words.count(); left > 0; --left) {
        const std::int64_t tag = words.tag();
        mesh.add_node(tag, position(words));
    }
    if (!words.find("$Elements")) {
        words.refuse("no $Elements given");
    }
    for (std::size_t left = words.count(); left > 0; --left) {
        words.next();
        const std::size_t type = words.count(), tags = words.count(), nodes = gmsh_nodes(words, type);
        words.skip_words(tags);
        if (const CellKind* const kind = mesh.kind(words, type, &CellKind::gmsh, kGmshFlat)) {
            mesh.read_cell(words, *kind);
        } else {
            words.skip_words(nodes);
        }
    }
}

void read_gmsh4(Words& words, TaggedMesh& mesh) {
    if (!words.find("$Nodes")) {
        words.refuse("no $Nodes given");
    }
    std::size_t blocks = words.count();
    words.skip_words(3);
    for (; blocks > 0; --blocks) {
        words.skip_words(2);
        const std::size_t parametric = words.count(), count = words.count();
        if (parametric != 0) {
            words.refuse("parametric nodes given: plain ones are wanted");
        }
        std::vector<std::int64_t> tags;
        for (std::size_t n = 0; n < count; ++n) {
            tags.push_back(words.tag());
        }
        for (const std::int64_t tag : tags) {
            mesh.add_node(tag, position(words));
        }
    }
    if (!words.find("$Elements")) {
        words.refuse("no $Elements given");
    }
    blocks = words.count();
    words.skip_words(3);
    for (; blocks > 0; --blocks) {
        words.skip_words(2);
        const std::size_t type = words.count(), count = words.count(), nodes = gmsh_nodes(words, type);
        for (std::size_t e = 0; e < count; ++e) {
            words.next();
            if (const CellKind* const kind = mesh.kind(words, type, &CellKind::gmsh, kGmshFlat)) {
                mesh.read_cell(words, *kind);
            } else {
                words.skip_words(nodes);
            }
        }
    }
}

CellMesh read_gmsh(Words& words, TaggedMesh mesh) {
    words.next();
    const std::string version(words.next());
    if (words.next() != "0") {
        words.refuse("a binary file given: plain text is wanted");
    }
    if (version == "2.2") {
        read_gmsh2(words, mesh);
    } else if (version == "4.1") {
        read_gmsh4(words, mesh);
    } else {
        words.refuse(given(version, " as version: 2.2 or 4.1 is wanted"));
    }
    return std::move(mesh).take(words);
}

CellMesh read_vtk(Words& words, TaggedMesh mesh) {
    words.skip_line();
    words.next();
    words.skip_line(); // the title
    if (words.next() != "ASCII") {
        words.refuse("a binary file given: plain text is wanted");
    }
    if (words.next() != "DATASET" || words.next() != "UNSTRUCTURED_GRID") {
        words.refuse("another dataset than UNSTRUCTURED_GRID given");
    }
    if (!words.find("POINTS")) {
        words.refuse("no POINTS given");
    }
    const std::size_t points = words.count();
    words.next();
    for (std::size_t n = 0; n < points; ++n) {
        mesh.add_node(static_cast<std::int64_t>(n), position(words));
    }
    if (!words.find("CELLS")) {
        words.refuse("no CELLS given");
    }
    const std::size_t cells = words.count();
    words.next();
    std::vector<std::vector<std::int64_t>> all(cells);
    for (std::vector<std::int64_t>& cell : all) {
        for (std::size_t left = words.count(); left > 0; --left) {
            cell.push_back(words.tag());
        }
    }
    if (!words.find("CELL_TYPES") || words.count() != cells) {
        words.refuse("CELL_TYPES of " + std::to_string(cells) + " cells wanted");
    }
    for (const std::vector<std::int64_t>& cell : all) {
        if (const CellKind* const kind = mesh.kind(words, words.count(), &CellKind::vtk, kVtkFlat)) {
            if (cell.size() != static_cast<std::size_t>(kind->shape)) {
                words.refuse(kind->name + (" of " + std::to_string(cell.size())) + " nodes given");
            }
            mesh.add_cell(words, *kind, cell);
        }
    }
    return std::move(mesh).take(words);
}

// ---- springs

/// The components of n n n n that differ, each by the root of how often it comes: |n n n n|^2 is the sum of the
/// squares.
constexpr std::size_t kEntries = 15;
using Tensor = std::array<double, kEntries>;

Tensor fourth_power(const std::array<double, 3>& n) {
    Tensor t{};
    std::size_t e = 0;
    constexpr double kFactorial[] = {1, 1, 2, 6, 24};
    for (std::size_t a = 0; a <= 4; ++a) {
        for (std::size_t b = 0; a + b <= 4; ++b) {
            const std::size_t c = 4 - a - b;
            const double often = 24 / (kFactorial[a] * kFactorial[b] * kFactorial[c]);
            t[e++] = std::sqrt(often) * std::pow(n[0], static_cast<double>(a)) *
                     std::pow(n[1], static_cast<double>(b)) * std::pow(n[2], static_cast<double>(c));
        }
    }
    return t;
}

/// G (d_ij d_kl + d_ik d_jl + d_il d_jk): G (1, 1/3, 1) of x^4, x^2 y^2 and so on, three times.
Tensor isotropic(double shear_modulus) {
    Tensor t{};
    std::size_t e = 0;
    for (std::size_t a = 0; a <= 4; ++a) {
        for (std::size_t b = 0; a + b <= 4; ++b, ++e) {
            const std::size_t c = 4 - a - b;
            if (a % 2 == 0 && b % 2 == 0) {
                const bool one_axis = a == 4 || b == 4 || c == 4;
                t[e] = shear_modulus * (one_axis ? 3 : std::sqrt(6.0));
            }
        }
    }
    return t;
}

double dot(const Tensor& s, const Tensor& t) {
    double sum = 0;
    for (std::size_t e = 0; e < kEntries; ++e) {
        sum += s[e] * t[e];
    }
    return sum;
}

struct Edge {
    std::int32_t a, b;
    std::array<double, 3> vector;
    double length2, volume = 0; ///< m^2; m^3 around it, equal parts of each cell
    Tensor tensor;
    double weight = 0; ///< k l^2, J
};

/// Nodes' C less what is wanted, by the edges' weights.
struct Patches {
    std::vector<double> volume; ///< m^3 around a node, equal parts of each cell
    std::vector<Tensor> misfit; ///< Pa
};

void change_weight(Edge& edge, double by, Patches& patches) {
    edge.weight += by;
    for (const std::int32_t node : {edge.a, edge.b}) {
        const auto p = static_cast<std::size_t>(node);
        for (std::size_t e = 0; e < kEntries; ++e) {
            patches.misfit[p][e] += by / 2 / patches.volume[p] * edge.tensor[e];
        }
    }
}

/// One edge after the other to the least sum over nodes of V |misfit|^2 along its weight, at zero where that is below:
/// the sum is convex, and falls until no edge can lower it.
void fit_weights(std::vector<Edge>& edges, Patches& patches, double unit) {
    constexpr int kMostSweeps = 2000;
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
        double largest = 0;
        for (Edge& edge : edges) {
            const auto a = static_cast<std::size_t>(edge.a), b = static_cast<std::size_t>(edge.b);
            const double slope = dot(patches.misfit[a], edge.tensor) + dot(patches.misfit[b], edge.tensor);
            const double curvature = 0.5 / patches.volume[a] + 0.5 / patches.volume[b];
            const double by = std::max(-slope / curvature, -edge.weight);
            change_weight(edge, by, patches);
            largest = std::max(largest, std::abs(by) / (unit * edge.volume));
        }
        if (largest < 1e-6) {
            break;
        }
    }
}

std::string read(const std::string& path) {
    try {
        return read_file(path, Readable::file_or_pipe, std::uintmax_t{1} << 34);
    } catch (const ReadError& error) {
        throw std::invalid_argument(path + ": " + error.what());
    }
}

CellMesh read_mesh(const std::string& path, bool only_tetrahedra) {
    const std::string text = read(path);
    Words words(path, text);
    const std::string_view first = words.next();
    if (first == "$MeshFormat") {
        Words again(path, text);
        return read_gmsh(again, TaggedMesh(only_tetrahedra));
    }
    if (first == "#") {
        return read_vtk(words, TaggedMesh(only_tetrahedra));
    }
    words.refuse(given(first, " where a file begins: Gmsh's .msh ($MeshFormat) or VTK's legacy .vtk (# vtk) "
                              "is wanted"));
}

/// The mirror image of a cell's numbers.
void turn_over(Network::Polyhedron& cell) {
    std::swap(cell.nodes[1], cell.nodes[cell.shape == CellShape::pyramid ? 3 : 2]);
    if (cell.shape == CellShape::prism) {
        std::swap(cell.nodes[4], cell.nodes[5]);
    }
}

} // namespace

bool CellMesh::operator==(const CellMesh& other) const {
    return nodes == other.nodes && std::equal(cells.begin(), cells.end(), other.cells.begin(), other.cells.end(),
                                              [](const auto& a, const auto& b) {
                                                  return a.shape == b.shape && a.nodes == b.nodes && a.kappa == b.kappa;
                                              });
}

CellMesh read_tetrahedra(const std::string& path) {
    return read_mesh(path, true);
}

CellMesh read_cells(const std::string& path) {
    return read_mesh(path, false);
}

FittedCells fit_springs(const CellMesh& mesh, const Material& material, double most_anisotropy) {
    validate(Lattice::box(1, 1, 1, 1), material);
    if (material.springs == SpringForm::means || material.crush.any()) {
        throw std::invalid_argument(
            "springs on means or crush resistance given for cells that are no cubes: cubes alone have them");
    }
    if (!(most_anisotropy > 0)) {
        refuse_value("most_anisotropy", most_anisotropy, "above 0");
    }
    FittedCells fitted;
    Network& network = fitted.network;
    network.rest_positions = mesh.nodes;
    network.masses.assign(mesh.nodes.size(), 0.0);
    network.volume_energy = resolved_volume_energy(material);
    network.stiffening = material.stiffening;
    const double kappa = network.volume_energy == VolumeEnergy::none ? 0 : volume_modulus(material);
    for (const Network::Polyhedron& given : mesh.cells) {
        Network::Polyhedron cell = given;
        cell.kappa = kappa;
        const bool nodes_are_there = std::all_of(cell.nodes.begin(), cell.nodes.end(), [&](auto n) {
            return n >= 0 && static_cast<std::size_t>(n) < mesh.nodes.size();
        });
        network.nodal_volumes = network.nodal_volumes || cell.shape == CellShape::tetrahedron;
        if (nodes_are_there && polyhedron_vectors(network, cell).volume < 0) {
            turn_over(cell);
        }
        network.polyhedra.push_back(cell);
    }
    network.masses.assign(mesh.nodes.size(), 1.0);
    validate(network);
    network.masses.assign(mesh.nodes.size(), 0.0);
    std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> known;
    std::vector<Edge> edges;
    Patches patches{std::vector<double>(mesh.nodes.size(), 0.0), {}};
    double total = 0;
    for (const Network::Polyhedron& cell : network.polyhedra) {
        const double volume = polyhedron_vectors(network, cell).volume;
        const auto nodes = static_cast<double>(cell.node_count()), pairs = nodes * (nodes - 1) / 2;
        total += volume;
        for (std::size_t c = 0; c < cell.node_count(); ++c) {
            patches.volume[static_cast<std::size_t>(cell.nodes[c])] += volume / nodes;
            network.masses[static_cast<std::size_t>(cell.nodes[c])] += material.density * volume / nodes;
            for (std::size_t d = 0; d < c; ++d) {
                const auto [a, b] = std::minmax(cell.nodes[c], cell.nodes[d]);
                const auto [at, is_new] = known.try_emplace({a, b}, edges.size());
                if (is_new) {
                    Edge edge{a, b, {}, 0, 0, {}, 0};
                    std::array<double, 3> unit{};
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        edge.vector[axis] = mesh.nodes[static_cast<std::size_t>(b)][axis] -
                                            mesh.nodes[static_cast<std::size_t>(a)][axis];
                        edge.length2 += edge.vector[axis] * edge.vector[axis];
                    }
                    for (std::size_t axis = 0; axis < 3; ++axis) {
                        unit[axis] = edge.vector[axis] / std::sqrt(edge.length2);
                    }
                    edge.tensor = fourth_power(unit);
                    edges.push_back(edge);
                }
                edges[at->second].volume += volume / pairs;
            }
        }
    }
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        if (!(patches.volume[n] > 0)) {
            throw std::invalid_argument("node " + std::to_string(n) + ": no cell has it");
        }
    }
    // C_iikk = 15 G is the sum of the weights by the volume: so begins each edge, by its own.
    const double modulus = shear_modulus(material);
    const Tensor wanted = isotropic(modulus);
    patches.misfit.assign(mesh.nodes.size(), {});
    for (Tensor& misfit : patches.misfit) {
        for (std::size_t e = 0; e < kEntries; ++e) {
            misfit[e] = -wanted[e];
        }
    }
    for (Edge& edge : edges) {
        change_weight(edge, 15 * modulus * edge.volume, patches);
    }
    fit_weights(edges, patches, 15 * modulus);

    Tensor mean{};
    double square = 0, sum = 0;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
        square += patches.volume[n] / total * dot(patches.misfit[n], patches.misfit[n]);
        for (std::size_t e = 0; e < kEntries; ++e) {
            mean[e] += patches.volume[n] / total * patches.misfit[n][e];
        }
    }
    for (const Edge& edge : edges) {
        sum += edge.weight;
        if (edge.weight > 0) {
            network.springs.push_back({edge.a, edge.b, edge.weight / edge.length2, edge.vector});
        } else {
            ++fitted.without;
        }
    }
    fitted.misfit = std::sqrt(square / dot(wanted, wanted));
    fitted.anisotropy = std::sqrt(dot(mean, mean) / dot(wanted, wanted));
    fitted.modulus_error = sum / (15 * modulus * total) - 1;
    if (!(std::max(fitted.anisotropy, std::abs(fitted.modulus_error)) <= most_anisotropy)) {
        throw std::invalid_argument(printed("a mesh whose springs are far from isotropic given: anisotropy %.3g and "
                                            "error of the shear modulus %.3g, at most %.3g allowed",
                                            fitted.anisotropy, fitted.modulus_error, most_anisotropy));
    }
    return fitted;
}

} // namespace hybmss
