#include "solvers/newton/turning.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

/// A lattice this many times as long as it is wide counts as slender.
constexpr int kSlender = 6;

Eigen::Vector3d vector(const std::array<double, 3>& v) {
    return {v[0], v[1], v[2]};
}

Eigen::Matrix3d turned_by(const Eigen::Vector3d& rotation) {
    const double angle = rotation.norm();
    return angle > 0 ? Eigen::AngleAxisd(angle, rotation / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

} // namespace

Sections Sections::of(const Lattice& lattice) {
    Sections sections;
    sections.cells_ = lattice.cells();
    sections.cell_size_ = lattice.cell_size();
    sections.grid_nodes_ = lattice.nodes();
    std::array<int, 3> sorted = lattice.cells();
    std::sort(sorted.begin(), sorted.end());
    if (sorted[2] >= kSlender * sorted[1]) {
        sections.axis_ = static_cast<std::size_t>(std::find(lattice.cells().begin(), lattice.cells().end(), sorted[2]) -
                                                  lattice.cells().begin());
        sections.count_ = static_cast<std::size_t>(sorted[2] + 1);
    }
    return sections;
}

Sections Sections::of(const Network& network) {
    Sections sections;
    sections.rest_positions_ = network.rest_positions;
    return sections;
}

std::array<double, 3> Sections::rest_position(std::size_t node) const {
    if (!rest_positions_.empty()) {
        return rest_positions_[node];
    }
    const auto row = static_cast<std::uint32_t>(cells_[0] + 1), rows = static_cast<std::uint32_t>(cells_[1] + 1);
    const std::uint32_t n = grid_nodes_[node];
    return {n % row * cell_size_, n / row % rows * cell_size_, n / row / rows * cell_size_};
}

std::size_t Sections::of_node(std::size_t node) const {
    if (count_ == 1) {
        return 0;
    }
    const auto row = static_cast<std::uint32_t>(cells_[0] + 1), rows = static_cast<std::uint32_t>(cells_[1] + 1);
    const std::uint32_t n = grid_nodes_[node], place[3] = {n % row, n / row % rows, n / row / rows};
    return place[axis_];
}

template <class T>
Turning<T>::Turning(const Body<T>& body, Sections sections) : body_(&body), sections_(std::move(sections)) {}

template <class T>
auto Turning<T>::at(const NodeField<T>& field, std::size_t node) const -> Vector {
    Vector v;
    for (std::size_t c = 0; c < 3; ++c) {
        const Component<const T> all = component(field, c);
        v[c] = static_cast<double>(all.first[static_cast<std::ptrdiff_t>(places_[node]) * all.stride]);
    }
    return v;
}

template <class T>
auto Turning<T>::position(const State<T>& state, std::size_t node) const -> Vector {
    Vector x = at(state.displacement, node);
    const Vector rest = sections_.rest_position(node);
    for (std::size_t c = 0; c < 3; ++c) {
        x[c] += rest[c] / body_->length_unit();
    }
    return x;
}

template <class T>
void Turning<T>::hold(std::span<const std::uint8_t> held) {
    held_ = held;
    pays_ = sections_.count() > 1 || leaves_a_rotation(held);
}

// A motion t + w x r is free where no held component moves: the kernel of the sum of c c^T, c = (e, r x e) by held
// axis e. It is a rotation where it is none of the translations.
template <class T>
bool Turning<T>::leaves_a_rotation(std::span<const std::uint8_t> held) const {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double count = 0;
    for (std::size_t n = 0; n < held.size(); ++n) {
        if (held[n] != 0) {
            center += vector(sections_.rest_position(n));
            count += 1;
        }
    }
    if (count == 0) {
        return true;
    }
    center /= count;
    double size = 0;
    for (std::size_t n = 0; n < held.size(); ++n) {
        if (held[n] != 0) {
            size = std::max(size, (vector(sections_.rest_position(n)) - center).norm());
        }
    }
    Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
    for (std::size_t n = 0; n < held.size(); ++n) {
        for (int a = 0; a < 3; ++a) {
            if (held[n] >> a & 1) {
                Eigen::Matrix<double, 6, 1> c;
                const Eigen::Vector3d e = Eigen::Vector3d::Unit(a);
                const Eigen::Vector3d r = (vector(sections_.rest_position(n)) - center) / (size > 0 ? size : 1);
                c << e, r.cross(e);
                sum += c * c.transpose();
            }
        }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(sum);
    for (int i = 0; i < 6; ++i) {
        if (solver.eigenvalues()[i] < 1e-9 * count && solver.eigenvectors().col(i).tail<3>().norm() > 1e-3) {
            return true;
        }
    }
    return false;
}

template <class T>
double Turning<T>::fit(const State<T>& state, const NodeVector<T>& step) {
    if (places_.empty()) { // most bodies never turn
        for (std::size_t n = 0; n < body_->node_count(); ++n) {
            places_.push_back(static_cast<std::uint32_t>(body_->index_of(n)));
        }
    }
    fitted_.assign(sections_.count(), Section{});
    for (std::size_t n = 0; n < body_->node_count(); ++n) {
        Section& section = fitted_[sections_.of_node(n)];
        const Vector x = position(state, n), p = at(step.field, n);
        section.nodes += 1;
        for (std::size_t c = 0; c < 3; ++c) {
            section.center[c] += x[c];
            section.translation[c] += p[c];
        }
    }
    std::vector<Eigen::Matrix3d> inertia(fitted_.size(), Eigen::Matrix3d::Zero());
    std::vector<Eigen::Vector3d> moment(fitted_.size(), Eigen::Vector3d::Zero());
    for (Section& section : fitted_) {
        for (std::size_t c = 0; c < 3 && section.nodes > 0; ++c) {
            section.center[c] /= section.nodes;
            section.translation[c] /= section.nodes;
        }
    }
    for (std::size_t n = 0; n < body_->node_count(); ++n) {
        const std::size_t s = sections_.of_node(n);
        const Eigen::Vector3d r = vector(position(state, n)) - vector(fitted_[s].center);
        const Eigen::Vector3d p = vector(at(step.field, n)) - vector(fitted_[s].translation);
        inertia[s] += r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose();
        moment[s] += r.cross(p);
    }
    double greatest = 0;
    for (std::size_t s = 0; s < fitted_.size(); ++s) {
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia[s]);
        const double smallest = 1e-6 * solver.eigenvalues()[2];
        Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
        for (int i = 0; i < 3; ++i) {
            if (fitted_[s].nodes > 0 && solver.eigenvalues()[i] > smallest) {
                const Eigen::Vector3d axis = solver.eigenvectors().col(i);
                rotation += axis.dot(moment[s]) / solver.eigenvalues()[i] * axis;
            }
        }
        fitted_[s].rotation = {rotation[0], rotation[1], rotation[2]};
        greatest = std::max(greatest, rotation.norm());
    }
    // A layer without nodes goes with the one before.
    const auto has_nodes = [](const Section& section) { return section.nodes > 0; };
    const auto first = std::find_if(fitted_.begin(), fitted_.end(), has_nodes);
    for (auto s = fitted_.begin(); s != fitted_.end(); ++s) {
        if (!has_nodes(*s)) {
            *s = s < first ? *first : *(s - 1);
        }
    }
    return greatest;
}

template <class T>
void Turning<T>::move(const NodeVector<T>& step, double part, State<T>& state) const {
    const std::size_t count = fitted_.size();
    std::vector<Eigen::Vector3d> center(count);
    std::vector<Eigen::Matrix3d> turn(count);
    for (std::size_t s = 0; s < count; ++s) {
        const Eigen::Vector3d rotation = part * vector(fitted_[s].rotation);
        turn[s] = turned_by(rotation);
        if (s == 0) {
            center[s] = vector(fitted_[s].center) + part * vector(fitted_[s].translation);
            continue;
        }
        const Section &before = fitted_[s - 1], &now = fitted_[s];
        const Eigen::Vector3d mean = part * 0.5 * (vector(before.rotation) + vector(now.rotation));
        const Eigen::Vector3d chord = vector(now.center) - vector(before.center);
        const Eigen::Vector3d stretch =
            part * (vector(now.translation) - vector(before.translation)) - mean.cross(chord);
        center[s] = center[s - 1] + turned_by(mean) * (chord + stretch);
    }
    // What the turned step lacks of the step itself: at held components, and for an axis that nothing holds, in the
    // mean.
    std::vector<Eigen::Vector3d> lack(count, Eigen::Vector3d::Zero()), held(count, Eigen::Vector3d::Zero());
    Eigen::Vector3d mean_lack = Eigen::Vector3d::Zero();
    const auto turned = [&](std::size_t n, std::size_t s) -> Eigen::Vector3d {
        const Eigen::Vector3d r = vector(position(state, n)) - vector(fitted_[s].center);
        const Eigen::Vector3d p = part * vector(at(step.field, n));
        const Eigen::Vector3d rest =
            p - part * vector(fitted_[s].translation) - part * vector(fitted_[s].rotation).cross(r);
        return center[s] - vector(fitted_[s].center) + turn[s] * (r + rest) - r;
    };
    const std::size_t nodes = body_->node_count();
    std::vector<Eigen::Vector3d> moved(nodes);
    for (std::size_t n = 0; n < nodes; ++n) {
        const std::size_t s = sections_.of_node(n);
        moved[n] = turned(n, s);
        const Eigen::Vector3d less = part * vector(at(step.field, n)) - moved[n];
        mean_lack += less / static_cast<double>(nodes);
        for (int c = 0; c < 3; ++c) {
            if (held_[n] >> c & 1) {
                lack[s][c] += less[c];
                held[s][c] += 1;
            }
        }
    }
    for (int c = 0; c < 3; ++c) {
        std::size_t last = count;
        for (std::size_t s = 0; s < count; ++s) {
            if (held[s][c] == 0) {
                continue;
            }
            lack[s][c] /= held[s][c];
            const std::size_t first = last == count ? 0 : last + 1;
            for (std::size_t k = first; k < s; ++k) {
                const double w = last == count ? 1 : static_cast<double>(k - last) / static_cast<double>(s - last);
                lack[k][c] = w * lack[s][c] + (last == count ? 0 : (1 - w) * lack[last][c]);
            }
            last = s;
        }
        for (std::size_t k = last == count ? 0 : last + 1; k < count; ++k) {
            lack[k][c] = last == count ? mean_lack[c] : lack[last][c];
        }
    }
    for (std::size_t n = 0; n < nodes; ++n) {
        const std::size_t s = sections_.of_node(n);
        const Vector p = at(step.field, n);
        for (std::size_t c = 0; c < 3; ++c) {
            const Component<T> u = component(state.displacement, c);
            const bool is_held = (held_[n] >> c & 1) != 0;
            const auto i = static_cast<Eigen::Index>(c);
            u.first[static_cast<std::ptrdiff_t>(places_[n]) * u.stride] +=
                static_cast<T>(is_held ? part * p[c] : moved[n][i] + lack[s][i]);
        }
    }
}

template class Turning<float>;
template class Turning<double>;

} // namespace hybmss
