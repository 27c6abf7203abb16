#include "solvers/multigrid/cell_stiffness.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace hybmss {
namespace {

double side(unsigned corner, unsigned axis) {
    return corner >> axis & 1u ? 1.0 : -1.0;
}

void cross(const double* a, const double* b, double* out) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/// v . M v
template <class S>
double quadratic_form(const CellMatrixOf<S>& matrix, const double (&v)[8][3]) {
    double sum = 0;
    for (std::size_t a = 0; a < 8; ++a) {
        for (std::size_t b = 0; b < 8; ++b) {
            for (std::size_t i = 0; i < 9; ++i) {
                sum += v[a][i / 3] * v[b][i % 3] * static_cast<double>(matrix.block[a][b][i]);
            }
        }
    }
    return sum;
}

/// K - c g g^T is positive semidefinite up to c = 1 / (g . K^+ g); with the dilation v, K v is along g at rest, and the
/// bound is v . K v / (g . v)^2.
template <class S>
S convex_bound(S of_dilation, S along) {
    constexpr S kMargin = S(0.9);
    return along * along > S(1e-6) ? kMargin * of_dilation / (along * along) : 0;
}

/// phi''(J) of a volume energy at J = 1 + j; see VolumeEnergy.
double volume_curvature(VolumeEnergy energy, double j) {
    if (energy == VolumeEnergy::quadratic) {
        return 1;
    }
    if (energy != VolumeEnergy::mean_stretch) {
        return 0;
    }
    if (j < -7.0 / 8.0) {
        return 0;
    }
    const double c = std::cbrt(1 + j), c2 = c * c;
    return (2 - c) / (c2 * c2 * c);
}

} // namespace

CellStiffness::CellStiffness(const Lattice& lattice, const Material& material)
    : means_(material.springs == SpringForm::means), patterns_(pattern_constants(material, lattice.cell_size())),
      crush_(crush_modulus(material) * lattice.cell_size() * lattice.cell_size()), crush_ratio_(material.crush.ratio) {
    const double h = lattice.cell_size();
    for (std::size_t tissue = 0; tissue <= lattice.tissues().size(); ++tissue) {
        const Material own = material_of(lattice, tissue, material);
        volumes_.push_back({volume_modulus(own) * h * h, resolved_volume_energy(own),
                            static_cast<float>(own.density / material.density)});
    }
    const SpringConstants k = spring_constants(material, h);
    share_[0] = 0;
    share_[1] = means_ ? 0 : k.edge / 4 * h;
    share_[2] = means_ ? 0 : k.face_diagonal / 2 * h;
    share_[3] = means_ ? 0 : k.cube_diagonal * h;
    on_means_[0] = 0;
    on_means_[1] = k.edge * h;
    on_means_[2] = k.face_diagonal * h;
    on_means_[3] = k.cube_diagonal * h;
    for (double* constant : {&patterns_.bending, &patterns_.twist, &patterns_.joint_twist, &patterns_.fourth}) {
        *constant *= h;
    }
}

// k [t+ I + min(1 - t, 1) n n^T],  t = 1 - l/|d|. Between two corners there is one spring, so blocks off the diagonal
// are set and only those on it are sums.
template <class S>
void CellStiffness::set_springs(const double (&u)[8][3], double scale, CellMatrixOf<S>& matrix) const {
    constexpr S kLength[4] = {0, 1, std::numbers::sqrt2_v<S>, std::numbers::sqrt3_v<S>};
    S at[8][3], diagonal[8][9] = {};
    for (unsigned a = 0; a < 8; ++a) {
        for (unsigned c = 0; c < 3; ++c) {
            at[a][c] = static_cast<S>(0.5 * side(a, c) + u[a][c]);
        }
    }
    for (unsigned a = 0; a < 8; ++a) {
        for (unsigned b = a + 1; b < 8; ++b) {
            const auto axes = static_cast<std::size_t>(std::popcount(a ^ b));
            const S d[3] = {at[b][0] - at[a][0], at[b][1] - at[a][1], at[b][2] - at[a][2]};
            const S square = std::max(d[0] * d[0] + d[1] * d[1] + d[2] * d[2], S(1e-6f));
            const S t = 1 - kLength[axes] / std::sqrt(square);
            const auto k = static_cast<S>(scale * share_[axes]);
            const S across = k * std::max(t, S(0)), along = k * std::min(1 - t, S(1)) / square;
            S entry[9];
            for (std::size_t e = 0; e < 9; ++e) {
                entry[e] = along * d[e / 3] * d[e % 3] + (e % 4 == 0 ? across : S(0));
            }
            for (std::size_t e = 0; e < 9; ++e) {
                matrix.block[a][b][e] = -entry[e];
                matrix.block[b][a][e] = -entry[e];
                diagonal[a][e] += entry[e];
                diagonal[b][e] += entry[e];
            }
        }
    }
    for (std::size_t a = 0; a < 8; ++a) {
        std::copy_n(diagonal[a], 9, matrix.block[a][a]);
    }
    if (means_) {
        add_mean_springs(u, scale, matrix);
    }
}

