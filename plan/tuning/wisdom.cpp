#include "hybmss/wisdom.hpp"

#include "layouts/lattice/lattice_arrays.hpp"
#include "layouts/messages.hpp"
#include "layouts/network/network_geometry.hpp"
#include "layouts/read_file.hpp"
#include "plan/bodies/plan_description.hpp"
#include "plan/threads/workers.hpp"
#include "plan/tuning/tuner_subject.hpp"
#include "plan/tuning/wisdom_store.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <fstream>
#include <limits>
#include <system_error>

namespace hybmss {
namespace {

std::string cause(int error) {
    return std::generic_category().message(error);
}

std::string size_class(std::size_t nodes) {
    const auto sized = static_cast<double>(std::clamp<std::size_t>(nodes, 1, kTunerSampleNodes));
    return printed(" nodes:2^%.1f", 0.5 * std::round(2 * std::log2(sized)));
}

std::string volume_class(kernels::Volume volume) {
    constexpr const char* kNames[] = {" no-volume", " quadratic", " mean-stretch"};
    return kNames[static_cast<int>(volume)];
}

bool numbered_locally(const Network& network) {
    double sum = 0, springs = 0;
    for_each_spring(network, [&](std::int32_t a, std::int32_t b, double, double) {
        sum += std::abs(static_cast<double>(b) - a);
        ++springs;
    });
    const double mean = sum / std::max(springs, 1.0);
    return mean < std::pow(static_cast<double>(network.masses.size()), 5.0 / 6) / std::sqrt(3.0);
}

/// " fill:3/8 active:4/8": of the cells, and, where that may decide, of the rows.
std::string fill_class(const Lattice& lattice) {
    const auto eighths = [](double part) { return std::to_string(static_cast<int>(std::ceil(8 * part))) + "/8"; };
    const double fill = static_cast<double>(lattice.cell_count()) / static_cast<double>(lattice.cell_scales().size());
    return " fill:" + eighths(fill) + (fill <= 0.6 ? " active:" + eighths(active_share(lattice)) : "");
}

} // namespace

Wisdom::Wisdom() : implementation_(std::make_unique<Implementation>()) {}
Wisdom::Wisdom(const Wisdom& other) : Wisdom() {
    merge(other);
}
Wisdom::Wisdom(Wisdom&&) noexcept = default;
Wisdom& Wisdom::operator=(Wisdom other) noexcept {
    implementation_.swap(other.implementation_);
    return *this;
}
Wisdom::~Wisdom() = default;

void Wisdom::merge(const Wisdom& other) {
    if (&other == this) {
        return;
    }
    WisdomEntries theirs;
    {
        const std::lock_guard lock(other.implementation_->mutex);
        theirs = other.implementation_->entries;
    }
    const std::lock_guard lock(implementation_->mutex);
    // What this one alone has is what stays in `entries` after the swap.
    theirs.merge(implementation_->entries);
    implementation_->entries.swap(theirs);
}

std::size_t Wisdom::entries() const {
    const std::lock_guard lock(implementation_->mutex);
    return implementation_->entries.size();
}

void Wisdom::import_text(std::string_view text, const std::string& name) {
    Wisdom imported;
    imported.implementation_->entries = parse_wisdom(text, name);
    merge(imported);
}

void Wisdom::import_file(const std::filesystem::path& path) {
    constexpr std::uintmax_t kMostBytes = std::uintmax_t{1} << 26; // some 1e5 bodies
    std::string text;
    try {
        text = read_file(path, Readable::regular_file, kMostBytes);
    } catch (const ReadError& error) {
        throw WisdomError(path.string() + ": cannot be read: " + error.reason);
    }
    import_text(text, path.string());
}

std::string Wisdom::export_text() const {
    const std::lock_guard lock(implementation_->mutex);
    return wisdom_text(implementation_->entries);
}

void Wisdom::export_file(const std::filesystem::path& path) const {
    const std::string text = export_text();
    // One name a process: two that tune at the same time must not write into one file.
    std::filesystem::path partial = path;
    partial += ".partial-" + std::to_string(getpid());
    const auto fail = [&](int error) {
        std::error_code ignored;
        std::filesystem::remove(partial, ignored);
        throw WisdomError(path.string() + ": cannot be written: " + cause(error));
    };
    errno = 0;
    std::ofstream file(partial, std::ios::binary | std::ios::trunc);
    file << text;
    file.close();
    if (!file) {
        fail(errno);
    }
    std::error_code error;
    std::filesystem::rename(partial, path, error);
    if (error) {
        fail(error.value());
    }
}

std::optional<WisdomEntry> WisdomStore::find(const Wisdom& wisdom, const std::string& key) {
    const std::lock_guard lock(wisdom.implementation_->mutex);
    const auto found = wisdom.implementation_->entries.find(key);
    return found == wisdom.implementation_->entries.end() ? std::nullopt : std::optional(found->second);
}

void WisdomStore::put(Wisdom& wisdom, const std::string& key, WisdomEntry entry) {
    const std::lock_guard lock(wisdom.implementation_->mutex);
    wisdom.implementation_->entries.insert_or_assign(key, std::move(entry));
}

template <class T>
std::string body_class(const Lattice& lattice, const Material& material) {
    return "lattice " + precision_name<T>() +
           (material.face_diagonal_ratio > 0 ? " face-diagonals" : " no-face-diagonals") +
           (material.springs == SpringForm::means ? " springs-on-means" : "") +
           (material.crush.any() ? " crush-resistance" : "") +
           (has_own_volumes(lattice, material) ? " own-volumes" : "") + volume_class(kernel_volume(lattice, material)) +
           size_class(lattice.nodes().size()) + fill_class(lattice) +
           " axes:" + word_of(axes_by_cost(lattice, true).front());
}

template <class T>
std::string body_class(const Network& network) {
    return "network " + precision_name<T>() + (cells_of(network, true).empty() ? "" : " springs-on-means") +
           (network.polyhedra.empty() ? ""
            : network.nodal_volumes   ? " nodal-volumes"
                                      : " polyhedra") +
           volume_class(kernel_volume(network)) + size_class(network.masses.size()) +
           " numbering:" + (numbered_locally(network) ? "local" : "scattered");
}

std::string wish_class(const PlanOptions& options) {
    const bool any_set = options.instruction_set == InstructionSet::automatic && !instruction_set_is_forced();
    return "layout:" + (options.layout.empty() ? "any" : options.layout) +
           " isa:" + (any_set ? "any" : std::string(name(resolve(options.instruction_set)))) +
           " accuracy:" + std::string(name(options.accuracy)) +
           " threads:" + std::to_string(useful_threads(options, std::numeric_limits<std::size_t>::max())) +
           (options.one_tile ? " one-tile" : "");
}

template std::string body_class<float>(const Lattice&, const Material&);
template std::string body_class<double>(const Lattice&, const Material&);
template std::string body_class<float>(const Network&);
template std::string body_class<double>(const Network&);

} // namespace hybmss
