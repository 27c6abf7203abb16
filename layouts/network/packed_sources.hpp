#pragma once

#include "hybmss/network.hpp"
#include "layouts/aligned_array.hpp"
#include "layouts/network/network_blocks.hpp"
#include "layouts/network/network_geometry.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

// What the layout packed-xyzw is filled from: a network's springs and its cells, in the same terms.

namespace hybmss {

/// Springs: from the node at the lower place to the one at the higher.
template <class T>
class SpringSource {
public:
    using Block = SpringBlock<T>;
    using Run = SpringRun;
    using RunShape = SpringRunShape<T>;
    static constexpr std::size_t kNodes = 2;

    /// \param place of each node, empty where it is its number
    SpringSource(const Network& network, std::span<const std::uint32_t> place)
        : springs_(network.springs), turned_(springs_.size()) {
        nodes_.reserve(2 * springs_.size());
        for (std::size_t i = 0; i < springs_.size(); ++i) {
            std::int32_t a = springs_[i].a, b = springs_[i].b;
            if (!place.empty()) {
                a = static_cast<std::int32_t>(place[static_cast<std::size_t>(a)]);
                b = static_cast<std::int32_t>(place[static_cast<std::size_t>(b)]);
            }
            if ((turned_[i] = a > b)) {
                std::swap(a, b);
            }
            nodes_.push_back(a);
            nodes_.push_back(b);
        }
    }

    std::size_t size() const { return springs_.size(); }
    /// kNodes each
    std::span<const std::int32_t> nodes() const { return nodes_; }
    T weight(std::size_t i) const { return static_cast<T>(springs_[i].stiffness); }

    template <class Shape>
    void set_shape(std::size_t i, Shape& shape, std::size_t lane) const {
        const Network::Spring& spring = springs_[i];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            // Sums with zero: no -0, since shapes are compared by their bits.
            const double rest = spring.rest_vector[axis];
            shape.rest[axis][lane] = static_cast<T>(turned_[i] ? 0 - rest : 0 + rest);
        }
        shape.inverse_length2[lane] = static_cast<T>(1 / rest_length2(spring));
    }
    /// What a gap in a block has: it must divide by nothing that is zero.
    static void set_gap(Block& block, std::size_t lane) {
        block.rest[0][lane] = 1;
        block.inverse_length2[lane] = 1;
    }
    static void set(Block& block, std::size_t lane, const std::int32_t (&first)[2], T weight) {
        block.a[lane] = first[0];
        block.b[lane] = first[1];
        block.stiffness[lane] = weight;
    }
    static Run run(const std::int32_t (&first)[2], std::uint32_t shape, std::uint32_t weights) {
        return {first[0], first[1], shape, weights};
    }

private:
    const std::vector<Network::Spring>& springs_;
    std::vector<bool> turned_;
    std::vector<std::int32_t> nodes_;
};

/// Cells: those with springs on means, or those that have a volume alone.
class CellItems {
public:
    using Run = CellRun;
    static constexpr std::size_t kNodes = 8;

    std::size_t size() const { return cells_.size(); }
    std::span<const std::int32_t> nodes() const { return nodes_; }
    static Run run(const std::int32_t (&first)[8], std::uint32_t shape, std::uint32_t weights) {
        Run made{{}, shape, weights};
        std::copy_n(first, 8, made.node);
        return made;
    }

protected:
    CellItems(const Network& network, std::span<const std::uint32_t> place, bool on_means)
        : network_(network), cells_(cells_of(network, on_means)) {
        nodes_.reserve(8 * size());
        for (const Network::Cell* cell : cells_) {
            for (const std::int32_t n : cell->nodes) {
                nodes_.push_back(place.empty() ? n : static_cast<std::int32_t>(place[static_cast<std::size_t>(n)]));
            }
        }
    }

    template <class Block>
    static void set_nodes(Block& block, std::size_t lane, const std::int32_t (&first)[8]) {
        for (std::size_t corner = 0; corner < 8; ++corner) {
            block.node[corner][lane] = first[corner];
        }
    }

    const Network& network_;
    std::vector<const Network::Cell*> cells_;

private:
    std::vector<std::int32_t> nodes_;
};

template <class T>
class CellSource : public CellItems {
public:
    using Block = CellBlock<T>;
    using RunShape = CellRunShape<T>;

    CellSource(const Network& network, std::span<const std::uint32_t> place) : CellItems(network, place, false) {}