// A spring on means moves by weights of the corners, and so does P_ij = g_i . a_j (PatternConstants); of its energy
// what is quadratic in dP is kept, which no strain makes indefinite.
template <class S>
void CellStiffness::add_mean_springs(const double (&u)[8][3], double scale, CellMatrixOf<S>& matrix) const {
    double edges[3][3], patterns[3][3], by_edge[8][3], by_pattern[8][3];
    for (unsigned i = 0; i < 3; ++i) {
        for (unsigned corner = 0; corner < 8; ++corner) {
            by_edge[corner][i] = side(corner, i) / 4;
            by_pattern[corner][i] = side(corner, (i + 1) % 3) * side(corner, (i + 2) % 3) / 8;
        }
        for (unsigned c = 0; c < 3; ++c) {
            edges[i][c] = i == c ? 1 : 0;
            patterns[i][c] = 0;
            for (unsigned corner = 0; corner < 8; ++corner) {
                edges[i][c] += by_edge[corner][i] * u[corner][c];
                patterns[i][c] += by_pattern[corner][i] * u[corner][c];
            }
        }
    }
    const auto add = [&](std::size_t a, std::size_t b, std::size_t entry, double value) {
        matrix.block[a][b][entry] += static_cast<S>(scale * value);
    };
    for (int code = 14; code < 27; ++code) { // one of each direction and its opposite
        const int sign[3] = {code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1};
        const int axes = sign[0] * sign[0] + sign[1] * sign[1] + sign[2] * sign[2];
        if (on_means_[axes] == 0) {
            continue;
        }
        double d[3], weight[8];
        for (unsigned c = 0; c < 3; ++c) {
            d[c] = sign[0] * edges[0][c] + sign[1] * edges[1][c] + sign[2] * edges[2][c];
        }
        for (unsigned corner = 0; corner < 8; ++corner) {
            weight[corner] = sign[0] * by_edge[corner][0] + sign[1] * by_edge[corner][1] + sign[2] * by_edge[corner][2];
        }
        const double square = std::max(d[0] * d[0] + d[1] * d[1] + d[2] * d[2], 1e-6);
        const double t = 1 - std::sqrt(axes / square), k = on_means_[axes];
        const double across = k * std::max(t, 0.0), along = k * std::min(1 - t, 1.0) / square;
        for (std::size_t e = 0; e < 9; ++e) {
            const double entry = along * d[e / 3] * d[e % 3] + (e % 4 == 0 ? across : 0.0);
            for (std::size_t a = 0; a < 8; ++a) {
                for (std::size_t b = 0; b < 8; ++b) {
                    add(a, b, e, weight[a] * weight[b] * entry);
                }
            }
        }
    }
    using Slope = std::array<double, 24>;
    const auto add_slope = [&](std::size_t i, std::size_t j, double factor, Slope& sum) {
        for (std::size_t corner = 0; corner < 8; ++corner) {
            for (std::size_t c = 0; c < 3; ++c) {
                sum[3 * corner + c] +=
                    factor * (by_pattern[corner][i] * edges[j][c] + by_edge[corner][j] * patterns[i][c]);
            }
        }
    };
    const auto add_square = [&](double k, const Slope& s) {
        for (std::size_t a = 0; a < 8; ++a) {
            for (std::size_t b = 0; b < 8; ++b) {
                for (std::size_t e = 0; e < 9; ++e) {
                    add(a, b, e, k * s[3 * a + e / 3] * s[3 * b + e % 3]);
                }
            }
        }
    };
    Slope together{};
    for (std::size_t i = 0; i < 3; ++i) {
        Slope own{};
        add_slope(i, i, 1, own);
        add_square(patterns_.twist, own);
        add_slope(i, i, 1, together);
        for (std::size_t j = 0; j < i; ++j) {
            // p^2 + q^2 + 2 c p q = (1 + c)/2 (p + q)^2 + (1 - c)/2 (p - q)^2
            for (const double sign : {1.0, -1.0}) {
                Slope pair{};
                add_slope(i, j, 1, pair);
                add_slope(j, i, sign, pair);
                add_square(patterns_.bending * (1 + sign * patterns_.coupling) / 2, pair);
            }
        }
    }
    add_square(patterns_.joint_twist, together);
    for (unsigned a = 0; a < 8; ++a) {
        for (unsigned b = 0; b < 8; ++b) {
            const double of_both = std::popcount(a ^ b) % 2 == 0 ? 1.0 / 64 : -1.0 / 64;
            for (const std::size_t e : {0u, 4u, 8u}) {
                add(a, b, e, of_both * patterns_.fourth);
            }
        }
    }
}

