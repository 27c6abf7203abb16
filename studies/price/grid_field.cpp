#include "studies/price/reference.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace hybmss::price {
namespace {

using Vector3 = std::array<double, 3>;

GridField empty_field(const std::array<int, 3>& cells, double cell_size) {
    GridField field{cells, cell_size, {}};
    field.values.assign(static_cast<std::size_t>(cells[0] + 1) * static_cast<std::size_t>(cells[1] + 1) *
                            static_cast<std::size_t>(cells[2] + 1),
                        {0, 0, 0});
    return field;
}

/// A node of the finer grid as a coarse cell and the place inside it, from 0 to 1.
struct Place {
    int cell;
    double inside;
};

Place place(int node, int factor, int cells) {
    const int cell = std::min(node / factor, cells - 1);
    return {cell, static_cast<double>(node - cell * factor) / factor};
}

/// Calls f(i, j, k) for every node, in order.
template <class F>
void for_each_node(const std::array<int, 3>& cells, F f) {
    for (int k = 0; k <= cells[2]; ++k) {
        for (int j = 0; j <= cells[1]; ++j) {
            for (int i = 0; i <= cells[0]; ++i) {
                f(i, j, k);
            }
        }
    }
}

/// Where the 20 nodes of an element lie, in [-1, 1]^3, in the order of Abaqus.
constexpr int kNodes[20][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1},  {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1},
                               {-1, 1, 1},   {0, -1, -1}, {1, 0, -1},  {0, 1, -1},  {-1, 0, -1}, {0, -1, 1}, {1, 0, 1},
                               {0, 1, 1},    {-1, 0, 1},  {-1, -1, 0}, {1, -1, 0},  {1, 1, 0},   {-1, 1, 0}};

/// Corners: (1 + x x_i)(1 + y y_i)(1 + z z_i)(x x_i + y y_i + z z_i - 2) / 8; middles of edges along x:
/// (1 - x^2)(1 + y y_i)(1 + z z_i) / 4, and so on.
double shape(const Vector3& x, const int (&node)[3]) {
    double product = 1, sum = -2;
    bool middle = false;
    for (std::size_t a = 0; a < 3; ++a) {
        const double along = x[a] * node[a];
        product *= node[a] == 0 ? 1 - x[a] * x[a] : 1 + along;
        sum += along;
        middle = middle || node[a] == 0;
    }
    return middle ? product / 4 : product * sum / 8;
}

} // namespace

std::size_t GridField::node(int i, int j, int k) const {
    const auto row = static_cast<std::size_t>(cells[0] + 1), plane = row * static_cast<std::size_t>(cells[1] + 1);
    return static_cast<std::size_t>(k) * plane + static_cast<std::size_t>(j) * row + static_cast<std::size_t>(i);
}

GridField GridField::refined(int factor) const {
    GridField fine = empty_field({cells[0] * factor, cells[1] * factor, cells[2] * factor}, cell_size / factor);
    for_each_node(fine.cells, [&](int i, int j, int k) {
        const Place x = place(i, factor, cells[0]), y = place(j, factor, cells[1]), z = place(k, factor, cells[2]);
        Vector3& sum = fine.values[fine.node(i, j, k)];
        for (int corner = 0; corner < 8; ++corner) {
            const int a = corner & 1, b = corner >> 1 & 1, c = corner >> 2 & 1;
            const double weight =
                (a ? x.inside : 1 - x.inside) * (b ? y.inside : 1 - y.inside) * (c ? z.inside : 1 - z.inside);
            const Vector3& value = values[node(x.cell + a, y.cell + b, z.cell + c)];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                sum[axis] += weight * value[axis];
            }
        }
    });
    return fine;
}

GridField GridField::coarsened(int factor) const {
    GridField coarse = empty_field({cells[0] / factor, cells[1] / factor, cells[2] / factor}, cell_size * factor);
    for_each_node(coarse.cells, [&](int i, int j, int k) {
        coarse.values[coarse.node(i, j, k)] = values[node(i * factor, j * factor, k * factor)];
    });
    return coarse;
}

GridField refined_quadratic(const calculix::BrickMesh& mesh, const std::vector<std::array<double, 3>>& displacements,
                            const std::array<int, 3>& cells, int factor) {
    GridField fine = empty_field({cells[0] * factor, cells[1] * factor, cells[2] * factor}, mesh.cell_size / factor);
    const auto nx = static_cast<std::size_t>(cells[0]), ny = static_cast<std::size_t>(cells[1]);
    for_each_node(fine.cells, [&](int i, int j, int k) {
        const Place x = place(i, factor, cells[0]), y = place(j, factor, cells[1]), z = place(k, factor, cells[2]);
        const std::size_t element = (static_cast<std::size_t>(z.cell) * ny + static_cast<std::size_t>(y.cell)) * nx +
                                    static_cast<std::size_t>(x.cell);
        const Vector3 inside = {2 * x.inside - 1, 2 * y.inside - 1, 2 * z.inside - 1};
        Vector3& sum = fine.values[fine.node(i, j, k)];
        for (std::size_t n = 0; n < 20; ++n) {
            const double weight = shape(inside, kNodes[n]);
            const Vector3& value = displacements[mesh.elements[element * 20 + n]];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                sum[axis] += weight * value[axis];
            }
        }
    });
    return fine;
}

FieldError field_error(const GridField& field, const GridField& reference) {
    if (field.cells != reference.cells || field.values.size() != reference.values.size()) {
        throw std::invalid_argument("field_error: two fields on different grids");
    }
    double error = 0, norm = 0;
    const auto add = [&](double weight, double difference, double whole) {
        error += weight * difference * difference;
        norm += weight * whole * whole;
    };
    const std::array<int, 3>& cells = field.cells;
    for_each_node(cells, [&](int i, int j, int k) {
        const auto half = [](int at, int end) { return at == 0 || at == end ? 0.5 : 1.0; };
        const double weight = half(i, cells[0]) * half(j, cells[1]) * half(k, cells[2]);
        const std::size_t n = field.node(i, j, k);
        for (std::size_t a = 0; a < 3; ++a) {
            add(weight, field.values[n][a] - reference.values[n][a], reference.values[n][a]);
        }
    });
    FieldError errors;
    errors.l2 = std::sqrt(error / norm);
    error = norm = 0;
    for (int k = 0; k < cells[2]; ++k) {
        for (int j = 0; j < cells[1]; ++j) {
            for (int i = 0; i < cells[0]; ++i) {
                for (std::size_t axis = 0; axis < 9; ++axis) {
                    const std::size_t a = axis / 3, b = axis % 3;
                    double difference = 0, whole = 0;
                    for (int c = 0; c < 8; ++c) {
                        const std::size_t n = field.node(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1));
                        const double sign = c >> b & 1 ? 1 : -1;
                        difference += sign * (field.values[n][a] - reference.values[n][a]);
                        whole += sign * reference.values[n][a];
                    }
                    add(1, difference, whole);
                }
            }
        }
    }
    errors.h1 = std::sqrt(error / norm);
    return errors;
}

GridField combined(double s, const GridField& a, double t, const GridField& b) {
    GridField result = a;
    for (std::size_t n = 0; n < a.values.size(); ++n) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
            result.values[n][axis] = s * a.values[n][axis] + t * b.values[n][axis];
        }
    }
    return result;
}

} // namespace hybmss::price
