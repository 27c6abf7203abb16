#include "solvers/multigrid/coarse_level.hpp"

#include "kernels/grid_arguments.hpp"
#include "solvers/newton/preconditioner.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <functional>

namespace hybmss {
namespace {

/// The node itself, as one of its 27 neighbours: 0 is (-1, -1, -1).
constexpr std::size_t kSelf = 13;
/// The neighbour b of a in a cell, as one of 27.
std::size_t neighbour(std::size_t a, std::size_t b) {
    const auto step = [&](std::size_t axis) { return 1 + (b >> axis & 1) - (a >> axis & 1); };
    return step(0) + 3 * (step(1) + 3 * step(2));
}

constexpr std::size_t kStencilEntries = 14 * 9;
/// An odd number of cache lines: entries of a node then fall into sets of the first cache of their own.
std::size_t stencil_stride(const PaddedGrid& grid) {
    const std::size_t stride = padded(grid.size() + kPadding);
    return stride / kPadding % 2 == 1 ? stride : stride + kPadding;
}

/// See CellRotations::invert().
constexpr double kSmallestTurn = 1e-4;

float sign(std::size_t corner, std::size_t axis) {
    return corner >> axis & 1 ? 1.0f : -1.0f;
}

} // namespace

CoarseLevel::CoarseLevel(const PaddedGrid& grid, bool rotations, const Body<float>& body, const Ranks* ranks)
    : right_side(grid), solution(grid), rest(grid), grid_(grid), ranks_(ranks), workers_(&body.workers()),
      table_(&body.kernel_table()), stride_(stencil_stride(grid)), first_(grid.index(0, 0, 0)),
      stencil_(kStencilEntries * stride_ + 2 * kPadding),
      gradients_(grid), vectors_{GridVector(grid), GridVector(grid), GridVector(grid)} {
    for (auto& values : inverse_) {
        values.assign(grid.size() + kBeyond, 0.0f);
    }
    if (ranks_) {
        shared_.emplace(grid_, *ranks_, [](std::size_t) { return true; });
    }
    if (rotations) {
        rotations_.emplace(gradients_, *table_, shared());
    }
}

void CoarseLevel::add(std::size_t low, const CellMatrices& matrices, std::size_t count) {
    const auto add_block = [&](std::size_t a, std::size_t b, std::size_t e, const float* entry) {
        float* to = entries(9 * (neighbour(a, b) - kSelf) + e) + low + grid_.corner_offset(a);
        if (count == kCellsTogether) {
            for (std::size_t lane = 0; lane < kCellsTogether; ++lane) {
                to[lane] += entry[lane];
            }
        } else {
            for (std::size_t lane = 0; lane < count; ++lane) {
                to[lane] += entry[lane];
            }
        }
    };
    // Of two corners the second has the larger number: it is the neighbour that comes after, but for a few.
    for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
        for (std::size_t e = 0; e < 9; ++e) {
            if (neighbour(a, b) >= kSelf) {
                add_block(a, b, e, matrices.block[pair][e]);
            } else {
                add_block(b, a, 3 * (e % 3) + e / 3, matrices.block[pair][e]);
            }
        }
    });
}

void CoarseLevel::invert() {
    constexpr std::size_t kDiagonal[6] = {0, 1, 2, 4, 5, 8};
    for (std::size_t e = 0; shared_ && e < 6; ++e) {
        std::copy_n(entries(kDiagonal[e]), grid_.size(), inverse_[e].data());
    }
    if (shared_) {
        shared_->add_up(inverse_);
    }
    run(static_cast<std::size_t>(grid_.cells[2] + 1), [&](std::size_t k) {
        const int z = static_cast<int>(k);
        for_each_place({0, 0, z}, {grid_.cells[0], grid_.cells[1], z}, [&](int i, int j, int) {
            const std::size_t node = grid_.index(i, j, z);
            const auto entry = [&](std::size_t e) {
                return static_cast<double>(shared_ ? inverse_[e][node] : entries(kDiagonal[e])[node]);
            };
            const auto inverse =
                bounded_inverse({entry(0), entry(1), entry(2), entry(3), entry(4), entry(5)}, 0, 1e-5, 0);
            for (std::size_t e = 0; e < 6; ++e) {
                inverse_[e][node] = static_cast<float>(inverse[e]);
            }
        });
    });
    if (rotations_) {
        gradients_.spread();
        invert_rotations();
        rotations_->finish(kSmallestTurn);
    }
}