std::size_t spring_direction(std::size_t a, std::size_t b) {
    std::size_t code = 0;
    for (const std::size_t axis : {2u, 1u, 0u}) {
        code = 3 * code + 1 + (b >> axis & 1) - (a >> axis & 1);
    }
    return code > 13 ? code - 14 : 12 - code;
}

std::array<float, 3> spring_signs(std::size_t direction) {
    const std::size_t code = direction + 14;
    return {static_cast<float>(code % 3) - 1, static_cast<float>(code / 3 % 3) - 1, static_cast<float>(code / 9) - 1};
}

Lanes CellStiffness::evaluate_volume(const Lanes (&F)[9], const Lanes& scale, const std::uint8_t* tissue,
                                     Lanes (&area)[9]) const {
    for (std::size_t e = 0; e < 3; ++e) {
        const std::size_t f = (e + 1) % 3, g = (e + 2) % 3;
        for (std::size_t c = 0; c < 3; ++c) {
            const std::size_t d = (c + 1) % 3, h = (c + 2) % 3;
            area[3 * e + c] = F[3 * d + f] * F[3 * h + g] - F[3 * h + f] * F[3 * d + g];
        }
    }
    const Lanes volume = F[0] * area[0] + F[3] * area[1] + F[6] * area[2];
    Lanes stiffness{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const auto ratio = static_cast<double>(volume[lane]);
        const double crushed = 2 * crush_ * std::max(crush_ratio_ - ratio, 0.0);
        const Volume& own = volumes_[tissue[lane]];
        stiffness[lane] = static_cast<float>(own.kappa * volume_curvature(own.energy, ratio - 1) + crushed);
    }
    return scale * stiffness;
}

void CellStiffness::evaluate(const Lanes (&F)[9], const Lanes& scale, const std::uint8_t* tissue,
                             CellTangents& tangents) const {
    Lanes along_dilation{}; // v . K v with the dilation v of the cell: sum over its springs of d . A d
    for (std::size_t n = 0; n < kSpringDirections; ++n) {
        const std::array<float, 3> s = spring_signs(n);
        const auto axes = static_cast<std::size_t>(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
        Lanes d[3], square{}, across, along;
        for (std::size_t c = 0; c < 3; ++c) {
            d[c] = s[0] * F[3 * c] + s[1] * F[3 * c + 1] + s[2] * F[3 * c + 2];
            square += d[c] * d[c];
        }
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const float bounded = std::max(square[lane], 1e-6f);
            const float t = 1 - std::sqrt(static_cast<float>(axes) / bounded);
            across[lane] = std::max(t, 0.0f);
            along[lane] = std::min(1 - t, 1.0f) / bounded;
        }
        const Lanes k = static_cast<float>(means_ ? on_means_[axes] : share_[axes]) * scale;
        across *= k;
        along *= k;
        std::size_t entry = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = i; j < 3; ++j) {
                tangents.spring[n][entry++] = i == j ? along * d[i] * d[j] + across : along * d[i] * d[j];
            }
        }
        const float springs = means_ || axes == 3 ? 1.0f : axes == 2 ? 2.0f : 4.0f; // along the same direction
        along_dilation += springs * (along * square + across) * square;
    }
    tangents.has_patterns = means_;
    if (means_) {
        evaluate_patterns(F, scale, tangents);
    }
    tangents.volume_stiffness = evaluate_volume(F, scale, tissue, tangents.area);
    tangents.has_volume = false;
    const Lanes volume = F[0] * tangents.area[0] + F[3] * tangents.area[1] + F[6] * tangents.area[2];
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
        const float stiffness = tangents.volume_stiffness[lane];
        if (stiffness < 0) {
            tangents.volume_stiffness[lane] =
                std::max(stiffness, -convex_bound(along_dilation[lane], 3 * volume[lane]));
        }
        tangents.has_volume = tangents.has_volume || stiffness != 0;
    }
}

// With g = 0, P_ij changes by dg_i . a_j alone: what is quadratic in these is all there is.
void CellStiffness::evaluate_patterns(const Lanes (&F)[9], const Lanes& scale, CellTangents& tangents) const {
    const auto bending = static_cast<float>(patterns_.bending), coupling = static_cast<float>(patterns_.coupling);
    const auto twist = static_cast<float>(patterns_.twist), together = static_cast<float>(patterns_.joint_twist);
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t k = 0; k < 3; ++k) {
            for (std::size_t c = 0; c < 3; ++c) {
                for (std::size_t d = 0; d < 3; ++d) {
                    Lanes sum = together * F[3 * c + i] * F[3 * d + k];
                    if (i != k) {
                        sum += bending * coupling * F[3 * c + k] * F[3 * d + i];
                    }
                    for (std::size_t j = 0; i == k && j < 3; ++j) {
                        sum += (j == i ? twist : bending) * F[3 * c + j] * F[3 * d + j];
                    }
                    tangents.patterns[i][k][3 * c + d] = scale * sum;
                }
            }
        }
    }
    tangents.fourth = static_cast<float>(patterns_.fourth) * scale;
}

