#include "plan/body.hpp"

#include <stdexcept>
#include <string>

namespace hybmss {

template <class T>
std::size_t State<T>::bytes() const {
    std::size_t sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        sum += displacement[c].bytes() + velocity[c].bytes() + force[c].bytes();
    }
    for (const auto& buffer : buffers) {
        sum += buffer.bytes();
    }
    return sum;
}

template <class T>
void Body<T>::check_size(std::size_t size) const {
    if (size != node_count()) {
        throw std::invalid_argument("vector field of " + std::to_string(size) + " nodes given: the body has " +
                                    std::to_string(node_count()));
    }
}

template <class T>
template <class Visit>
void Body<T>::for_each_run(const Visit& visit) const {
    // A voxel body has a run a row of cells: hand them out in bundles.
    constexpr std::size_t kBundle = 64;
    const std::span<const NodeRun> all = runs();
    const std::size_t bundle = all.size() > 64 * kBundle ? kBundle : 1;
    const auto piece = [&](std::size_t index, std::size_t) {
        for (std::size_t r = index * bundle; r < std::min((index + 1) * bundle, all.size()); ++r) {
            visit(all[r]);
        }
    };
    workers_.run((all.size() + bundle - 1) / bundle, piece);
}

template <class T>
void Body<T>::write(VectorField<const T> in, double factor, NodeField<T>& field) const {
    check_size(in.size);
    const T* const from[3] = {in.x, in.y, in.z};
    const T scale = static_cast<T>(factor);
    for_each_run([&](const NodeRun& run) {
        for (std::size_t c = 0; c < 3; ++c) {
            const T* source = from[c] + static_cast<std::ptrdiff_t>(run.node) * in.stride;
            T* target = field[c].data() + run.index;
            if (in.stride == 1) {
                for (std::size_t n = 0; n < run.length; ++n) {
                    target[n] = scale * source[n];
                }
            } else {
                for (std::size_t n = 0; n < run.length; ++n, source += in.stride) {
                    target[n] = scale * *source;
                }
            }
        }
    });
}

template <class T>
void Body<T>::read(const NodeField<T>& field, double factor, VectorField<T> out) const {
    check_size(out.size);
    T* const to[3] = {out.x, out.y, out.z};
    const T scale = static_cast<T>(factor);
    for_each_run([&](const NodeRun& run) {
        for (std::size_t c = 0; c < 3; ++c) {
            T* target = to[c] + static_cast<std::ptrdiff_t>(run.node) * out.stride;
            const T* source = field[c].data() + run.index;
            for (std::size_t n = 0; n < run.length; ++n, target += out.stride) {
                *target = scale * source[n];
            }
        }
    });
}

template <class T>
void Body<T>::add(const NodeField<T>& field, VectorField<T> out) const {
    check_size(out.size);
    T* const to[3] = {out.x, out.y, out.z};
    for_each_run([&](const NodeRun& run) {
        for (std::size_t c = 0; c < 3; ++c) {
            T* target = to[c] + static_cast<std::ptrdiff_t>(run.node) * out.stride;
            const T* source = field[c].data() + run.index;
            for (std::size_t n = 0; n < run.length; ++n, target += out.stride) {
                *target += source[n];
            }
        }
    });
}

template <class T>
double Body<T>::kinetic_energy(const State<T>& state) const {
    const std::span<const double> mass = masses();
    double twice = 0;
    for (const NodeRun& run : runs()) {
        for (std::size_t n = 0; n < run.length; ++n) {
            const std::size_t i = run.index + n;
            const double x = static_cast<double>(state.velocity[0][i]), y = static_cast<double>(state.velocity[1][i]),
                         z = static_cast<double>(state.velocity[2][i]);
            twice += mass[run.node + n] * (x * x + y * y + z * z);
        }
    }
    return 0.5 * twice * length_unit() * length_unit();
}

template <class T>
void Body<T>::set_prescribed(State<T>& state, std::span<const PrescribedComponent<T>> prescribed) {
    for (const PrescribedComponent<T>& p : prescribed) {
        state.displacement[p.axis][p.index] = p.displacement;
        state.velocity[p.axis][p.index] = p.velocity;
    }
}

template struct State<float>;
template struct State<double>;
template class Body<float>;
template class Body<double>;

} // namespace hybmss
