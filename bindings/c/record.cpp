#include "hybmss/record.hpp"

#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"

#include <cmath>
#include <cstdio>
#include <string>

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_record {
    Record record;
    std::size_t nodes;
    mutable Scratch<float> float_scratch;
    mutable Scratch<double> double_scratch;

    explicit hybmss_record(Record given) : record(std::move(given)), nodes(record.lattice.nodes().size()) {}
    const RecordedState& state(std::size_t number) const {
        if (number >= record.states.size()) {
            throw std::invalid_argument("state = " + std::to_string(number) + " is not allowed: the record has " +
                                        std::to_string(record.states.size()) + " states");
        }
        return record.states[number];
    }
};

namespace {

template <class T>
void write_displacements(const RecordedState& state, std::size_t nodes, Scratch<T>& scratch,
                         const hybmss_field* displacements) {
    check<T>(displacements, nodes, "displacements");
    const Output<T> out(*displacements, nodes, scratch);
    T* const to[3] = {out.view().x, out.view().y, out.view().z};
    for (std::size_t n = 0; n < nodes; ++n) {
        for (std::size_t c = 0; c < 3; ++c) {
            to[c][static_cast<std::ptrdiff_t>(n) * out.view().stride] = static_cast<T>(state.displacements[n][c]);
        }
    }
    out.set();
}

template <class T>
RecordDifference force_difference(const hybmss_record& record, std::size_t state, Scratch<T>& scratch,
                                  const hybmss_const_field* forces) {
    check<T>(forces, record.nodes, "forces");
    return compare_forces<T>(record.record, state, Input<T>(*forces, record.nodes, scratch).view());
}

/// HYBMSS_OK, or HYBMSS_MISMATCH with its message.
hybmss_status verdict(const RecordDifference& difference, const std::string& what, double* error) {
    if (error) {
        *error = difference.error;
    }
    if (difference.within()) {
        return HYBMSS_OK;
    }
    char figures[96];
    std::snprintf(figures, sizeof figures, "%.3g, tolerance %.3g", difference.error, difference.tolerance);
    return fail(HYBMSS_MISMATCH, (what + " differ from the recorded ones: relative error " + figures).c_str());
}

} // namespace

extern "C" {

hybmss_status hybmss_record_load(const char* path, hybmss_record** record) {
    return guarded([&] {
        require(record, "record");
        require(path, "path");
        *record = new hybmss_record(load_record(path));
    });
}

hybmss_status hybmss_record_parse(const char* text, size_t length, hybmss_record** record) {
    return guarded([&] {
        require(record, "record");
        require(text, "text", length);
        *record = new hybmss_record(parse_record({text, length}, "record"));
    });
}

void hybmss_record_destroy(hybmss_record* record) {
    delete record;
}

hybmss_status hybmss_record_body(const hybmss_record* record, hybmss_body** body) {
    return guarded([&] {
        require(record, "record");
        require(body, "body");
        *body = new hybmss_body{LatticeBody{record->record.lattice, record->record.material}, record->nodes};
    });
}

hybmss_status hybmss_record_state_count(const hybmss_record* record, size_t* count) {
    return guarded([&] {
        require(record, "record");
        require(count, "count");
        *count = record->record.states.size();
    });
}

hybmss_status hybmss_record_displacements(const hybmss_record* record, size_t state,
                                          const hybmss_field* displacements) {
    return guarded([&] {
        require(record, "record");
        require(displacements, "displacements");
        const RecordedState& recorded = record->state(state);
        if (is_double(displacements->precision, "displacements precision")) {
            write_displacements<double>(recorded, record->nodes, record->double_scratch, displacements);
        } else {
            write_displacements<float>(recorded, record->nodes, record->float_scratch, displacements);
        }
    });
}

hybmss_status hybmss_record_compare_forces(const hybmss_record* record, size_t state, const hybmss_const_field* forces,
                                           double* error) {
    hybmss_status found = HYBMSS_OK;
    const hybmss_status status = guarded([&] {
        require(record, "record");
        require(forces, "forces");
        record->state(state);
        const RecordDifference difference =
            is_double(forces->precision, "forces precision")
                ? force_difference<double>(*record, state, record->double_scratch, forces)
                : force_difference<float>(*record, state, record->float_scratch, forces);
        found =
            verdict(difference,
                    "state " + std::to_string(state) + ": forces on node " + std::to_string(difference.node), error);
    });
    return status == HYBMSS_OK ? found : status;
}

hybmss_status hybmss_record_compare_energy(const hybmss_record* record, size_t state, hybmss_precision precision,
                                           double springs, double volume, double* error) {
    hybmss_status found = HYBMSS_OK;
    const hybmss_status status = guarded([&] {
        require(record, "record");
        record->state(state);
        const PotentialEnergy energy{springs, volume};
        const RecordDifference difference = is_double(precision, "precision")
                                                ? compare_energy<double>(record->record, state, energy)
                                                : compare_energy<float>(record->record, state, energy);
        found = verdict(difference, "state " + std::to_string(state) + ": energies", error);
    });
    return status == HYBMSS_OK ? found : status;
}

} // extern "C"
