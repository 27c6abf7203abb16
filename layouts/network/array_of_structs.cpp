#include "layouts/network/array_of_structs.hpp"

#include "layouts/lattice/rest_shape.hpp"

namespace hybmss {

template <class T>
ArrayOfStructs<T>::ArrayOfStructs(const Network& network)
    : springs(network.springs.size()),
      cells(network.cells.size()), tiles{{0, springs.size(), 0, cells.size()}}, color_begin{0, 1},
      masses(network.masses), inverse_mass(4 * padded(network.masses.size())), node_count(network.masses.size()),
      spring_count(network.springs.size()), cell_count(network.cells.size()) {
    for (std::size_t i = 0; i < springs.size(); ++i) {
        const Network::Spring& s = network.springs[i];
        const auto rest = [&](std::size_t axis) { return static_cast<T>(s.rest_vector[axis]); };
        springs[i] = {4 * s.a,
                      4 * s.b,
                      {rest(0), rest(1), rest(2)},
                      static_cast<T>(s.stiffness),
                      static_cast<T>(1 / rest_length2(s))};
    }
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const Network::Cell& c = network.cells[i];
        const RestShape shape = rest_shape(network, c);
        for (std::size_t corner = 0; corner < 8; ++corner) {
            cells[i].node[corner] = 4 * c.nodes[corner];
        }
        for (std::size_t e = 0; e < 9; ++e) {
            cells[i].rest_edge[e] = static_cast<T>(shape.edges[e]);
        }
        cells[i].kappa = static_cast<T>(c.kappa);
        cells[i].inverse_volume = static_cast<T>(1 / shape.volume);
    }
    for (std::size_t n = 0; n < masses.size(); ++n) {
        std::fill_n(inverse_mass.data() + 4 * n, 3, static_cast<T>(1 / masses[n]));
    }
}

template <class T>
std::size_t ArrayOfStructs<T>::bytes() const {
    return springs.bytes() + cells.bytes() + inverse_mass.bytes() + masses.size() * sizeof(double);
}

template struct ArrayOfStructs<float>;
template struct ArrayOfStructs<double>;

} // namespace hybmss
