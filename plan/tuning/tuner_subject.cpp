#include "plan/tuning/tuner_subject.hpp"

#include "plan/tuning/wisdom_store.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hybmss {
namespace {

using Index = std::array<int, 3>;

/// The edge, in cells, of the largest window.
int largest_edge(const Index& cells, std::size_t most_nodes) {
    const auto nodes = [&](int edge) {
        double product = 1;
        for (const int n : cells) {
            product *= std::min(n, edge) + 1;
        }
        return product;
    };
    int edge = 1;
    while (edge < *std::max_element(cells.begin(), cells.end()) && nodes(edge + 1) <= static_cast<double>(most_nodes)) {
        ++edge;
    }
    return edge;
}

/// value(cell) of the cells of a window.
template <class Value>
auto window_of(const Lattice& lattice, const Index& low, const Index& size, const Value& value) {
    std::vector<std::decay_t<decltype(value(0))>> values;
    values.reserve(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                   static_cast<std::size_t>(size[2]));
    for (int k = 0; k < size[2]; ++k) {
        for (int j = 0; j < size[1]; ++j) {
            const std::size_t row = lattice.cell_index(low[0], low[1] + j, low[2] + k);
            for (std::size_t cell = row; cell < row + static_cast<std::size_t>(size[0]); ++cell) {
                values.push_back(value(cell));
            }
        }
    }
    return values;
}

double fill_of(const std::vector<float>& scales) {
    const auto filled = std::count_if(scales.begin(), scales.end(), [](float scale) { return scale > 0; });
    return static_cast<double>(filled) / static_cast<double>(scales.size());
}

/// The low corner of a window with the first cell that is filled, if there is one.
Index around_first_filled_cell(const Lattice& lattice, const Index& size) {
    const auto scales = lattice.cell_scales();
    const auto first = std::find_if(scales.begin(), scales.end(), [](float scale) { return scale > 0; });
    const auto index = static_cast<int>(first == scales.end() ? 0 : first - scales.begin());
    const Index& n = lattice.cells();
    const Index cell = {index % n[0], index / n[0] % n[1], index / n[0] / n[1]};
    Index low{};
    for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::clamp(cell[a] - size[a] / 2, 0, n[a] - size[a]);
    }
    return low;
}

/// What an estimate takes comes first.
std::vector<std::string> layouts_of(const Lattice& lattice, const Material& material, const std::string& estimated) {
    std::vector<std::string> layouts = layouts_to_try(lattice, material);
    std::erase(layouts, estimated); // it may be none of those
    layouts.insert(layouts.begin(), estimated);
    return layouts;
}

/// The subject of a piece, which it owns.
template <class T, class Piece>
TunerSubject<T> owned_subject(Piece part, const auto&... material) {
    const auto piece = std::make_shared<Piece>(std::move(part));
    TunerSubject<T> subject = subject_of<T>(*piece, material...);
    subject.make = [piece, make = std::move(subject.make)](const PlanOptions& options) { return make(options); };
    return subject;
}

} // namespace

Lattice sample_of(const Lattice& lattice, std::size_t most_nodes) {
    const Index& cells = lattice.cells();
    if (lattice.grid_node_count() <= most_nodes) {
        return lattice;
    }
    const int edge = largest_edge(cells, most_nodes);
    const Index size = {std::min(cells[0], edge), std::min(cells[1], edge), std::min(cells[2], edge)};
    const double whole = static_cast<double>(lattice.cell_count()) / static_cast<double>(lattice.cell_scales().size());
    std::vector<float> best;
    Index place_of_best{};
    double least = HUGE_VAL;
    const auto consider = [&](const Index& low) {
        std::vector<float> scales =
            window_of(lattice, low, size, [&](std::size_t cell) { return lattice.cell_scales()[cell]; });
        const double fill = fill_of(scales), difference = std::abs(fill - whole);
        // Nothing can be timed on an empty window, however thinly the whole is filled.
        if (best.empty() || (fill > 0 && difference < least)) {
            least = fill > 0 ? difference : HUGE_VAL;
            best = std::move(scales);
            place_of_best = low;
        }
    };
    for (int corner = 0; corner < 27 && least > 0; ++corner) {
        // Middle first: where windows are alike, the one that has neighbours on all sides of the body.
        const Index place = {(corner + 1) % 3, (corner / 3 + 1) % 3, (corner / 9 + 1) % 3};
        Index low{};
        for (std::size_t a = 0; a < 3; ++a) {
            low[a] = (cells[a] - size[a]) * place[a] / 2;
        }
        consider(low);
    }
    if (least == HUGE_VAL) {
        consider(around_first_filled_cell(lattice, size));
    }
    Lattice sample = Lattice::from_cells(size[0], size[1], size[2], lattice.cell_size(), std::move(best));
    if (!lattice.tissues().empty()) {
        sample.set_tissues({lattice.tissues().begin(), lattice.tissues().end()},
                           window_of(lattice, place_of_best, size, [&](std::size_t cell) {
                               return static_cast<std::uint8_t>(lattice.cell_tissue(cell));
                           }));
    }
    if (!lattice.fills().empty()) {
        sample.set_fills(
            window_of(lattice, place_of_best, size, [&](std::size_t cell) { return lattice.cell_fill(cell); }));
    }
    return sample;
}

