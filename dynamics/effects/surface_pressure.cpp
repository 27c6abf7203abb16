#include "dynamics/effects/surface_pressure.hpp"

#include "dynamics/contact/obstacle_geometry.hpp"
#include "dynamics/explicit_dynamics_implementation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>

namespace hybmss {

std::vector<SurfaceFace> surface_faces(const Lattice& lattice, const std::array<double, 3>& origin) {
    const NodeNumbers numbers(lattice, lattice.nodes().size());
    std::vector<SurfaceFace> faces;
    for (const std::array<std::size_t, 4>& of_grid : boundary_faces(lattice)) {
        SurfaceFace& face = faces.emplace_back();
        for (std::size_t c = 0; c < 4; ++c) {
            face.nodes[c] = numbers.of(of_grid[c]);
            face.rest_positions[c] = plus(lattice.rest_position(of_grid[c]), 1, origin);
        }
    }
    return faces;
}

std::vector<SurfaceFace> surface_faces(const Network& network) {
    // Low and high side across x, y and z, by corners of the cell.
    constexpr std::array<std::array<std::size_t, 4>, 6> kSides = {
        {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
    std::map<std::array<std::uint32_t, 4>, int> known; // by ascending nodes
    const auto for_each_face = [&](const auto& visit) {
        for (const Network::Cell& cell : network.cells) {
            for (const auto& side : kSides) {
                std::array<std::uint32_t, 4> nodes{};
                for (std::size_t c = 0; c < 4; ++c) {
                    nodes[c] = static_cast<std::uint32_t>(cell.nodes[side[c]]);
                }
                std::array<std::uint32_t, 4> sorted = nodes;
                std::sort(sorted.begin(), sorted.end());
                visit(nodes, known[sorted]);
            }
        }
    };
    for_each_face([](const auto&, int& count) { ++count; });
    std::vector<SurfaceFace> faces;
    for_each_face([&](const auto& nodes, int count) {
        if (count == 1) {
            SurfaceFace& face = faces.emplace_back();
            face.nodes = nodes;
            for (std::size_t c = 0; c < 4; ++c) {
                face.rest_positions[c] = network.rest_positions[nodes[c]];
            }
        }
    });
    return faces;
}

namespace {

/// `rest_of(node)` for those below `nodes`.
template <class RestOf>
void set_rests(std::span<SurfaceFace> faces, std::size_t nodes, const RestOf& rest_of) {
    check_faces(faces, nodes);
    for (SurfaceFace& face : faces) {
        for (std::size_t c = 0; c < 4; ++c) {
            face.rest_positions[c] = rest_of(face.nodes[c]);
        }
    }
}

} // namespace

void set_rest_positions(const Lattice& lattice, std::span<SurfaceFace> faces, const std::array<double, 3>& origin) {
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    set_rests(faces, nodes.size(),
              [&](std::uint32_t node) { return plus(lattice.rest_position(nodes[node]), 1, origin); });
}

void set_rest_positions(const Network& network, std::span<SurfaceFace> faces) {
    set_rests(faces, network.rest_positions.size(), [&](std::uint32_t node) { return network.rest_positions[node]; });
}

FaceCorners pressure_forces(const FaceCorners& x) {
    const auto& [a, b, c, d] = x;
    const Point e = plus(b, -1, a), g = plus(d, -1, a), q = plus(plus(c, -1, b), -1, g);
    const Point n = cross(e, g), m = cross(e, q), l = cross(q, g);
    // The integrals of N_a, N_a s and N_a t.
    constexpr double kS[4] = {1.0 / 12, 1.0 / 6, 1.0 / 6, 1.0 / 12}, kT[4] = {1.0 / 12, 1.0 / 12, 1.0 / 6, 1.0 / 6};
    FaceCorners forces;
    for (std::size_t corner = 0; corner < 4; ++corner) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            forces[corner][axis] = -(n[axis] / 4 + kS[corner] * m[axis] + kT[corner] * l[axis]);
        }
    }
    return forces;
}

void check_faces(std::span<const SurfaceFace> faces, std::size_t nodes) {
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const std::string name = "pressed face " + std::to_string(f);
        std::array<std::uint32_t, 4> sorted = faces[f].nodes;
        std::sort(sorted.begin(), sorted.end());
        if (sorted[3] >= nodes) {
            throw std::invalid_argument(name + ": its node " + std::to_string(sorted[3]) +
                                        " must be below the body's " + std::to_string(nodes) + " nodes");
        }
        if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
            throw std::invalid_argument(name + ": its four nodes must be different ones");
        }
        for (const auto& x : faces[f].rest_positions) {
            if (!std::isfinite(dot(x, x))) {
                throw std::invalid_argument(name + ": its rest positions must be finite");
            }
        }
    }
}

