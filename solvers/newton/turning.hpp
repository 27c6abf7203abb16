#pragma once

#include "hybmss/lattice.hpp"
#include "hybmss/network.hpp"
#include "solvers/newton/vector_space.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hybmss {

/// A body as a chain of sections: where its nodes lie at rest, and to which section each belongs.
class Sections {
public:
    /// The layers of nodes along the axis of a slender lattice; one section for any other.
    static Sections of(const Lattice& lattice);
    /// One section.
    static Sections of(const Network& network);

    std::size_t count() const { return count_; }
    std::array<double, 3> rest_position(std::size_t node) const; ///< m
    std::size_t of_node(std::size_t node) const;

private:
    std::array<int, 3> cells_ = {1, 1, 1};
    double cell_size_ = 1;
    std::size_t axis_ = 0, count_ = 1;
    std::vector<std::uint32_t> grid_nodes_;             ///< of a lattice
    std::vector<std::array<double, 3>> rest_positions_; ///< of a network
};

/// Carries out steps of a minimiser with rotations as rotations.
///
/// A step is linear: where it turns a part of the body, it stretches it too, by half the square of the angle. That
/// costs little where the part is as long as it is thick. A rod that bends, or a body that is free to turn, would have
/// to turn by thousands of steps for their stretch alone. So each section's rotation is taken from the step (least
/// squares), and carried out as such: the chords between sections turn by the mean of theirs and add up along the
/// chain, and what else is in the step turns along. Held components go where the step takes them; the chain in between
/// follows linearly. To first order it is the step itself.
template <class T>
class Turning {
public:
    Turning(const Body<T>& body, Sections sections);

    /// Takes the masks of the held axes, one a node.
    void hold(std::span<const std::uint8_t> held);
    /// Whether it pays: for slender bodies, and where the supports leave a rotation free.
    bool pays() const { return pays_; }
    const Sections& sections() const { return sections_; }
    bool slender() const { return sections_.count() > 1; }

    /// Finds the sections' rotations in a step from a state. Returns the greatest, rad.
    double fit(const State<T>& state, const NodeVector<T>& step);
    /// Moves the state by `part` of the step that was fitted at it.
    void move(const NodeVector<T>& step, double part, State<T>& state) const;

private:
    using Vector = std::array<double, 3>;
    struct Section {
        Vector center, translation, rotation;
        double nodes;
    };
    Vector position(const State<T>& state, std::size_t node) const;
    Vector at(const NodeField<T>& field, std::size_t node) const;
    bool leaves_a_rotation(std::span<const std::uint8_t> held) const;

    const Body<T>* body_;
    Sections sections_;
    std::vector<std::uint32_t> places_; ///< of the body's nodes in the layout
    std::span<const std::uint8_t> held_;
    bool pays_ = false;
    std::vector<Section> fitted_;
};

extern template class Turning<float>;
extern template class Turning<double>;

} // namespace hybmss
