#pragma once

/// \file
/// A body of which every process (rank) has a box of cells, and what its minimiser asks of the others.

#include "hybmss/lattice.hpp"
#include "plan/bodies/body.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

namespace hybmss {

/// The cells that a rank has of a grid, which planes cut from side to side.
struct RankBox {
    std::array<int, 3> first = {0, 0, 0}; ///< cell
    std::array<int, 3> whole = {1, 1, 1}; ///< cells of the grid
    bool meets[3][2] = {};                ///< whether another rank's box is there, by axis and side
    int halvings = 0;                     ///< how often cells can be merged two by two with none across a cut

    /// The box of the cells merged two by two; halvings > 0.
    RankBox merged() const {
        RankBox box = *this;
        for (std::size_t a = 0; a < 3; ++a) {
            box.first[a] /= 2;
            box.whole[a] = (box.whole[a] + 1) / 2;
        }
        --box.halvings;
        return box;
    }
    bool alone() const {
        return std::none_of(&meets[0][0], &meets[0][0] + 6, [](bool other) { return other; });
    }
};

/// The other ranks. Each computes its own cells alone, so that of forces and products a rank has but a part at nodes
/// where boxes meet, which every rank with a cell there has too. What they make of such a node is added up, and then
/// all have the same, to the bit: all that is computed node by node goes on without them.
///
/// Every call is collective.
class Ranks {
public:
    explicit Ranks(const RankBox& box) : box_(box) {}
    virtual ~Ranks() = default;
    const RankBox& box() const { return box_; }

    /// Of all ranks. A NaN makes the largest infinite.
    virtual double sum(double own) const = 0;
    virtual double largest(double own) const = 0;
    virtual void sum(std::span<double> values) const = 0;

    /// Nodes of a box on its faces towards others, by axis and side: numbers in a list of them, in index order.
    using Faces = std::array<std::array<std::vector<std::uint32_t>, 2>, 3>;
    /// `values`: `width` a node of that list. Sets them to the sums of what all ranks have of the node.
    virtual void add_up(const Faces& faces, std::size_t width, std::span<double> values) const = 0;

private:
    RankBox box_;
};

/// The nodes of a rank's box of cells that others have too.
class RankBorder {
public:
    /// `cells`: those of the box along each axis, on the level at hand.
    RankBorder(const Ranks& ranks, const std::array<int, 3>& cells) : ranks_(&ranks) {
        for (int k = 0; k <= cells[2]; ++k) {
            for (int j = 0; j <= cells[1]; ++j) {
                for (int i = 0; i <= cells[0]; ++i) {
                    const std::array<int, 3> at = {i, j, k};
                    const auto number = static_cast<std::uint32_t>(nodes_.size());
                    bool shared = false;
                    for (std::size_t a = 0; a < 3; ++a) {
                        for (std::size_t side = 0; side < 2; ++side) {
                            if (ranks.box().meets[a][side] && at[a] == (side == 0 ? 0 : cells[a])) {
                                faces_[a][side].push_back(number);
                                shared = true;
                            }
                        }
                    }
                    if (shared) {
                        nodes_.push_back(at);
                    } else if (i == 0 && cells[0] > 1 && j > 0 && j < cells[1] && k > 0 && k < cells[2]) {
                        i = cells[0] - 1; // nothing in between is on a face
                    }
                }
            }
        }
    }

    const Ranks& ranks() const { return *ranks_; }
    /// x y z in the box, in index order.
    const std::vector<std::array<int, 3>>& nodes() const { return nodes_; }

    /// at(node, entry), of `width` entries, is the address of the value that this rank has of a node of nodes(), or
    /// null where it has none: that becomes the sum of all ranks'.
    template <class At>
    void add_up(std::size_t width, const At& at) const {
        std::vector<double> values(width * nodes_.size());
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            for (std::size_t e = 0; e < width; ++e) {
                const auto* value = at(n, e);
                values[width * n + e] = value ? static_cast<double>(*value) : 0;
            }
        }
        ranks_->add_up(faces_, width, values);
        for (std::size_t n = 0; n < nodes_.size(); ++n) {
            for (std::size_t e = 0; e < width; ++e) {
                if (auto* value = at(n, e)) {
                    *value = static_cast<std::remove_reference_t<decltype(*value)>>(values[width * n + e]);
                }
            }
        }
    }

    /// Of the nodes that this rank has, those that another one counts: of all that have a node, one does.
    template <class Has>
    std::vector<std::uint32_t> counted_elsewhere(const Has& has) const {
        // Each rank around a node adds a bit of its own, by the side on which it lies; the lowest counts.
        std::vector<double> bits(nodes_.size());
        const auto side = [&](std::size_t n) {
            unsigned high = 0;
            for (std::size_t a = 0; a < 3; ++a) {
                high |= (ranks_->box().meets[a][0] && nodes_[n][a] == 0 ? 1u : 0u) << a;
            }
            return high;
        };
        for (std::size_t n = 0; n < bits.size(); ++n) {
            bits[n] = has(n) ? static_cast<double>(1u << side(n)) : 0;
        }
        add_up(1, [&](std::size_t n, std::size_t) { return &bits[n]; });
        std::vector<std::uint32_t> elsewhere;
        for (std::size_t n = 0; n < bits.size(); ++n) {
            if (has(n) && (static_cast<unsigned>(bits[n]) & ((1u << side(n)) - 1)) != 0) {
                elsewhere.push_back(static_cast<std::uint32_t>(n));
            }
        }
        return elsewhere;
    }

private:
    const Ranks* ranks_;
    std::vector<std::array<int, 3>> nodes_;
    Ranks::Faces faces_;
};

/// The same in the layout of a rank's body.
template <class T>
class SharedNodes {
public:
    SharedNodes(const Body<T>& body, const Lattice& lattice, const Ranks& ranks) : border_(ranks, lattice.cells()) {
        const std::vector<std::uint32_t> nodes = lattice.nodes();
        for (const auto& [i, j, k] : border_.nodes()) {
            const auto grid_node = static_cast<std::uint32_t>(lattice.grid_node_index(i, j, k));
            const auto found = std::lower_bound(nodes.begin(), nodes.end(), grid_node);
            places_.push_back(found != nodes.end() && *found == grid_node
                                  ? body.index_of(static_cast<std::size_t>(found - nodes.begin()))
                                  : kNone);
        }
        for (const std::uint32_t n : border_.counted_elsewhere([&](std::size_t at) { return places_[at] != kNone; })) {
            elsewhere_.push_back(places_[n]);
        }
    }

    const Ranks& ranks() const { return border_.ranks(); }
    /// Places in the layout of nodes that another rank counts.
    const std::vector<std::size_t>& counted_elsewhere() const { return elsewhere_; }

    void add_up(NodeField<T>& field) const {
        const Component<T> all[3] = {component(field, 0), component(field, 1), component(field, 2)};
        border_.add_up(3, [&](std::size_t n, std::size_t c) {
            return places_[n] == kNone ? nullptr
                                       : all[c].first + static_cast<std::ptrdiff_t>(places_[n]) * all[c].stride;
        });
    }
    /// By places.
    void add_up(AlignedArray<T> (&entries)[6]) const {
        border_.add_up(6, [&](std::size_t n, std::size_t e) {
            return places_[n] == kNone ? nullptr : entries[e].data() + places_[n];
        });
    }

private:
    static constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
    RankBorder border_;
    std::vector<std::size_t> places_, elsewhere_;
};

} // namespace hybmss