void check_pressures(std::span<const double> pressures, std::size_t faces) {
    if (pressures.size() != faces) {
        throw std::invalid_argument(std::to_string(pressures.size()) + " pressures given for " + std::to_string(faces) +
                                    " faces: there must be as many");
    }
    for (std::size_t f = 0; f < pressures.size(); ++f) {
        if (!std::isfinite(pressures[f])) {
            throw std::invalid_argument("pressure on face " + std::to_string(f) + ": it must be finite");
        }
    }
}

template <class T>
SurfacePressure<T>::SurfacePressure(const Body<T>& body, std::span<const SurfaceFace> faces,
                                    std::span<const double> pressures)
    : length_unit_(body.length_unit()) {
    check_faces(faces, body.node_count());
    std::vector<std::uint32_t> numbers;
    for (const SurfaceFace& face : faces) {
        numbers.insert(numbers.end(), face.nodes.begin(), face.nodes.end());
    }
    std::sort(numbers.begin(), numbers.end());
    numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
    for (const std::uint32_t number : numbers) {
        nodes_.push_back({{}, body.index_of(number), number, 0});
    }
    std::vector<std::uint32_t> next(nodes_.size() + 1, 0);
    for (const SurfaceFace& given : faces) {
        Face& face = faces_.emplace_back();
        for (std::size_t c = 0; c < 4; ++c) {
            const auto place = std::lower_bound(numbers.begin(), numbers.end(), given.nodes[c]) - numbers.begin();
            face.nodes[c] = static_cast<std::uint32_t>(place);
            nodes_[face.nodes[c]].rest = given.rest_positions[c];
            ++next[face.nodes[c] + 1];
        }
    }
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        nodes_[n].first_use = next[n];
    }
    uses_.resize(4 * faces_.size());
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
        for (std::uint32_t c = 0; c < 4; ++c) {
            uses_[next[faces_[f].nodes[c]]++] = {f, c};
        }
    }
    positions_.resize(nodes_.size());
    corner_forces_.resize(faces_.size());
    forces_.resize(nodes_.size());
    work_.assign(pieces(nodes_.size()), 0.0);
    set(pressures);
}

template <class T>
void SurfacePressure<T>::set(std::span<const double> pressures) {
    check_pressures(pressures, faces_.size());
    pressures_.assign(pressures.begin(), pressures.end());
}

template <class T>
auto SurfacePressure<T>::position(const Node& node, const Components& u) const -> Point {
    Point x;
    for (std::size_t a = 0; a < 3; ++a) {
        const auto at = static_cast<std::ptrdiff_t>(node.index) * u[a].stride;
        x[a] = node.rest[a] + length_unit_ * static_cast<double>(u[a].first[at]);
    }
    return x;
}

template <class T>
void SurfacePressure<T>::push(std::size_t f, std::span<const Point> positions, FaceCorners& forces) const {
    const Face& face = faces_[f];
    if (!face.there || pressures_[f] == 0) {
        forces = {};
        return;
    }
    FaceCorners x;
    for (std::size_t c = 0; c < 4; ++c) {
        x[c] = positions[face.nodes[c]];
    }
    forces = pressure_forces(x);
    for (auto& force : forces) {
        for (double& component : force) {
            component *= pressures_[f];
        }
    }
}

template <class T>
auto SurfacePressure<T>::gathered(std::size_t n, std::span<const FaceCorners> forces) const -> Point {
    const std::size_t end = n + 1 < nodes_.size() ? nodes_[n + 1].first_use : uses_.size();
    Point sum = {0, 0, 0};
    for (std::size_t use = nodes_[n].first_use; use < end; ++use) {
        sum = plus(sum, 1, forces[uses_[use].face][uses_[use].corner]);
    }
    return sum;
}

template <class T>
auto SurfacePressure<T>::velocity(const Node& node, const Components& v) const -> Point {
    Point w;
    for (std::size_t a = 0; a < 3; ++a) {
        w[a] = length_unit_ * static_cast<double>(v[a].first[static_cast<std::ptrdiff_t>(node.index) * v[a].stride]);
    }
    return w;
}

template <class T>
template <class Visit>
void SurfacePressure<T>::for_each_force(const State<T>& state, const Visit& visit) const {
    const Components displacement = components(state.displacement);
    std::vector<Point> positions(nodes_.size());
    std::vector<FaceCorners> forces(faces_.size());
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        positions[n] = position(nodes_[n], displacement);
    }
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        push(f, positions, forces[f]);
    }
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        visit(nodes_[n], gathered(n, forces));
    }
}