    T weight(std::size_t i) const { return static_cast<T>(cells_[i]->kappa); }
    template <class Shape>
    void set_shape(std::size_t i, Shape& shape, std::size_t lane) const {
        const RestShape rest = rest_shape(network_, *cells_[i]);
        for (std::size_t e = 0; e < 9; ++e) {
            shape.rest_edge[e][lane] = static_cast<T>(0 + rest.edges[e]);
        }
        shape.inverse_volume[lane] = static_cast<T>(1 / rest.volume);
    }
    static void set_gap(Block& block, std::size_t lane) {
        for (std::size_t e = 0; e < 9; e += 4) {
            block.rest_edge[e][lane] = 1;
        }
        block.inverse_volume[lane] = 1;
    }
    static void set(Block& block, std::size_t lane, const std::int32_t (&first)[8], T weight) {
        set_nodes(block, lane, first);
        block.kappa[lane] = weight;
    }
};

template <class T>
class MeanSource : public CellItems {
public:
    using Block = MeanBlock<T>;
    using RunShape = MeanRunShape<T>;

    MeanSource(const Network& network, std::span<const std::uint32_t> place) : CellItems(network, place, true) {}

    T weight(std::size_t i) const { return static_cast<T>(mean_cell(network_, *cells_[i]).stiffness); }
    template <class Shape>
    void set_shape(std::size_t i, Shape& shape, std::size_t lane) const {
        const MeanCell cell = mean_cell(network_, *cells_[i]);
        shape.inverse_edge[lane] = static_cast<T>(cell.inverse_edge);
        shape.volume_ratio[lane] = static_cast<T>(cell.volume_ratio);
    }
    static void set_gap(Block& block, std::size_t lane) { block.inverse_edge[lane] = 1; }
    static void set(Block& block, std::size_t lane, const std::int32_t (&first)[8], T weight) {
        set_nodes(block, lane, first);
        block.stiffness[lane] = weight;
    }
};

/// Polyhedra of one shape.
template <class T, CellShape shape>
class PolyhedronSource {
public:
    using Block = PolyhedronBlock<T>;
    static constexpr std::size_t kNodes = static_cast<std::size_t>(shape);

    PolyhedronSource(const Network& network, std::span<const std::uint32_t> place)
        : network_(network), polyhedra_(polyhedra_of(network, shape)) {
        for (std::size_t i = 0; i < size(); ++i) {
            for (std::size_t c = 0; c < kNodes; ++c) {
                const std::int32_t n = polyhedron(i).nodes[c];
                nodes_.push_back(place.empty() ? n : static_cast<std::int32_t>(place[static_cast<std::size_t>(n)]));
            }
        }
    }

    std::size_t size() const { return polyhedra_.size(); }
    std::span<const std::int32_t> nodes() const { return nodes_; }
    T weight(std::size_t i) const { return static_cast<T>(polyhedron(i).kappa); }
    void set_shape(std::size_t i, Block& block, std::size_t lane) const {
        const PolyhedronVectors rest = polyhedron_vectors(network_, polyhedron(i));
        for (std::size_t e = 0; e < 15; ++e) {
            block.rest[e][lane] = static_cast<T>(rest.vectors[e / 3][e % 3]);
        }
        block.inverse_volume[lane] = static_cast<T>(1 / rest.volume);
    }
    static void set_gap(Block& block, std::size_t lane) {
        block.rest[0][lane] = block.rest[4][lane] = block.rest[8][lane] = 1;
        block.inverse_volume[lane] = 1;
    }
    static void set(Block& block, std::size_t lane, const std::int32_t (&first)[kNodes], T weight) {
        for (std::size_t c = 0; c < kNodes; ++c) {
            block.node[c][lane] = first[c];
        }
        block.kappa[lane] = weight;
    }

private:
    const Network::Polyhedron& polyhedron(std::size_t i) const { return network_.polyhedra[polyhedra_[i]]; }

    const Network& network_;
    std::vector<std::uint32_t> polyhedra_;
    std::vector<std::int32_t> nodes_;
};

/// Rows of numbers, each kept once, whoever uses it: the dictionary of a layout. Row is plain numbers without
/// gaps.
template <class Row>
class DistinctRows {
public:
    /// The number of the row with these very bits, new or old.
    std::uint32_t number_of(const Row& row) {
        const auto number = static_cast<std::uint32_t>(rows_.size());
        const auto [begin, end] = known_.equal_range(hash(row));
        for (auto it = begin; it != end; ++it) {
            if (std::memcmp(&rows_[it->second], &row, sizeof row) == 0) {
                return it->second;
            }
        }
        known_.emplace(hash(row), number);
        rows_.push_back(row);
        return number;
    }

    AlignedArray<Row> array() const {
        AlignedArray<Row> all(rows_.size());
        std::copy(rows_.begin(), rows_.end(), all.data());
        return all;
    }

private:
    static std::size_t hash(const Row& row) {
        return std::hash<std::string_view>()({reinterpret_cast<const char*>(&row), sizeof row});
    }

    std::vector<Row> rows_;
    std::unordered_multimap<std::size_t, std::uint32_t> known_;
};

} // namespace hybmss
