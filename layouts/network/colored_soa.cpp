#include "layouts/network/colored_soa.hpp"

#include "layouts/coloring.hpp"
#include "layouts/network/network_geometry.hpp"

#include <span>

namespace hybmss {
namespace {

/// Where each colour starts once it is padded to whole vectors.
std::vector<std::size_t> padded_begins(const Coloring& coloring) {
    std::vector<std::size_t> begins = {0};
    for (std::size_t c = 0; c < coloring.colors(); ++c) {
        begins.push_back(begins.back() + padded(coloring.begin[c + 1] - coloring.begin[c]));
    }
    return begins;
}

/// Calls place(slot, item) for every item.
template <class Place>
void for_each_slot(const Coloring& coloring, const std::vector<std::size_t>& begins, const Place& place) {
    for (std::size_t c = 0; c < coloring.colors(); ++c) {
        for (std::size_t i = coloring.begin[c]; i < coloring.begin[c + 1]; ++i) {
            place(begins[c] + i - coloring.begin[c], coloring.order[i]);
        }
    }
}

/// An index array whose every entry is the dummy node of its lane.
AlignedArray<std::int32_t> dummies(std::size_t size, std::size_t node_count) {
    AlignedArray<std::int32_t> index(size);
    for (std::size_t i = 0; i < size; ++i) {
        index[i] = static_cast<std::int32_t>(node_count + i % kPadding);
    }
    return index;
}

template <class T>
AlignedArray<T> filled(std::size_t size, T value) {
    AlignedArray<T> array(size);
    std::fill_n(array.data(), size, value);
    return array;
}

} // namespace

template <class T>
ColoredSoa<T>::ColoredSoa(const Network& network)
    : masses(network.masses), inverse_mass(padded(network.masses.size() + kPadding)), node_count(network.masses.size()),
      spring_count(network.springs.size()), cell_count(network.cells.size()) {
    for (std::size_t n = 0; n < node_count; ++n) {
        inverse_mass[n] = static_cast<T>(1 / masses[n]);
    }

    std::vector<std::int32_t> nodes;
    for (const Network::Spring& s : network.springs) {
        nodes.insert(nodes.end(), {s.a, s.b});
    }
    Coloring coloring = color_greedily(nodes, 2, node_count);
    springs.color_begin = padded_begins(coloring);
    std::size_t slots = springs.color_begin.back();
    springs.a = dummies(slots, node_count);
    springs.b = dummies(slots, node_count);
    springs.rest[0] = filled(slots, T(1));
    springs.rest[1] = AlignedArray<T>(slots);
    springs.rest[2] = AlignedArray<T>(slots);
    springs.stiffness = AlignedArray<T>(slots);
    springs.inverse_length2 = filled(slots, T(1));
    for_each_slot(coloring, springs.color_begin, [&](std::size_t slot, std::size_t item) {
        const Network::Spring& s = network.springs[item];
        springs.a[slot] = s.a;
        springs.b[slot] = s.b;
        springs.stiffness[slot] = static_cast<T>(s.stiffness);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            springs.rest[axis][slot] = static_cast<T>(s.rest_vector[axis]);
        }
        springs.inverse_length2[slot] = static_cast<T>(1 / rest_length2(s));
    });

    const auto color_cells = [&](const std::vector<const Network::Cell*>& all) {
        nodes.clear();
        for (const Network::Cell* c : all) {
            nodes.insert(nodes.end(), c->nodes.begin(), c->nodes.end());
        }
        return color_greedily(nodes, 8, node_count);
    };
    const std::vector<const Network::Cell*> with_volume = cells_of(network, false);
    coloring = color_cells(with_volume);
    cells.color_begin = padded_begins(coloring);
    slots = cells.color_begin.back();
    for (std::size_t corner = 0; corner < 8; ++corner) {
        cells.node[corner] = dummies(slots, node_count);
    }
    for (std::size_t e = 0; e < 9; ++e) {
        cells.rest_edge[e] = filled(slots, T(e % 4 == 0 ? 1 : 0));
    }
    cells.kappa = AlignedArray<T>(slots);
    cells.inverse_volume = filled(slots, T(1));
    for_each_slot(coloring, cells.color_begin, [&](std::size_t slot, std::size_t item) {
        const Network::Cell& c = *with_volume[item];
        const RestShape rest = rest_shape(network, c);
        for (std::size_t corner = 0; corner < 8; ++corner) {
            cells.node[corner][slot] = c.nodes[corner];
        }
        for (std::size_t e = 0; e < 9; ++e) {
            cells.rest_edge[e][slot] = static_cast<T>(rest.edges[e]);
        }
        cells.kappa[slot] = static_cast<T>(c.kappa);
        cells.inverse_volume[slot] = static_cast<T>(1 / rest.volume);
    });

    const std::vector<const Network::Cell*> with_means = cells_of(network, true);
    coloring = color_cells(with_means);
    means.color_begin = padded_begins(coloring);
    means.blocks = AlignedArray<MeanBlock<T>>(means.color_begin.back() / kBlockItems);
    for (std::size_t slot = 0; slot < means.color_begin.back(); ++slot) {
        MeanBlock<T>& block = means.blocks[slot / kBlockItems];
        const std::size_t lane = slot % kBlockItems;
        for (auto& corner : block.node) {
            corner[lane] = static_cast<std::int32_t>(node_count + lane);
        }
        block.inverse_edge[lane] = 1;
    }
    for_each_slot(coloring, means.color_begin, [&](std::size_t slot, std::size_t item) {
        MeanBlock<T>& block = means.blocks[slot / kBlockItems];
        const std::size_t lane = slot % kBlockItems;
        const MeanCell cell = mean_cell(network, *with_means[item]);
        for (std::size_t corner = 0; corner < 8; ++corner) {
            block.node[corner][lane] = with_means[item]->nodes[corner];
        }
        block.stiffness[lane] = static_cast<T>(cell.stiffness);
        block.inverse_edge[lane] = static_cast<T>(cell.inverse_edge);
        block.volume_ratio[lane] = static_cast<T>(cell.volume_ratio);
    });
    for (std::size_t& begin : means.color_begin) {
        begin /= kBlockItems;
    }
}

template <class T>
std::size_t ColoredSoa<T>::bytes() const {
    const std::size_t spring_slots = springs.color_begin.back(), cell_slots = cells.color_begin.back();
    return spring_slots * (2 * sizeof(std::int32_t) + 5 * sizeof(T)) +
           cell_slots * (8 * sizeof(std::int32_t) + 11 * sizeof(T)) + means.blocks.bytes() + size() * sizeof(T) +
           node_count * sizeof(double);
}

template struct ColoredSoa<float>;
template struct ColoredSoa<double>;

} // namespace hybmss