// C^T K C = sum over corners a, b of [s_a]^T F^T K_ab F [s_b],  [s] w = w x s
void CoarseLevel::invert_rotations() {
    run(static_cast<std::size_t>(grid_.cells[2] + 2), [&](std::size_t layer) {
        const int k = static_cast<int>(layer) - 1;
        for_each_lanes(grid_, k, [&](std::size_t cell, std::size_t count) {
            Lanes turns[8][9];
            for (std::size_t c = 0; c < 3; ++c) {
                Lanes F[3];
                for (std::size_t e = 0; e < 3; ++e) {
                    F[e] = load_lanes_at(gradients_.entries()[3 * c + e].data() + cell);
                }
                for (std::size_t a = 0; a < 8; ++a) {
                    // Columns F (e_i x s)
                    const float x = sign(a, 0), y = sign(a, 1), z = sign(a, 2);
                    turns[a][3 * c] = F[2] * y - F[1] * z;
                    turns[a][3 * c + 1] = F[0] * z - F[2] * x;
                    turns[a][3 * c + 2] = F[1] * x - F[0] * y;
                }
            }
            Lanes stiffness[6] = {};
            for (std::size_t a = 0; a < 8; ++a) {
                const std::size_t node = cell + grid_.corner_offset(a);
                Lanes force[9] = {};
                for (std::size_t b = 0; b < 8; ++b) {
                    const std::size_t way = neighbour(a, b);
                    const float* from = way >= kSelf ? entries(9 * (way - kSelf)) + node
                                                     : entries(9 * (kSelf - way)) + cell + grid_.corner_offset(b);
                    for (std::size_t e = 0; e < 9; ++e) {
                        const Lanes entry = load_lanes_at(from + e * stride_);
                        const std::size_t to = way >= kSelf ? e / 3 : e % 3, of = way >= kSelf ? e % 3 : e / 3;
                        for (std::size_t turn = 0; turn < 3; ++turn) {
                            force[3 * to + turn] += entry * turns[b][3 * of + turn];
                        }
                    }
                }
                for (std::size_t c = 0; c < 3; ++c) {
                    std::size_t entry = 0;
                    for (std::size_t p = 0; p < 3; ++p) {
                        for (std::size_t q = p; q < 3; ++q) {
                            stiffness[entry++] += turns[a][3 * c + p] * force[3 * c + q];
                        }
                    }
                }
            }
            rotations_->invert(cell, count, stiffness, kSmallestTurn);
        });
    });
}

void CoarseLevel::apply_stencil(const GridVector& p, const GridVector* from, GridVector& out) const {
    kernels::GridStencil<float> stencil;
    stencil.entries = entries(0);
    stencil.stride = static_cast<std::ptrdiff_t>(stride_);
    for (std::size_t way = 0; way < 13; ++way) {
        const std::size_t s = way + kSelf + 1;
        stencil.ahead[way] = static_cast<std::ptrdiff_t>(s % 3 + grid_.row() * (s / 3 % 3) + grid_.plane() * (s / 9)) -
                             static_cast<std::ptrdiff_t>(1 + grid_.row() + grid_.plane());
    }
    for (std::size_t c = 0; c < 3; ++c) {
        stencil.in[c] = p.c[c].data();
        stencil.from[c] = from ? from->c[c].data() : nullptr;
        stencil.out[c] = out.c[c].data();
    }
    const auto kernel = table_->grid_stencil(from != nullptr);
    // Nodes of the border between them too: corrections by rotations reach them, and would see there what came before.
    for_each_piece(first_, grid_.index(grid_.cells[0], grid_.cells[1], grid_.cells[2]) + 1,
                   [&](kernels::Range begin, kernels::Range end) { kernel(stencil, begin, end); });
}

void CoarseLevel::multiply(const GridVector& p, GridVector& out) {
    apply_stencil(p, nullptr, out);
    if (shared_) {
        shared_->add_up(out.c);
    }
}

double CoarseLevel::norm(const GridVector& vector) const {
    const auto square_of = [](const GridVector& v) {
        double sum = 0;
        for (const auto& array : v.c) {
            for (float value : array) {
                sum += static_cast<double>(value) * static_cast<double>(value);
            }
        }
        return sum;
    };
    if (!shared_) {
        return std::sqrt(square_of(vector));
    }
    GridVector once = vector;
    shared_->clear_counted_elsewhere(once);
    return std::sqrt(ranks_->sum(square_of(once)));
}

