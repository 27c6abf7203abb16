#pragma once

#include "plan/bodies/body.hpp"
#include "solvers/newton/ranks.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace hybmss {

/// One 3-vector a node in the layout of a body's state, padding included.
template <class T>
struct NodeVector {
    NodeField<T> field;
};

/// A field of a body's state as a vector; not owned.
template <class T>
struct FieldView {
    const NodeField<T>& field;
};

template <class T>
struct MutableFieldView {
    NodeField<T>& field;
};

/// Vectors over a body's nodes and the loops that a minimiser runs over them.
///
/// Loops run over whole arrays, padding included, so padding must hold zeros and maps must take zeros to zeros. Arrays
/// are cut into pieces by the body alone, and sums are double, piece after piece: the same bits for any number of
/// threads.
template <class T>
class VectorSpace {
public:
    explicit VectorSpace(const Body<T>& body) : workers_(&body.workers()) {
        constexpr std::size_t kPiece = 4096;
        const State<T> sample = body.make_state(false);
        for (std::size_t c = 0; c < 3; ++c) {
            sizes_[c] = sample.displacement[c].size();
            for (std::size_t begin = 0; begin < sizes_[c]; begin += kPiece) {
                pieces_.push_back({c, begin, std::min(kPiece, sizes_[c] - begin)});
            }
        }
        partial_.resize(pieces_.size());
    }

    /// The body is a part of one of many ranks: sums and largest values are of all of them, nodes that are on several
    /// counted once. Null: alone.
    void share(const SharedNodes<T>* nodes) { shared_ = nodes; }

    /// A vector of zeros.
    NodeVector<T> make() const {
        NodeVector<T> vector;
        for (std::size_t c = 0; c < 3; ++c) {
            vector.field[c] = AlignedArray<T>(sizes_[c]);
        }
        return vector;
    }

    /// map(a, b, ...) for every component of the vectors, by reference.
    template <class Map, class... Vectors>
    void for_each(const Map& map, Vectors&... vectors) const {
        run([&](const Piece& piece, std::size_t) {
            for_piece(piece, map, vectors.field[piece.array].data() + piece.begin...);
        });
    }

    /// The sum of term(a, b, ...) over every component.
    template <class Term, class... Vectors>
    double sum(const Term& term, Vectors&... vectors) const {
        double own = add_pieces([&](const Piece& piece) {
            return sum_piece(piece, term, vectors.field[piece.array].data() + piece.begin...);
        });
        if (!shared_) {
            return own;
        }
        const bool packed = sizes_[1] == 0;
        for (const std::size_t place : shared_->counted_elsewhere()) {
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t array = packed ? 0 : c, at = packed ? 4 * place + c : place;
                own -= static_cast<double>(term(vectors.field[array].data()[at]...));
            }
        }
        return shared_->ranks().sum(own);
    }

    /// The largest of term(a, b, ...), at least 0; a NaN is passed on.
    template <class Term, class... Vectors>
    double largest(const Term& term, Vectors&... vectors) const {
        const double own = largest_of_pieces([&](const Piece& piece) {
            return largest_in_piece(piece, term, vectors.field[piece.array].data() + piece.begin...);
        });
        return shared_ ? shared_->ranks().largest(own) : own;
    }

    double dot(const NodeVector<T>& a, const NodeVector<T>& b) const {
        return sum([](const T& x, const T& y) { return static_cast<double>(x) * static_cast<double>(y); }, a, b);
    }
    double largest_component(const NodeVector<T>& a) const {
        return largest([](const T& x) { return x < 0 ? -x : x; }, a);
    }
    void clear(NodeVector<T>& a) const {
        for_each([](T& x) { x = 0; }, a);
    }
    template <class From, class To>
    void copy(const From& from, To& to) const {
        for_each([](const T& x, T& y) { y = x; }, from, to);
    }
    /// y += factor x
    void add_multiple(double factor, const NodeVector<T>& x, NodeVector<T>& y) const {
        const T f = static_cast<T>(factor);
        for_each([f](const T& a, T& b) { b += f * a; }, x, y);
    }

private:
    struct Piece {
        std::size_t array, begin, length;
    };
    /// Partial sums side by side, so that the additions do not wait for each other.
    static constexpr std::size_t kLanes = kPadding;

    template <class Map, class... Pointers>
    static void for_piece(const Piece& piece, const Map& map, Pointers... at) {
        for (std::size_t i = 0; i < piece.length; ++i) {
            map(at[i]...);
        }
    }
    template <class Term, class... Pointers>
    static double sum_piece(const Piece& piece, const Term& term, Pointers... at) {
        std::array<double, kLanes> lanes{};
        for (std::size_t i = 0; i < piece.length; i += kLanes) {
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                lanes[lane] += static_cast<double>(term(at[i + lane]...));
            }
        }
        double total = 0;
        for (double lane : lanes) {
            total += lane;
        }
        return total;
    }
    template <class Term, class... Pointers>
    static double largest_in_piece(const Piece& piece, const Term& term, Pointers... at) {
        double most = 0;
        for (std::size_t i = 0; i < piece.length; ++i) {
            const auto value = static_cast<double>(term(at[i]...));
            most = value <= most ? most : value; // a NaN is not at most anything
            if (value != value) {
                return value;
            }
        }
        return most;
    }

    template <class Visit>
    void run(const Visit& visit) const {
        if (pieces_.size() == 3 || workers_->threads() == 1) {
            for (std::size_t p = 0; p < pieces_.size(); ++p) {
                visit(pieces_[p], p);
            }
            return;
        }
        workers_->run(pieces_.size(), [&](std::size_t p, std::size_t) { visit(pieces_[p], p); });
    }
    template <class Value>
    double add_pieces(const Value& value) const {
        run([&](const Piece& piece, std::size_t p) { partial_[p] = value(piece); });
        double total = 0;
        for (double p : partial_) {
            total += p;
        }
        return total;
    }
    template <class Value>
    double largest_of_pieces(const Value& value) const {
        run([&](const Piece& piece, std::size_t p) { partial_[p] = value(piece); });
        double most = 0;
        for (double p : partial_) {
            if (p != p) {
                return p;
            }
            most = p > most ? p : most;
        }
        return most;
    }

    const Workers* workers_;
    const SharedNodes<T>* shared_ = nullptr;
    std::array<std::size_t, 3> sizes_;
    std::vector<Piece> pieces_;
    mutable std::vector<double> partial_; ///< scratch, one a piece
};

} // namespace hybmss
