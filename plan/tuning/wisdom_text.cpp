#include "hybmss/plan_options.hpp"
#include "hybmss/version.hpp"
#include "layouts/messages.hpp"
#include "plan/tuning/digest.hpp"
#include "plan/tuning/wisdom_store.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>

namespace hybmss {
namespace {

constexpr std::string_view kChecksum = "checksum = ";

// ---- where wisdom comes from

/// One line of the head of a wisdom file: wisdom with another value is not for this machine or this build.
struct WisdomFact {
    std::string key, value;
    std::string otherwise; ///< what wisdom is that says something else: "foreign" or "stale", and why
};

/// Schema, library version, CPU model, instruction sets, layouts and a digest of the kernels, in the order in which a
/// file holds them.
std::vector<WisdomFact> wisdom_facts() {
    return {{"schema", "4", "foreign: written in another schema"},
            {"version", kVersion, "stale: written by another version of hybmss"},
            {"cpu", cpu_model(), "foreign: measured on another CPU"},
            {"instruction_sets", instruction_set_names(), "foreign: measured with other instruction sets"},
            {"lattice_layouts", joined(lattice_layouts(), " "), "stale: measured among other lattice layouts"},
            {"network_layouts", joined(network_layouts(), " "), "stale: measured among other network layouts"},
            {"kernels", HYBMSS_KERNEL_REVISION, "stale: measured with other kernels or another compiler"}};
}

// ---- text

struct Line {
    std::size_t number = 0;
    std::string_view key, value;
};

/// The lines of a wisdom text that say something, one after the other; an end with an empty key.
class Lines {
public:
    Lines(std::string_view text, std::string name) : text_(text), name_(std::move(name)) { next(); }

    const Line& line() const { return line_; }

    void next() {
        while (!text_.empty()) {
            const std::size_t end = std::min(text_.find('\n'), text_.size());
            const std::string_view whole = text_.substr(0, end);
            text_.remove_prefix(std::min(end + 1, text_.size()));
            ++number_;
            if (whole.empty() || whole.front() == '#') {
                continue;
            }
            const std::size_t equals = whole.find(" = ");
            line_ = {number_, whole.substr(0, equals),
                     equals == std::string_view::npos ? std::string_view() : whole.substr(equals + 3)};
            if (line_.key.empty() || line_.value.empty()) {
                refuse("damaged: \"" + shown(whole) + "\" is not of the form key = value");
            }
            return;
        }
        line_ = {number_ + 1, {}, {}};
    }

    /// Of the line at hand, whose key must be this one.
    std::string_view value_of(const std::string& key) const {
        if (line_.key != key) {
            refuse("damaged: the key \"" + shown(line_.key) + "\" stands where \"" + key + "\" must");
        }
        return line_.value;
    }

    [[noreturn]] void refuse(const std::string& reason) const {
        throw WisdomError(name_ + ":" + std::to_string(line_.number) + ": wisdom refused, " + reason);
    }