void CoarseLevel::pass_blocks(kernels::BlockUse use, const GridVector& from, double keep, double add, GridVector& r,
                              GridVector& d, GridVector& x) const {
    kernels::NodeBlocks<float> nodes{};
    for (std::size_t e = 0; e < 6; ++e) {
        nodes.inverse[e] = inverse_[e].data();
    }
    for (std::size_t c = 0; c < 3; ++c) {
        nodes.from[c] = from.c[c].data();
        nodes.product[c] = vectors_.scratch.c[c].data();
        nodes.rest[c] = r.c[c].data();
        nodes.direction[c] = d.c[c].data();
        nodes.solution[c] = x.c[c].data();
    }
    nodes.keep = static_cast<float>(keep);
    nodes.add = static_cast<float>(add);
    const auto kernel = table_->node_blocks(use, false);
    for_each_piece(0, grid_.size(), [&](kernels::Range begin, kernels::Range end) { kernel(nodes, begin, end); });
}

void CoarseLevel::precondition(const GridVector& r, GridVector& z) {
    pass_blocks(kernels::BlockUse::multiply, r, 0, 0, z, z, z);
    if (rotations_ && !shared_) {
        rotations_->add_correction(r, z, *workers_);
    } else if (rotations_) {
        GridVector turned(grid_);
        rotations_->add_correction(r, turned, *workers_);
        shared_->add_up(turned.c);
        for (std::size_t c = 0; c < 3; ++c) {
            std::transform(z.c[c].begin(), z.c[c].end(), turned.c[c].begin(), z.c[c].begin(), std::plus<float>());
        }
    }
}

void CoarseLevel::correct(const GridVector& from, const GridVector* product, double keep, double add,
                          ChebyshevVectors<GridVector>& vectors, GridVector& x) {
    auto& [r, d, z] = vectors;
    if (!rotations_) {
        const auto use = !product    ? kernels::BlockUse::first
                         : keep == 0 ? kernels::BlockUse::restart
                                     : kernels::BlockUse::next;
        pass_blocks(use, from, keep, add, r, d, x);
        return;
    }
    const auto pass = [&](const auto& map) {
        for_each_piece(0, grid_.size(), [&](kernels::Range begin, kernels::Range end) {
            for (std::size_t c = 0; c < 3; ++c) {
                map(c, begin, end);
            }
        });
    };
    pass([&, &left = r](std::size_t c, kernels::Range begin, kernels::Range end) {
        const float *b = from.c[c].data(), *p = product ? product->c[c].data() : nullptr;
        float* to = left.c[c].data();
        for (kernels::Range n = begin; n < end; ++n) {
            to[n] = p ? b[n] - p[n] : b[n];
        }
    });
    precondition(r, z);
    pass([&, k = static_cast<float>(keep), a = static_cast<float>(add), &steps = d,
          &by = z](std::size_t c, kernels::Range begin, kernels::Range end) {
        const float* z_of = by.c[c].data();
        float *step = steps.c[c].data(), *to = x.c[c].data();
        for (kernels::Range n = begin; n < end; ++n) {
            step[n] = k == 0 ? a * z_of[n] : k * step[n] + a * z_of[n];
            to[n] = product ? to[n] + step[n] : step[n];
        }
    });
}

void CoarseLevel::estimate_spectrum() {
    GridVector &x = vectors_.direction, &y = vectors_.residual;
    x.clear();
    unsigned state = 1;
    for_each_place({0, 0, 0}, grid_.cells, [&](int i, int j, int k) {
        for (auto& array : x.c) {
            state = state * 1664525u + 1013904223u;
            array[grid_.index(i, j, k)] = static_cast<float>(state >> 8) / 8388608.0f - 1.0f;
        }
    });
    if (shared_) {
        shared_->add_up(x.c);
    }
    double size = 0;
    double before = norm(x);
    for (int iteration = 0; iteration < 6 && before > 0; ++iteration) {
        multiply(x, y);
        precondition(y, x);
        const double after = norm(x);
        size = after / before;
        const auto scale = static_cast<float>(after > 0 ? 1 / after : 0);
        for (auto& array : x.c) {
            for (float& value : array) {
                value *= scale;
            }
        }
        before = after > 0 ? 1 : 0;
    }
    highest_ = size > 0 ? 1.3 * size : 1;
}

