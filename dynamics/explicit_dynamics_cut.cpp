// How a body is cut while it moves.
#include "dynamics/explicit_dynamics_implementation.hpp"

#include <stdexcept>
#include <string>

namespace hybmss {

template <class T>
void ExplicitDynamics<T>::Implementation::check_cut(const Lattice& lattice, std::span<const std::uint32_t> cells) {
    if (const std::string layout = body->describe().layout; !can_be_cut(layout)) {
        throw std::invalid_argument("layout \"" + layout +
                                    "\" cannot be cut while it moves: " + layouts_that_can_be_cut() + " can");
    }
    for (const std::uint32_t cell : cells) {
        if (cell >= lattice.cell_scales().size()) {
            throw std::invalid_argument("cell " + std::to_string(cell) + ": the lattice has " +
                                        std::to_string(lattice.cell_scales().size()));
        }
    }
    if (lattice.cell_size() != body->length_unit()) {
        throw std::invalid_argument("the lattice has cells of " + std::to_string(lattice.cell_size()) +
                                    " m, the body of " + std::to_string(body->length_unit()) + " m");
    }
    if (!numbers) {
        if (const std::size_t cells_here = body->describe().cells; cells_here != lattice.cell_count()) {
            throw std::invalid_argument("the lattice has " + std::to_string(lattice.cell_count()) +
                                        " cells, the body made from it " + std::to_string(cells_here));
        }
        numbers.emplace(lattice, body->node_count());
        grid = lattice.cells();
    }
    if (grid != lattice.cells()) {
        throw std::invalid_argument("the lattice has another grid than the one that the body was made from");
    }
}

template <class T>
bool ExplicitDynamics<T>::can_remove_cells() const {
    return can_be_cut(implementation_->body->describe().layout);
}

template <class T>
std::size_t ExplicitDynamics<T>::remove_cells(Lattice& lattice, std::span<const std::uint32_t> cells) {
    Implementation& i = *implementation_;
    i.check_cut(lattice, cells);
    const auto nx = static_cast<std::size_t>(lattice.cells()[0]), ny = static_cast<std::size_t>(lattice.cells()[1]);
    std::vector<CutNode> nodes;
    std::size_t removed = 0;
    for (const std::uint32_t cell : cells) {
        const std::size_t x = cell % nx, y = cell / nx % ny, z = cell / nx / ny;
        const int at[3] = {static_cast<int>(x), static_cast<int>(y), static_cast<int>(z)};
        if (!(lattice.cell_scale(at[0], at[1], at[2]) > 0)) {
            continue;
        }
        lattice.set_cell_scale(at[0], at[1], at[2], 0);
        ++removed;
        for (std::size_t corner = 0; corner < 8; ++corner) {
            const std::array<std::size_t, 3> place = {x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)};
            nodes.push_back({i.numbers->of(place[0] + (nx + 1) * (place[1] + (ny + 1) * place[2])), place});
        }
    }
    i.planned.body->take_over(lattice, nodes, removed);
    for (const CutNode& node : nodes) {
        if (i.body->masses()[node.node] == 0) { // nothing would slow it down
            for (std::size_t c = 0; c < 3; ++c) {
                const Component<T> v = component(i.state.velocity, c);
                v.first[static_cast<std::ptrdiff_t>(i.body->index_of(node.node)) * v.stride] = 0;
            }
        }
    }
    if (i.touching) {
        const std::array<double, 3> low = lattice.rest_position(i.numbers->grid_node(i.touching->node));
        std::vector<SurfaceNode> around;
        for (const CutNode& node : nodes) {
            SurfaceNode& bared = around.emplace_back(SurfaceNode{node.node, i.touching->rest_position});
            for (std::size_t a = 0; a < 3; ++a) {
                bared.rest_position[a] += lattice.cell_size() * static_cast<double>(node.place[a]) - low[a];
            }
        }
        i.contact->surface_was_cut(*i.body, around);
    }
    if (!i.loads.empty()) { // the same forces on other masses
        load(std::vector<NodalLoad>(i.loads));
    }
    return removed;
}

template bool ExplicitDynamics<float>::can_remove_cells() const;
template bool ExplicitDynamics<double>::can_remove_cells() const;
template std::size_t ExplicitDynamics<float>::remove_cells(Lattice&, std::span<const std::uint32_t>);
template std::size_t ExplicitDynamics<double>::remove_cells(Lattice&, std::span<const std::uint32_t>);

} // namespace hybmss
