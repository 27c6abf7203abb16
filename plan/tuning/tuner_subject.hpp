#pragma once

#include "plan/bodies/body.hpp"
#include "plan/tuning/operation.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace hybmss {

/// A body that plans are wanted for, lattice or network: what the tuner needs to know of it.
template <class T>
struct TunerSubject {
    std::string body_class;           ///< see wisdom_class
    std::vector<std::string> layouts; ///< of its kind, the default first
    std::size_t nodes;                ///< that `useful_threads` is asked with
    std::size_t cells;                ///< nodes where it has none
    std::function<std::unique_ptr<Body<T>>(const PlanOptions&)> make;
    /// A piece of it with at most about that many nodes.
    std::function<TunerSubject(std::size_t most_nodes)> sample;
};

/// The subjects refer to what they were made of; samples own it. The network must be valid.
template <class T>
TunerSubject<T> subject_of(const Lattice& lattice, const Material& material);
template <class T>
TunerSubject<T> subject_of(const Network& network);

} // namespace hybmss