void CoarseLevel::smooth(bool from_zero, const GridVector& b, GridVector& x, int degree, double low_part) {
    chebyshev(*this, {degree, low_part * highest_, highest_}, from_zero, b, x, vectors_);
}

void CoarseLevel::residual(const GridVector& b, const GridVector& x, GridVector& r) {
    if (!shared_) {
        return apply_stencil(x, &b, r);
    }
    multiply(x, r);
    for (std::size_t c = 0; c < 3; ++c) {
        std::transform(b.c[c].begin(), b.c[c].end(), r.c[c].begin(), r.c[c].begin(), std::minus<float>());
    }
}

struct DirectLevel::Factors {
    Eigen::MatrixXd matrix;
    Eigen::LLT<Eigen::MatrixXd> decomposition;
    Eigen::VectorXd values;
};

DirectLevel::DirectLevel(const PaddedGrid& grid, const RankBox& box, const Ranks* ranks)
    : right_side(grid), solution(grid), grid_(grid), box_(box), ranks_(ranks), gradients_(grid),
      factors_(std::make_unique<Factors>()) {
    const auto size = static_cast<Eigen::Index>(3 * PaddedGrid{box.whole}.node_count());
    factors_->matrix.resize(size, size);
    factors_->values.resize(size);
}
DirectLevel::~DirectLevel() = default;

void DirectLevel::clear() {
    factors_->matrix.setZero();
}

std::ptrdiff_t DirectLevel::unknown(int i, int j, int k) const {
    const std::ptrdiff_t row = box_.whole[0] + 1, plane = row * (box_.whole[1] + 1);
    return 3 * (box_.first[0] + i + row * (box_.first[1] + j) + plane * (box_.first[2] + k));
}

void DirectLevel::add(int i, int j, int k, const CellMatrices& matrices, std::size_t count) {
    for (std::size_t lane = 0; lane < count; ++lane) {
        const auto first = [&](std::size_t corner) {
            const auto c = static_cast<int>(corner);
            return unknown(i + static_cast<int>(lane) + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
        };
        for_each_corner_pair([&](std::size_t pair, std::size_t a, std::size_t b) {
            for (int e = 0; e < 9; ++e) {
                const auto entry = static_cast<double>(matrices.block[pair][e][lane]);
                factors_->matrix(first(a) + e / 3, first(b) + e % 3) += entry;
                if (a != b) {
                    factors_->matrix(first(b) + e % 3, first(a) + e / 3) += entry;
                }
            }
        });
    }
}

void DirectLevel::factor() {
    Eigen::MatrixXd& matrix = factors_->matrix;
    if (ranks_) {
        ranks_->sum(std::span<double>(matrix.data(), static_cast<std::size_t>(matrix.size())));
    }
    // Rigid motions that nothing holds, and nodes that no free node depends on, would be singular.
    constexpr double kShift = 1e-6;
    for (Eigen::Index d = 0; d < matrix.rows(); ++d) {
        matrix(d, d) = matrix(d, d) > 0 ? (1 + kShift) * matrix(d, d) : 1;
    }
    factors_->decomposition.compute(matrix);
}

void DirectLevel::solve(const GridVector& b, GridVector& x) {
    Eigen::VectorXd& values = factors_->values;
    values.setZero();
    for_each_place({0, 0, 0}, grid_.cells, [&](int i, int j, int k) {
        for (std::size_t c = 0; c < 3; ++c) {
            values[unknown(i, j, k) + static_cast<int>(c)] = static_cast<double>(b.c[c][grid_.index(i, j, k)]);
        }
    });
    if (ranks_) {
        ranks_->sum(std::span<double>(values.data(), static_cast<std::size_t>(values.size())));
    }
    factors_->decomposition.solveInPlace(values);
    for_each_place({0, 0, 0}, grid_.cells, [&](int i, int j, int k) {
        for (std::size_t c = 0; c < 3; ++c) {
            x.c[c][grid_.index(i, j, k)] = static_cast<float>(values[unknown(i, j, k) + static_cast<int>(c)]);
        }
    });
}

} // namespace hybmss
