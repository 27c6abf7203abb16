#pragma once

/// \file
/// Recorded states of a body with the forces that belong to them: what another program checks its use of the library
/// against, in its own tests. `hybmss record` makes such files, from the scalar reference.

#include "hybmss/export.h"
#include "hybmss/force_plan.hpp"
#include "hybmss/lattice.hpp"
#include "hybmss/material.hpp"
#include "hybmss/vector_field.hpp"

#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace hybmss {

/// Why a record was refused, in one line: `FILE:LINE: reason`. Also thrown where a file cannot be read.
class HYBMSS_EXPORT RecordError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

struct RecordedState {
    double time = 0;                                  ///< s
    std::vector<std::array<double, 3>> displacements; ///< m, one a node, in the body's node order
    std::vector<std::array<double, 3>> forces;        ///< N, internal
    /// N, > 0: the largest sum over one node of the magnitudes of what acts on it. Errors are measured by it, since
    /// forces themselves may cancel.
    double force_scale = 1;
    PotentialEnergy energy; ///< J
};

struct Record {
    std::string library_version; ///< that made it
    Lattice lattice = Lattice::box(1, 1, 1, 1);
    Material material;
    /// The largest error of a force component, by `force_scale`, and of the energy, relative, that passes.
    double float_tolerance = 1e-5, double_tolerance = 1e-11;
    std::vector<RecordedState> states;
};

/// How far given forces or energies are from the recorded ones.
struct RecordDifference {
    double error = 0;     ///< as the tolerances are meant; infinite where a number is not finite
    double tolerance = 0; ///< of the precision given
    std::size_t node = 0; ///< of the largest error; 0 for an energy
    bool within() const { return error <= tolerance; }
};

/// The text of a record, and back. parse_record takes all or nothing: throws RecordError for a text that is no record,
/// of another version, damaged (its last line is a checksum) or inconsistent; `name` stands for the file in messages.
HYBMSS_EXPORT std::string record_text(const Record& record);
HYBMSS_EXPORT Record parse_record(std::string_view text, const std::string& name);
HYBMSS_EXPORT Record load_record(const std::filesystem::path& path);

/// Compares forces at the displacements of one state, in the body's node order. T is float or double. Throws
/// std::invalid_argument for a state that is not there or a size that differs.
template <class T>
RecordDifference compare_forces(const Record& record, std::size_t state, VectorField<const T> forces);
template <class T>
RecordDifference compare_energy(const Record& record, std::size_t state, const PotentialEnergy& energy);

extern template HYBMSS_EXPORT RecordDifference compare_forces<float>(const Record&, std::size_t,
                                                                     VectorField<const float>);
extern template HYBMSS_EXPORT RecordDifference compare_forces<double>(const Record&, std::size_t,
                                                                      VectorField<const double>);
extern template HYBMSS_EXPORT RecordDifference compare_energy<float>(const Record&, std::size_t,
                                                                     const PotentialEnergy&);
extern template HYBMSS_EXPORT RecordDifference compare_energy<double>(const Record&, std::size_t,
                                                                      const PotentialEnergy&);

} // namespace hybmss