void CellStiffness::springs_at_rest(CellMatrix& matrix) const {
    set_springs({}, 1, matrix);
}

template <class S>
void CellStiffness::evaluate(const double (&u)[8][3], double scale, std::size_t tissue, CellMatrixOf<S>& matrix) const {
    set_springs(u, scale, matrix);
    double edges[9]; // a, b, c
    for (unsigned e = 0; e < 3; ++e) {
        for (unsigned c = 0; c < 3; ++c) {
            double change = 0;
            for (unsigned corner = 0; corner < 8; ++corner) {
                change += side(corner, e) / 4 * u[corner][c];
            }
            edges[3 * e + c] = change + (e == c ? 1 : 0);
        }
    }
    double area[9];
    for (std::size_t e = 0; e < 3; ++e) {
        cross(edges + 3 * ((e + 1) % 3), edges + 3 * ((e + 2) % 3), area + 3 * e);
    }
    const Volume& own = volumes_[tissue];
    if ((own.energy == VolumeEnergy::none || own.kappa == 0) && crush_ == 0) {
        return;
    }
    const double volume = edges[0] * area[0] + edges[1] * area[1] + edges[2] * area[2];
    const double crushed = 2 * crush_ * std::max(crush_ratio_ - volume, 0.0);
    double stiffness = scale * (own.kappa * volume_curvature(own.energy, volume - 1) + crushed);
    if (stiffness == 0) {
        return;
    }
    double g[8][3];
    for (unsigned corner = 0; corner < 8; ++corner) {
        for (unsigned c = 0; c < 3; ++c) {
            g[corner][c] =
                (side(corner, 0) * area[c] + side(corner, 1) * area[3 + c] + side(corner, 2) * area[6 + c]) / 4;
        }
    }
    if (stiffness < 0) {
        double v[8][3], along = 0;
        for (unsigned corner = 0; corner < 8; ++corner) {
            for (unsigned c = 0; c < 3; ++c) {
                v[corner][c] = 0.5 * (side(corner, 0) * edges[c] + side(corner, 1) * edges[3 + c] +
                                      side(corner, 2) * edges[6 + c]);
                along += g[corner][c] * v[corner][c];
            }
        }
        stiffness = std::max(stiffness, -convex_bound(quadratic_form(matrix, v), along));
    }
    for (std::size_t a = 0; a < 8; ++a) {
        for (std::size_t b = 0; b < 8; ++b) {
            for (std::size_t i = 0; i < 9; ++i) {
                matrix.block[a][b][i] += static_cast<S>(stiffness * g[a][i / 3] * g[b][i % 3]);
            }
        }
    }
}

template void CellStiffness::evaluate(const double (&)[8][3], double, std::size_t, CellMatrixOf<float>&) const;
template void CellStiffness::evaluate(const double (&)[8][3], double, std::size_t, CellMatrixOf<double>&) const;

void spread_half(CellMatrix& matrix, unsigned axis, bool high) {
    const std::size_t bit = std::size_t{1} << axis;
    // The corner whose value is spread in halves over both, and the one that keeps its own.
    const auto spread = [bit, high](std::size_t corner) { return high ? corner & ~bit : corner | bit; };
    for (std::size_t corner = 0; corner < 8; ++corner) {
        if (corner & bit) {
            continue;
        }
        const std::size_t s = spread(corner), keep = s ^ bit;
        float* from = &matrix.block[s][0][0];
        float* to = &matrix.block[keep][0][0];
        for (std::size_t i = 0; i < 72; ++i) {
            from[i] *= 0.5f;
            to[i] += from[i];
        }
    }
    for (auto& row : matrix.block) {
        for (std::size_t corner = 0; corner < 8; ++corner) {
            if (corner & bit) {
                continue;
            }
            const std::size_t s = spread(corner), keep = s ^ bit;
            for (std::size_t i = 0; i < 9; ++i) {
                row[s][i] *= 0.5f;
                row[keep][i] += row[s][i];
            }
        }
    }
}

void add(const CellMatrix& term, CellMatrix& sum) {
    const float* from = &term.block[0][0][0];
    float* to = &sum.block[0][0][0];
    for (std::size_t i = 0; i < 576; ++i) {
        to[i] += from[i];
    }
}

} // namespace hybmss
