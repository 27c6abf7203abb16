#pragma once

#include "solvers/multigrid/multigrid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace hybmss {

/// The finest level as chebyshev() sees it.
template <class T>
struct Multigrid<T>::FineLevel {
    FineLevel(Multigrid& owner, const VectorSpace<T>& vectors)
        : multigrid(&owner), space(&vectors), residual(vectors.make()),
          guess(vectors.make()), chebyshev{vectors.make(), vectors.make(), vectors.make()} {
        for (std::size_t n = 0; n < owner.node_at_.size(); ++n) {
            if (const std::uint32_t node = owner.node_at_[n]; node != Multigrid::kNoNode) {
                Node entry{n, {}};
                const std::size_t place = owner.places_[node];
                for (std::size_t c = 0; c < 3; ++c) {
                    const Component<const T> all = component(std::as_const(residual.field), c);
                    entry.places[c] = place * static_cast<std::size_t>(all.stride);
                }
                nodes.push_back(entry);
            }
        }
    }

    void multiply(const NodeVector<T>& p, NodeVector<T>& out) { potential->multiply(p, out); }
    void precondition(const NodeVector<T>& r, NodeVector<T>& z) {
        multigrid->blocks_.apply(r, z);
        if (multigrid->rotations_) {
            gather(r, multigrid->grid_in_);
            multigrid->grid_out_.clear();
            multigrid->rotations_->add_correction(multigrid->grid_in_, multigrid->grid_out_, *multigrid->workers_);
            scatter_add(multigrid->grid_out_, z);
        }
    }
    template <class Map, class... Vectors>
    void for_each(const Map& map, Vectors&... vectors) const {
        space->for_each(map, vectors...);
    }

    static constexpr std::size_t kPiece = 4096;
    template <class Visit>
    void for_each_node(const Visit& visit) const {
        multigrid->workers_->run((nodes.size() + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
            for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, nodes.size()); ++n) {
                visit(nodes[n]);
            }
        });
    }
    void gather(const NodeVector<T>& from, GridVector& to) const {
        const T* x[3];
        for (std::size_t c = 0; c < 3; ++c) {
            x[c] = component(from.field, c).first;
        }
        for_each_node([&](const Node& node) {
            for (std::size_t c = 0; c < 3; ++c) {
                to.c[c][node.grid] = static_cast<float>(x[c][node.places[c]]);
            }
        });
    }
    /// to += from on free components.
    void scatter_add(const GridVector& from, NodeVector<T>& to) const {
        T* x[3];
        const T* free[3];
        for (std::size_t c = 0; c < 3; ++c) {
            x[c] = component(to.field, c).first;
            free[c] = component(potential->free().field, c).first;
        }
        for_each_node([&](const Node& node) {
            for (std::size_t c = 0; c < 3; ++c) {
                x[c][node.places[c]] += free[c][node.places[c]] * static_cast<T>(from.c[c][node.grid]);
            }
        });
    }

    /// The largest eigenvalue of B K by power iteration; starts from where the last call ended.
    void estimate_spectrum() {
        int iterations = 5;
        if (highest == 0) {
            iterations = 15;
            unsigned state = 1;
            for (const Node& node : nodes) {
                for (std::size_t c = 0; c < 3; ++c) {
                    state = state * 1664525u + 1013904223u;
                    component(guess.field, c).first[node.places[c]] =
                        static_cast<T>(static_cast<float>(state >> 8) / 8388608.0f - 1.0f);
                }
            }
        }
        space->for_each([](const T& free, T& x) { x *= free; }, potential->free(), guess);
        double before = std::sqrt(space->dot(guess, guess)), size = 1;
        for (int i = 0; i < iterations && before > 0; ++i) {
            multiply(guess, residual);
            precondition(residual, guess);
            const double after = std::sqrt(space->dot(guess, guess));
            size = after / before;
            const T scale = static_cast<T>(after > 0 ? 1 / after : 0);
            space->for_each([scale](T& x) { x *= scale; }, guess);
            before = after > 0 ? 1 : 0;
        }
        highest = 1.2 * size;
    }

    Multigrid* multigrid;
    const VectorSpace<T>* space;
    const Potential<T>* potential = nullptr;
    NodeVector<T> residual, guess;
    ChebyshevVectors<NodeVector<T>> chebyshev;
    std::vector<Node> nodes;
    double highest = 0;
};

} // namespace hybmss