namespace {

/// velocity += seconds * force / mass, at a node.
template <class T>
void kick_node(const std::array<Component<T>, 3>& velocity, std::size_t index, const T* inverse_mass, double seconds,
               const std::array<double, 3>& force) {
    for (std::size_t a = 0; a < 3; ++a) {
        const auto at = static_cast<std::ptrdiff_t>(index) * velocity[a].stride;
        velocity[a].first[at] += static_cast<T>(seconds * force[a] * static_cast<double>(inverse_mass[at]));
    }
}

template <class T>
std::array<Component<T>, 3> writable(NodeField<T>& field) {
    return {component(field, 0), component(field, 1), component(field, 2)};
}

} // namespace

template <class T>
void SurfacePressure<T>::set(std::span<const double> pressures, const Body<T>& body, State<T>& state, double pending) {
    std::vector<Point> less; // forces before and after, by the same velocities
    for_each_force(state, [&](const Node&, const Point& force) { less.push_back(force); });
    set(pressures);
    const std::array<Component<T>, 3> velocities = writable(state.velocity);
    const Components v = components(state.velocity);
    std::size_t n = 0;
    for_each_force(state, [&](const Node& node, const Point& force) {
        less[n] = plus(less[n], -1, force);
        work_[0] += half_ * dot(less[n], velocity(node, v));
        kick_node(velocities, node.index, body.inverse_masses().data(), pending, less[n]);
        ++n;
    });
}

template <class T>
double SurfacePressure<T>::greatest_acceleration(const Body<T>& body) const {
    std::vector<double> forces(nodes_.size(), 0.0);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
        FaceCorners x;
        for (std::size_t c = 0; c < 4; ++c) {
            x[c] = nodes_[faces_[f].nodes[c]].rest;
        }
        const FaceCorners at_rest = pressure_forces(x);
        for (std::size_t c = 0; c < 4; ++c) {
            forces[faces_[f].nodes[c]] += 4 * std::abs(pressures_[f]) * length(at_rest[c]);
        }
    }
    double greatest = 0;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const double mass = body.masses()[nodes_[n].number];
        greatest = mass > 0 ? std::max(greatest, forces[n] / mass) : greatest;
    }
    return greatest;
}

template <class T>
void SurfacePressure<T>::add_stages(const Body<T>& body, State<T>& state, const StepFactors& factors,
                                    std::vector<Stage>& stages) {
    const auto in_pieces = [&stages](std::size_t count, const auto& of_piece) {
        stages.push_back({pieces(count), [=](std::size_t piece, std::size_t) {
                              of_piece(piece, piece * kPiece, std::min((piece + 1) * kPiece, count));
                          }});
    };
    in_pieces(nodes_.size(),
              [this, u = components(state.displacement)](std::size_t, std::size_t begin, std::size_t end) {
                  for (std::size_t n = begin; n < end; ++n) {
                      positions_[n] = position(nodes_[n], u);
                  }
              });
    in_pieces(faces_.size(), [this](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t f = begin; f < end; ++f) {
            push(f, positions_, corner_forces_[f]);
        }
    });
    in_pieces(nodes_.size(),
              [this, v = components(state.velocity), velocities = writable(state.velocity), kick = factors.kick,
               inverse_mass = body.inverse_masses().data()](std::size_t piece, std::size_t begin, std::size_t end) {
                  double work = 0;
                  for (std::size_t n = begin; n < end; ++n) {
                      forces_[n] = gathered(n, corner_forces_);
                      work += half_ * dot(forces_[n], velocity(nodes_[n], v));
                      kick_node(velocities, nodes_[n].index, inverse_mass, kick, forces_[n]);
                  }
                  work_[piece] += work;
              });
}

template <class T>
void SurfacePressure<T>::add_last_stages(const Body<T>&, State<T>& state, const StepFactors& factors,
                                         std::vector<Stage>& stages) {
    stages.push_back({pieces(nodes_.size()), [this, v = components(state.velocity),
                                              half = factors.time_step / 2](std::size_t piece, std::size_t) {
                          const std::size_t begin = piece * kPiece, end = std::min(begin + kPiece, nodes_.size());
                          double work = 0;
                          for (std::size_t n = begin; n < end; ++n) {
                              work += half * dot(forces_[n], velocity(nodes_[n], v));
                          }
                          work_[piece] += work;
                          if (piece == 0) { // no piece of this stage reads it
                              half_ = half;
                          }
                      }});
}

// The first half of what the next step's force will have done belongs to the way to this state.
template <class T>
double SurfacePressure<T>::energy(const Body<T>&, State<T>& state) const {
    double work = std::accumulate(work_.begin(), work_.end(), 0.0);
    if (half_ > 0) {
        const Components v = components(state.velocity);
        for_each_force(state,
                       [&](const Node& node, const Point& force) { work += half_ * dot(force, velocity(node, v)); });
    }
    return -work;
}

