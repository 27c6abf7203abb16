// The text of a record, one fact a line:
//
//     hybmss-record 1
//     library 0.1.0
//     cells NX NY NZ
//     cell_size H
//     scales full | one number a cell
//     material E NU DENSITY A VOLUME_ENERGY
//     tolerance FLOAT DOUBLE
//     nodes N
//     states S
//     state TIME FORCE_SCALE SPRINGS VOLUME       S times, each with N lines of
//     UX UY UZ FX FY FZ
//     end CHECKSUM                                FNV-1a of everything before this line, in hexadecimal

#include "hybmss/record.hpp"

#include "hybmss/version.hpp"
#include "layouts/messages.hpp"
#include "layouts/read_file.hpp"
#include "plan/tuning/digest.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

namespace hybmss {
namespace {

/// Behind a material's volume energy, where its springs are.
constexpr std::string_view kOnMeans = "on-means";
constexpr std::string_view kCrush = "crush"; // and its stiffness and ratio
constexpr std::string_view kVolumeEnergies[] = {"automatic", "quadratic", "mean-stretch", "none"};

void append(std::string& text, double value) {
    text += printed(" %.17g", value);
}

/// "word", cut where it is long.
std::string quoted(std::string_view word) {
    std::string text(1, '"');
    text.append(word.substr(0, 40)).append(1, '"');
    return text;
}

/// Reads words line by line.
class Reader {
public:
    Reader(std::string_view text, const std::string& name) : rest_(text), name_(name) {}

