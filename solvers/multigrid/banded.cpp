#include "solvers/multigrid/banded.hpp"

#include "solvers/newton/body_geometry.hpp"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hybmss {
namespace {

/// Pivots below this part of a diagonal entry are rounding: of a rod that nothing holds.
constexpr double kSmallestPivot = 1e-13;

double dot(const double* a, const double* b, std::size_t count) {
    const auto n = static_cast<Eigen::Index>(count);
    return Eigen::Map<const Eigen::VectorXd>(a, n).dot(Eigen::Map<const Eigen::VectorXd>(b, n));
}

} // namespace

BandMatrix::BandMatrix(std::size_t size, std::size_t width)
    : size_(size), width_(width), entries_(size * (width + 1)) {}

void BandMatrix::clear() {
    std::fill(entries_.begin(), entries_.end(), 0.0);
}

void BandMatrix::factor(double smallest_pivot) {
    for (std::size_t i = 0; i < size_; ++i) {
        const std::size_t first = i > width_ ? i - width_ : 0;
        double* const row = &at(i, first);
        for (std::size_t j = first; j < i; ++j) {
            const std::size_t from = std::max(first, j > width_ ? j - width_ : 0);
            const double sum = dot(row + (from - first), &at(j, from), j - from);
            row[j - first] = (row[j - first] - sum) * at(j, j);
        }
        const double diagonal = at(i, i), pivot = diagonal - dot(row, row, i - first);
        // The factor's diagonal is kept as its inverse.
        at(i, i) = 1 / std::sqrt(pivot > smallest_pivot * diagonal ? pivot : diagonal > 0 ? diagonal : 1);
    }
}

void BandMatrix::solve(std::vector<double>& x) const {
    const auto row = [&](std::size_t i, std::size_t first) {
        return entries_.data() + i * (width_ + 1) + first + width_ - i;
    };
    for (std::size_t i = 0; i < size_; ++i) {
        const std::size_t first = i > width_ ? i - width_ : 0;
        const double* const l = row(i, first);
        x[i] = (x[i] - dot(l, x.data() + first, i - first)) * l[i - first];
    }
    for (std::size_t i = size_; i-- > 0;) {
        const std::size_t first = i > width_ ? i - width_ : 0;
        const double* const l = row(i, first);
        x[i] *= l[i - first];
        for (std::size_t j = first; j < i; ++j) {
            x[j] -= l[j - first] * x[i];
        }
    }
}

template <class T>
Banded<T>::Banded(const Body<T>& body, const Lattice& lattice, const Material& material)
    : stiffness_(lattice, material), unit_(body.length_unit() / lattice.cell_size()), number_(body.node_count()),
      values_(3 * body.node_count()) {
    for (std::size_t n = 0; n < body.node_count(); ++n) {
        places_.push_back(static_cast<std::uint32_t>(body.index_of(n)));
    }
    const auto axis = static_cast<std::size_t>(std::max_element(lattice.cells().begin(), lattice.cells().end()) -
                                               lattice.cells().begin());
    const std::vector<std::uint32_t> nodes = lattice.nodes();
    std::vector<std::uint32_t> order(nodes.size());
    std::iota(order.begin(), order.end(), 0u);
    std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return lattice.rest_position(nodes[a])[axis] < lattice.rest_position(nodes[b])[axis];
    });
    for (std::size_t i = 0; i < order.size(); ++i) {
        number_[order[i]] = static_cast<std::uint32_t>(i);
    }
    std::vector<std::size_t> filled;
    for (std::size_t cell = 0; cell < lattice.cell_scales().size(); ++cell) {
        if (lattice.cell_scales()[cell] > 0) {
            filled.push_back(cell);
        }
    }
    std::uint32_t far = 0;
    const SolidCells solid = SolidCells::of(lattice);
    for (std::size_t c = 0; c < solid.cells.size(); ++c) {
        cells_.push_back({solid.cells[c].nodes, unit_ * static_cast<double>(lattice.cell_scales()[filled[c]]),
                          lattice.cell_tissue(filled[c])});
        const auto [low, high] =
            std::minmax_element(solid.cells[c].nodes.begin(), solid.cells[c].nodes.end(),
                                [&](std::uint32_t a, std::uint32_t b) { return number_[a] < number_[b]; });
        far = std::max(far, number_[*high] - number_[*low]);
    }
    matrix_.emplace(values_.size(), 3 * static_cast<std::size_t>(far) + 2);
}

template <class T>
void Banded<T>::update(const Potential<T>& potential) {
    potential_ = &potential;
    matrix_->clear();
    const NodeField<T>& u = potential.displacement();
    const Component<const T> component_of[3] = {component(u, 0), component(u, 1), component(u, 2)};
    const std::span<const std::uint8_t> held = potential.held();
    CellMatrixOf<double> matrix;
    for (const Cell& cell : cells_) {
        double displacement[8][3];
        for (std::size_t a = 0; a < 8; ++a) {
            const auto place = static_cast<std::ptrdiff_t>(places_[cell.nodes[a]]);
            for (std::size_t c = 0; c < 3; ++c) {
                displacement[a][c] = unit_ * static_cast<double>(component_of[c].first[place * component_of[c].stride]);
            }
        }
        stiffness_.evaluate(displacement, cell.scale, cell.tissue, matrix);
        for (std::size_t a = 0; a < 8; ++a) {
            for (std::size_t b = 0; b < 8; ++b) {
                const std::size_t i = 3 * static_cast<std::size_t>(number_[cell.nodes[a]]),
                                  j = 3 * static_cast<std::size_t>(number_[cell.nodes[b]]);
                for (std::size_t e = 0; e < 9 && j <= i; ++e) {
                    const bool free = !(held[cell.nodes[a]] >> (e / 3) & 1) && !(held[cell.nodes[b]] >> (e % 3) & 1);
                    if (free && j + e % 3 <= i + e / 3) {
                        matrix_->at(i + e / 3, j + e % 3) += matrix.block[a][b][e];
                    }
                }
            }
        }
    }
    matrix_->factor(kSmallestPivot);
}

template <class T>
void Banded<T>::apply(const NodeVector<T>& r, NodeVector<T>& z) {
    const auto for_each_value = [&](auto& field, const auto& visit) {
        for (std::size_t c = 0; c < 3; ++c) {
            const auto all = component(field, c);
            for (std::size_t n = 0; n < number_.size(); ++n) {
                const bool free = !(potential_->held()[n] >> c & 1);
                visit(all.first[static_cast<std::ptrdiff_t>(places_[n]) * all.stride], values_[3 * number_[n] + c],
                      free);
            }
        }
    };
    for_each_value(r.field, [](const T& from, double& to, bool free) { to = free ? static_cast<double>(from) : 0; });
    matrix_->solve(values_);
    for_each_value(z.field, [](T& to, const double& from, bool free) { to = free ? static_cast<T>(from) : T(0); });
}

template class Banded<float>;
template class Banded<double>;

bool banded_pays(const Lattice& lattice) {
    std::array<int, 3> cells = lattice.cells();
    std::sort(cells.begin(), cells.end());
    // Across more cells than this the factors take longer than cycles do.
    constexpr int kSlender = 8, kWidest = 4;
    return cells[1] <= kWidest && cells[2] >= kSlender * cells[1];
}

} // namespace hybmss
