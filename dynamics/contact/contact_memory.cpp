// What contact must remember so that a motion can be taken up again with the same bits.
#include "dynamics/contact/contact.hpp"

#include <algorithm>

namespace hybmss {

// The time since the obstacles were moved; then for every obstacle two numbers a block, and seven a node where there is
// friction. What blocks wait for is not kept: looking earlier finds nothing.
template <class T>
std::size_t Contact<T>::memory_size() const {
    std::size_t size = 1;
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        size += 2 * watches_[o].size() + 7 * grips_[o].size();
    }
    return size;
}

template <class T>
std::vector<double> Contact<T>::memory() const {
    std::vector<double> memory = {elapsed()};
    memory.reserve(memory_size());
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        for (const Watch& watch : watches_[o]) {
            memory.push_back(watch.dissipated);
            memory.push_back(watch.greatest_depth);
        }
        for (const Grip& grip : grips_[o]) {
            memory.insert(memory.end(), grip.place.begin(), grip.place.end());
            memory.insert(memory.end(), grip.stretch.begin(), grip.stretch.end());
            memory.push_back(grip.holds ? 2 : grip.known ? 1 : 0);
        }
    }
    return memory;
}

template <class T>
void Contact<T>::set_memory(std::span<const double> memory) {
    const double* next = memory.data();
    std::fill(elapsed_.begin(), elapsed_.end(), *next++);
    for (std::size_t o = 0; o < obstacles_.size(); ++o) {
        for (Watch& watch : watches_[o]) {
            watch.near = 0;
            watch.dissipated = *next++;
            watch.greatest_depth = *next++;
        }
        for (Grip& grip : grips_[o]) {
            next = (std::copy_n(next, 3, grip.place.begin()), next + 3);
            next = (std::copy_n(next, 3, grip.stretch.begin()), next + 3);
            grip.holds = *next == 2;
            grip.known = *next++ != 0;
        }
    }
}

template std::size_t Contact<float>::memory_size() const;
template std::vector<double> Contact<float>::memory() const;
template void Contact<float>::set_memory(std::span<const double>);
template std::size_t Contact<double>::memory_size() const;
template std::vector<double> Contact<double>::memory() const;
template void Contact<double>::set_memory(std::span<const double>);

} // namespace hybmss