    [[noreturn]] void refuse(const std::string& reason) const {
        throw RecordError(name_ + ":" + std::to_string(line_number_) + ": " + reason);
    }
    /// The next line, which must begin with `key` ("" for any).
    void line(std::string_view key) {
        ++line_number_;
        const std::size_t end = rest_.find('\n');
        if (end == std::string_view::npos) {
            refuse("the record ends too early");
        }
        line_ = rest_.substr(0, end);
        rest_.remove_prefix(end + 1);
        if (!key.empty() && word() != key) {
            refuse(quoted(key) + " is expected here");
        }
    }
    std::string_view word() {
        if (line_.empty()) {
            refuse("the line has too few entries");
        }
        const std::size_t end = std::min(line_.find(' '), line_.size());
        const std::string_view word = line_.substr(0, end);
        line_.remove_prefix(std::min(end + 1, line_.size()));
        return word;
    }
    template <class Number>
    Number number() {
        const std::string_view text = word();
        Number value{};
        if (!parse_number(text, value)) {
            refuse(quoted(text) + " is not a number that is allowed here");
        }
        if constexpr (std::is_floating_point_v<Number>) {
            if (!std::isfinite(value)) {
                refuse(quoted(text) + " is not finite");
            }
        }
        return value;
    }
    bool at_end_of_line() const { return line_.empty(); }
    void end_line() const {
        if (!line_.empty()) {
            refuse("the line has too many entries");
        }
    }
    std::size_t left() const { return rest_.size(); }

private:
    std::string_view rest_, line_;
    std::string name_;
    std::size_t line_number_ = 0;
};

/// What comes before the last line, whose checksum must be its own.
std::string_view checked(std::string_view text, const std::string& name) {
    if (!text.starts_with("hybmss-record ")) {
        throw RecordError(name + ":1: this is no record: it must begin with \"hybmss-record\"");
    }
    constexpr std::size_t kLength = 4 + 16 + 1; // "end ", digits, end of line
    const bool long_enough = text.size() > kLength;
    const std::string_view last = long_enough ? text.substr(text.size() - kLength) : text;
    const std::string_view before = text.substr(0, text.size() - last.size());
    if (!last.starts_with("end ") || !before.ends_with('\n')) {
        throw RecordError(name + ": the record is cut short: its last line must be \"end\" and a checksum");
    }
    if (last.substr(4, 16) != hexadecimal_digest(before) || !last.ends_with('\n')) {
        throw RecordError(name + ": the record is damaged: its checksum differs");
    }
    return before;
}

Lattice read_lattice(Reader& reader) {
    reader.line("cells");
    int cells[3];
    for (int& count : cells) {
        count = reader.number<int>();
    }
    reader.end_line();
    reader.line("cell_size");
    const auto cell_size = reader.number<double>();
    reader.end_line();
    reader.line("scales");
    const std::string_view first = reader.word();
    std::vector<float> scales;
    if (first == "full") {
        // Every node will have a line: no more memory than the text has room for.
        const double nodes = (cells[0] + 1.0) * (cells[1] + 1.0) * (cells[2] + 1.0);
        if (!(nodes <= static_cast<double>(reader.left()))) {
            reader.refuse("cells make more nodes than the record has room for");
        }
        reader.end_line();
        return Lattice::box(cells[0], cells[1], cells[2], cell_size);
    }
    for (std::string_view word = first;; word = reader.word()) {
        float scale = 0;
        if (!parse_number(word, scale)) {
            reader.refuse(quoted(word) + " is not a stiffness scale");
        }
        scales.push_back(scale);
        if (reader.at_end_of_line()) {
            break;
        }
    }
    if (static_cast<double>(cells[0]) * cells[1] * cells[2] != static_cast<double>(scales.size())) {
        reader.refuse(std::to_string(scales.size()) + " scales are not one for each cell");
    }
    return Lattice::from_cells(cells[0], cells[1], cells[2], cell_size, std::move(scales));
}

Material read_material(Reader& reader) {
    reader.line("material");
    Material material;
    for (double* value : {&material.young_modulus, &material.poisson_ratio, &material.density,
                          &material.face_diagonal_ratio, &material.stiffening.quadratic, &material.stiffening.cubic}) {
        *value = reader.number<double>();
    }
    const std::string_view energy = reader.word();
    const auto* known = std::find(std::begin(kVolumeEnergies), std::end(kVolumeEnergies), energy);
    if (known == std::end(kVolumeEnergies)) {
        reader.refuse(quoted(energy) + " is no volume energy: automatic, quadratic, mean-stretch or none");
    }
    material.volume_energy = static_cast<VolumeEnergy>(known - std::begin(kVolumeEnergies));
    while (!reader.at_end_of_line()) {
        if (const std::string_view word = reader.word(); word == kOnMeans) {
            material.springs = SpringForm::means;
        } else if (word == kCrush) {
            material.crush = {reader.number<double>(), reader.number<double>()};
        } else {
            reader.refuse(quoted(word) + " says nothing of a material: on-means, crush, or nothing");
        }
    }
    reader.end_line();
    validate(material);
    return material;
}

RecordedState read_state(Reader& reader, std::size_t nodes) {
    reader.line("state");
    RecordedState state;
    for (double* value : {&state.time, &state.force_scale, &state.energy.springs, &state.energy.volume}) {
        *value = reader.number<double>();
    }
    reader.end_line();
    if (!(state.force_scale > 0)) {
        reader.refuse("the scale of the forces must be above 0");
    }
    for (std::size_t n = 0; n < nodes; ++n) {
        reader.line("");
        for (auto* vectors : {&state.displacements, &state.forces}) {
            const auto x = reader.number<double>(), y = reader.number<double>();
            vectors->push_back({x, y, reader.number<double>()});
        }
        reader.end_line();
    }
    return state;
}

Record read(Reader& reader) {
    Record record;
    reader.line("hybmss-record");
    if (const auto version = reader.number<int>(); version != 1) {
        reader.refuse("version " + std::to_string(version) + " of the format; this library reads version 1");
    }
    reader.end_line();
    reader.line("library");
    record.library_version = reader.word();
    reader.end_line();
    record.lattice = read_lattice(reader);
    record.material = read_material(reader);
    reader.line("tolerance");
    record.float_tolerance = reader.number<double>();
    record.double_tolerance = reader.number<double>();
    reader.end_line();
    if (!(record.float_tolerance >= 0 && record.double_tolerance >= 0)) {
        reader.refuse("a tolerance must be at least 0");
    }
    reader.line("nodes");
    const auto nodes = reader.number<std::size_t>();
    reader.end_line();
    if (nodes != record.lattice.nodes().size() || nodes == 0) {
        reader.refuse("nodes = " + std::to_string(nodes) + ", but the cells have " +
                      std::to_string(record.lattice.nodes().size()));
    }
    reader.line("states");
    const auto states = reader.number<std::size_t>();
    reader.end_line();
    while (record.states.size() < states) {
        record.states.push_back(read_state(reader, nodes));
    }
    if (reader.left() > 0) {
        reader.line("");
        reader.refuse("there is more than the states announced");
    }
    return record;
}

} // namespace

std::string record_text(const Record& record) {
    if (!record.lattice.tissues().empty() || !record.lattice.fills().empty()) {
        throw std::invalid_argument(
            "record: it has one poisson_ratio and one density, and cannot hold cells that differ in these");
    }
    std::string text = "hybmss-record 1\nlibrary ";
    text.append(kVersion).append("\ncells");
    for (const int count : record.lattice.cells()) {
        text.append(" ").append(std::to_string(count));
    }
    text += "\ncell_size";
    append(text, record.lattice.cell_size());
    text += "\nscales";
    const std::span<const float> scales = record.lattice.cell_scales();
    if (std::all_of(scales.begin(), scales.end(), [](float scale) { return scale == 1; })) {
        text += " full";
    } else {
        for (const float scale : scales) {
            append(text, static_cast<double>(scale));
        }
    }
    const Material& m = record.material;
    text += "\nmaterial";
    for (const double value : {m.young_modulus, m.poisson_ratio, m.density, m.face_diagonal_ratio,
                               m.stiffening.quadratic, m.stiffening.cubic}) {
        append(text, value);
    }
    text.append(" ").append(kVolumeEnergies[static_cast<std::size_t>(m.volume_energy)]);
    if (m.springs == SpringForm::means) {
        text.append(" ").append(kOnMeans);
    }
    if (m.crush.any()) {
        text.append(" ").append(kCrush);
        append(text, m.crush.stiffness);
        append(text, m.crush.ratio);
    }
    text.append("\ntolerance");
    append(text, record.float_tolerance);
    append(text, record.double_tolerance);
    text += "\nnodes " + std::to_string(record.lattice.nodes().size()) + "\nstates " +
            std::to_string(record.states.size()) + "\n";
    for (const RecordedState& state : record.states) {
        text += "state";
        for (const double value : {state.time, state.force_scale, state.energy.springs, state.energy.volume}) {
            append(text, value);
        }
        text += "\n";
        for (std::size_t n = 0; n < state.displacements.size(); ++n) {
            std::string line;
            for (const auto* vectors : {&state.displacements, &state.forces}) {
                for (const double value : (*vectors)[n]) {
                    append(line, value);
                }
            }
            text += line.substr(1) + "\n";
        }
    }
    return text + "end " + hexadecimal_digest(text) + "\n";
}

Record parse_record(std::string_view text, const std::string& name) {
    Reader reader(checked(text, name), name);
    try {
        return read(reader);
    } catch (const std::invalid_argument& error) {
        reader.refuse(error.what());
    }
}

Record load_record(const std::filesystem::path& path) {
    constexpr std::uintmax_t kMostBytes = 2'000'000'000; // some 1e7 nodes
    std::string text;
    try {
        text = read_file(path, Readable::file_or_pipe, kMostBytes);
    } catch (const ReadError& error) {
        throw RecordError(path.string() + ": cannot be read: " + error.reason);
    }
    return parse_record(text, path.string());
}

} // namespace hybmss