    /// Fit for one line of a message, whatever the file holds.
    static std::string shown(std::string_view text) {
        std::string clean(text.substr(0, 80));
        std::replace_if(
            clean.begin(), clean.end(), [](unsigned char c) { return !std::isprint(c); }, '?');
        return clean + (text.size() > 80 ? "..." : "");
    }

private:
    std::string_view text_;
    std::string name_;
    std::size_t number_ = 0;
    Line line_;
};

/// The text without its checksum, which must be right.
std::string_view checked_body(std::string_view text, const std::string& name) {
    const std::size_t last_line =
        static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + (text.ends_with('\n') ? 0 : 1);
    const auto refuse = [&](const std::string& reason) {
        throw WisdomError(name + ":" + std::to_string(std::max<std::size_t>(last_line, 1)) + ": wisdom refused, " +
                          reason);
    };
    const std::size_t start =
        text.ends_with('\n') && text.size() > 1 ? text.rfind('\n', text.size() - 2) : std::string_view::npos;
    if (start == std::string_view::npos || !text.substr(start + 1).starts_with(kChecksum)) {
        refuse("damaged: the last line is not a checksum, so the file is cut short");
    }
    const std::string_view body = text.substr(0, start + 1);
    if (text.substr(start + 1) != wisdom_checksum_line(body)) {
        refuse("damaged: the checksum does not fit what the file holds");
    }
    return body;
}

/// "KEY = VALUE", as this build on this machine would write it.
void require(Lines& lines, const WisdomFact& fact) {
    if (const std::string_view value = lines.value_of(fact.key); value != fact.value) {
        lines.refuse(fact.otherwise + " (there: " + Lines::shown(value) + "; here: " + fact.value + ")");
    }
    lines.next();
}

/// "12.5 final flat-rows/avx2/fast/threads:1", or "early" for one that was dropped.
CandidateFigure parse_figure(const Lines& lines) {
    const std::string_view text = lines.line().value;
    const std::size_t first = text.find(' '), second = text.find(' ', first + 1);
    const auto refuse = [&] {
        lines.refuse("damaged: the figure \"" + Lines::shown(text) +
                     "\" is not of the form NANOSECONDS final|early CANDIDATE");
    };
    if (first == std::string_view::npos || second == std::string_view::npos) {
        refuse();
    }
    CandidateFigure figure;
    const std::string_view word = text.substr(first + 1, second - first - 1);
    figure.name = text.substr(second + 1);
    figure.finalist = word == "final";
    if (!parse_number(text.substr(0, first), figure.ns_per_cell_step) || !std::isfinite(figure.ns_per_cell_step) ||
        figure.ns_per_cell_step <= 0 || (word != "final" && word != "early") || !parse_candidate(figure.name)) {
        refuse();
    }
    return figure;
}

WisdomEntry parse_entry(Lines& lines) {
    const std::string chosen(lines.value_of("choice"));
    const std::optional<Candidate> choice = parse_candidate(chosen);
    if (!choice) {
        lines.refuse("damaged: the choice \"" + Lines::shown(chosen) +
                     "\" is not of the form LAYOUT/ISA/ACCURACY/threads:N[/one-tile]");
    }
    WisdomEntry entry{*choice, {}};
    const Lines at_choice = lines;
    lines.next();
    while (lines.line().key == "figure") {
        entry.figures.push_back(parse_figure(lines));
        lines.next();
    }
    if (std::none_of(entry.figures.begin(), entry.figures.end(),
                     [&](const CandidateFigure& figure) { return figure.name == chosen; })) {
        at_choice.refuse("damaged: the choice " + Lines::shown(chosen) + " has no figure");
    }
    return entry;
}

} // namespace

std::string cpu_model() {
    std::ifstream cpuinfo("/proc/cpuinfo");
    std::string line, arm;
    while (std::getline(cpuinfo, line) && !line.empty()) {
        const auto colon = line.find(": ");
        if (colon == std::string::npos) {
            continue;
        }
        std::string value = line.substr(colon + 2);
        if (line.starts_with("model name")) {
            return value;
        }
        if (line.starts_with("CPU implementer") || line.starts_with("CPU variant") || line.starts_with("CPU part")) {
            arm += (arm.empty() ? "" : " ") + value;
        }
    }
    return arm.empty() ? "unknown" : arm;
}

std::string instruction_set_names() {
    std::vector<std::string> names;
    for (const InstructionSet set : available_instruction_sets()) {
        names.emplace_back(name(set));
    }
    return joined(names, " ");
}

std::string wisdom_checksum_line(std::string_view body) {
    return std::string(kChecksum) + hexadecimal_digest(body) + "\n";
}

std::string wisdom_text(const WisdomEntries& entries) {
    std::string text = "# What hybmss measured. The checksum at the end refuses changes by hand.\n";
    for (const WisdomFact& fact : wisdom_facts()) {
        text += fact.key + " = " + fact.value + "\n";
    }
    for (const auto& [key, entry] : entries) {
        text += "\nbody = " + key + "\nchoice = " + name(entry.choice) + "\n";
        for (const CandidateFigure& figure : entry.figures) {
            text += printed("figure = %.4g ", figure.ns_per_cell_step) + (figure.finalist ? "final " : "early ") +
                    figure.name + "\n";
        }
    }
    return text + wisdom_checksum_line(text);
}

WisdomEntries parse_wisdom(std::string_view text, const std::string& name) {
    const std::vector<WisdomFact> facts = wisdom_facts();
    // The schema before the checksum: another schema may sum otherwise.
    Lines head(text, name);
    require(head, facts.front());

    Lines lines(checked_body(text, name), name);
    for (const WisdomFact& fact : facts) {
        require(lines, fact);
    }
    WisdomEntries entries;
    while (!lines.line().key.empty()) {
        const std::string key(lines.value_of("body"));
        if (entries.contains(key)) {
            lines.refuse("damaged: a second entry for \"" + Lines::shown(key) + "\"");
        }
        lines.next();
        entries.emplace(key, parse_entry(lines));
    }
    return entries;
}

} // namespace hybmss