Network sample_of(const Network& network, std::size_t most_nodes) {
    const auto& positions = network.rest_positions;
    if (positions.size() <= most_nodes) {
        return network;
    }
    std::size_t axis = 0;
    double longest = -1;
    for (std::size_t a = 0; a < 3; ++a) {
        const auto [low, high] = std::minmax_element(positions.begin(), positions.end(),
                                                     [a](const auto& p, const auto& q) { return p[a] < q[a]; });
        if ((*high)[a] - (*low)[a] > longest) {
            longest = (*high)[a] - (*low)[a];
            axis = a;
        }
    }
    std::vector<std::size_t> kept(positions.size());
    for (std::size_t n = 0; n < kept.size(); ++n) {
        kept[n] = n;
    }
    std::nth_element(kept.begin(), kept.begin() + static_cast<std::ptrdiff_t>(most_nodes), kept.end(),
                     [&](std::size_t m, std::size_t n) {
                         return std::pair(positions[m][axis], m) < std::pair(positions[n][axis], n);
                     });
    kept.resize(most_nodes);
    std::sort(kept.begin(), kept.end());

    Network sample;
    sample.volume_energy = network.volume_energy;
    sample.means = network.means;
    std::vector<std::int32_t> renumbered(positions.size(), -1);
    for (const std::size_t n : kept) {
        renumbered[n] = static_cast<std::int32_t>(sample.masses.size());
        sample.rest_positions.push_back(positions[n]);
        sample.masses.push_back(network.masses[n]);
    }
    const auto number = [&](std::int32_t node) { return renumbered[static_cast<std::size_t>(node)]; };
    for (Network::Spring spring : network.springs) {
        spring.a = number(spring.a);
        spring.b = number(spring.b);
        if (spring.a >= 0 && spring.b >= 0) {
            sample.springs.push_back(spring);
        }
    }
    for (Network::Cell cell : network.cells) {
        std::transform(cell.nodes.begin(), cell.nodes.end(), cell.nodes.begin(), number);
        if (*std::min_element(cell.nodes.begin(), cell.nodes.end()) >= 0) {
            sample.cells.push_back(cell);
        }
    }
    sample.nodal_volumes = network.nodal_volumes;
    for (Network::Polyhedron polyhedron : network.polyhedra) {
        const auto end = polyhedron.nodes.begin() + static_cast<std::ptrdiff_t>(polyhedron.node_count());
        std::transform(polyhedron.nodes.begin(), end, polyhedron.nodes.begin(), number);
        if (*std::min_element(polyhedron.nodes.begin(), end) >= 0) {
            sample.polyhedra.push_back(polyhedron);
        }
    }
    return sample;
}

template <class T>
TunerSubject<T> subject_of(const Lattice& lattice, const Material& material, const std::string& estimated) {
    const std::size_t cells = lattice.cell_count();
    return {body_class<T>(lattice, material),
            layouts_of(lattice, material, estimated),
            lattice.grid_node_count(),
            cells ? cells : 1,
            [&lattice, &material](const PlanOptions& options) { return make_body<T>(lattice, material, options); },
            [&lattice, &material, estimated](std::size_t most_nodes) {
                return owned_subject<T>(sample_of(lattice, most_nodes), material, estimated);
            }};
}

template <class T>
TunerSubject<T> subject_of(const Network& network) {
    const std::size_t nodes = network.masses.size();
    return {body_class<T>(network),
            network_layouts(),
            nodes,
            std::max(network.cells.size() + network.polyhedra.size(),
                     network.cells.empty() && network.polyhedra.empty() ? nodes : 0),
            [&network](const PlanOptions& options) { return make_body<T>(network, options); },
            [&network](std::size_t most_nodes) { return owned_subject<T>(sample_of(network, most_nodes)); }};
}

template TunerSubject<float> subject_of(const Lattice&, const Material&, const std::string&);
template TunerSubject<double> subject_of(const Lattice&, const Material&, const std::string&);
template TunerSubject<float> subject_of(const Network&);
template TunerSubject<double> subject_of(const Network&);

} // namespace hybmss
