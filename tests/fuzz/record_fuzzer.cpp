// Records, as they come and with a checksum that fits: else nothing beyond the checksum would be reached.

#include "hybmss/record.hpp"
#include "tests/fuzz/fuzz_input.hpp"

#include <cstdio>
#include <string>

using namespace hybmss;

namespace {

std::string with_checksum(std::string_view text) {
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const char c : text) {
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    }
    char last[32];
    std::snprintf(last, sizeof last, "end %016llx\n", static_cast<unsigned long long>(hash));
    return std::string(text) + last;
}

void read(std::string_view text) {
    Record record;
    try {
        record = parse_record(text, "record");
    } catch (const RecordError& error) {
        fuzz::require_one_line(error.what());
        return;
    }
    // What is accepted is written as something that reads back as the same.
    const std::string again = record_text(record);
    fuzz::require(record_text(parse_record(again, "record")) == again, "the record reads back as another");
    const std::size_t nodes = record.lattice.nodes().size();
    for (std::size_t s = 0; s < record.states.size(); ++s) {
        const double* forces = record.states[s].forces[0].data();
        fuzz::require(record.states[s].forces.size() == nodes, "not one force a node");
        fuzz::require(compare_forces(record, s, VectorField<const double>::aos(forces, nodes)).error == 0,
                      "recorded forces differ from themselves");
        compare_energy<float>(record, s, record.states[s].energy);
    }
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    read(fuzz::text(data, size));
    read(with_checksum(fuzz::text(data, size)));
    return 0;
}