template <class T>
void SurfacePressure<T>::add_forces(const Body<T>&, State<T>& state, NodeField<T>& force) const {
    for_each_force(state, [&](const Node& node, const Point& f) {
        for (std::size_t a = 0; a < 3; ++a) {
            const Component<T> c = component(force, a);
            c.first[static_cast<std::ptrdiff_t>(node.index) * c.stride] += static_cast<T>(f[a]);
        }
    });
}

template <class T>
void SurfacePressure<T>::body_was_cut(const Body<T>&, const Lattice& lattice, const NodeNumbers& numbers,
                                      std::span<const CutNode> nodes) {
    std::vector<std::uint32_t> cut;
    for (const CutNode& node : nodes) {
        cut.push_back(node.node);
    }
    std::sort(cut.begin(), cut.end());
    const auto place = [&](const Node& node) {
        const std::size_t at = numbers.grid_node(node.number);
        const auto row = static_cast<std::size_t>(lattice.cells()[0]) + 1,
                   layer = row * (static_cast<std::size_t>(lattice.cells()[1]) + 1);
        return std::array<int, 3>{static_cast<int>(at % row), static_cast<int>(at % layer / row),
                                  static_cast<int>(at / layer)};
    };
    for (Face& face : faces_) {
        const bool touched = std::any_of(face.nodes.begin(), face.nodes.end(), [&](std::uint32_t n) {
            return std::binary_search(cut.begin(), cut.end(), nodes_[n].number);
        });
        if (!touched || !face.there) {
            continue;
        }
        // The cell is behind the face: low corner and outer normal tell it.
        std::array<int, 3> cell = place(nodes_[face.nodes[0]]);
        for (const std::uint32_t n : face.nodes) {
            const std::array<int, 3> at = place(nodes_[n]);
            for (std::size_t a = 0; a < 3; ++a) {
                cell[a] = std::min(cell[a], at[a]);
            }
        }
        const Point& corner = nodes_[face.nodes[0]].rest;
        const Point normal =
            cross(plus(nodes_[face.nodes[1]].rest, -1, corner), plus(nodes_[face.nodes[3]].rest, -1, corner));
        for (std::size_t a = 0; a < 3; ++a) {
            cell[a] -= 2 * normal[a] > length(normal) ? 1 : 0;
        }
        bool inside = true;
        for (std::size_t a = 0; a < 3; ++a) {
            inside = inside && cell[a] >= 0 && cell[a] < lattice.cells()[a];
        }
        face.there = inside && lattice.cell_scale(cell[0], cell[1], cell[2]) > 0;
    }
}

template <class T>
std::vector<double> SurfacePressure<T>::memory() const {
    std::vector<double> memory = {half_};
    memory.insert(memory.end(), work_.begin(), work_.end());
    return memory;
}

template <class T>
void SurfacePressure<T>::set_memory(std::span<const double> memory) {
    half_ = memory[0];
    std::copy(memory.begin() + 1, memory.end(), work_.begin());
}

template <class T>
std::size_t SurfacePressure<T>::bytes() const {
    return nodes_.size() * (sizeof(Node) + 2 * sizeof(Point)) +
           faces_.size() * (sizeof(Face) + 4 * sizeof(Use) + sizeof(FaceCorners) + sizeof(double)) +
           work_.size() * sizeof(double);
}

template <class T>
void ExplicitDynamics<T>::press(std::span<const SurfaceFace> faces, std::span<const double> pressures) {
    Implementation& i = *implementation_;
    check_pressures(pressures, faces.size());
    auto effect = faces.empty() ? nullptr : std::make_unique<SurfacePressure<T>>(*i.body, faces, pressures);
    const double acceleration = effect ? effect->greatest_acceleration(*i.body) : 0;
    i.template replace<SurfacePressure<T>>(std::move(effect));
    i.push(acceleration);
}

template <class T>
void ExplicitDynamics<T>::set_pressures(std::span<const double> pressures) {
    Implementation& i = *implementation_;
    auto* const effect = i.template find<SurfacePressure<T>>();
    check_pressures(pressures, effect ? effect->pressures().size() : 0);
    if (!effect || std::equal(pressures.begin(), pressures.end(), effect->pressures().begin())) {
        return;
    }
    if (i.half) { // the half kick that is still to come takes the pressures of its own step, not those after it
        effect->set(pressures, *i.body, i.state, half_kick(*i.half).kick);
    } else {
        effect->set(pressures);
    }
    i.push(effect->greatest_acceleration(*i.body));
}

template class SurfacePressure<float>;
template class SurfacePressure<double>;
template void ExplicitDynamics<float>::press(std::span<const SurfaceFace>, std::span<const double>);
template void ExplicitDynamics<double>::press(std::span<const SurfaceFace>, std::span<const double>);
template void ExplicitDynamics<float>::set_pressures(std::span<const double>);
template void ExplicitDynamics<double>::set_pressures(std::span<const double>);

} // namespace hybmss
