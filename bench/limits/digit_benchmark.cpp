#include "bench/benchmarks.hpp"
#include "bench/interleaved.hpp"
#include "bench/limits/box_springs.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>

namespace hybmss::bench {

namespace {

constexpr const char* kIntroduction =
    "Springs of a cube of 12^3 cells (A = 1), each node collecting its 26 springs. error: the largest of any force "
    "component\n"
    "over the largest force, against long double, for random displacements of the strain above the column. ns/cell: "
    "one\n"
    "thread; x: over the library's form (displacement, refined; exact where it does not refine the estimate), in "
    "turns.\n";

constexpr int kEdge = 12;
constexpr double kCellSize = 0.5;
constexpr double kStrains[] = {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 0.5};

template <class T>
SpringSweep<T> sweep_of(InstructionSet set, StateForm form, Root root) {
    const SpringForms& forms = spring_forms(set);
    if constexpr (std::is_same_v<T, float>) {
        return forms.float_sweeps[static_cast<int>(form)][static_cast<int>(root)];
    } else {
        return forms.double_sweeps[static_cast<int>(form)][static_cast<int>(root)];
    }
}

std::string error_key(double strain) {
    return printed("error_at_%g", strain);
}

template <class T>
void measure(benchmark::State& state, InstructionSet set, StateForm form, Root root) {
    const SpringSweep<T> sweep = sweep_of<T>(set, form, root);
    const SpringSweep<T> refined = sweep_of<T>(set, StateForm::displacement, Root::refined);
    const SpringSweep<T> usual = refined ? refined : sweep_of<T>(set, StateForm::displacement, Root::exact);
    BoxSprings<T> box(kEdge, {}, kCellSize, form), beside(kEdge, {}, kCellSize, StateForm::displacement);
    for (const double strain : kStrains) {
        box.displace(strain);
        sweep(box.grid());
        state.counters[error_key(strain)] = box.force_error();
    }
    box.displace(0.01);
    beside.displace(0.01);
    const auto repeated = [](auto one, const auto& grid) {
        return [one, &grid](long count) {
            for (long i = 0; i < count; ++i) {
                one(grid);
            }
        };
    };
    const auto [times, usual_times] = in_turns(state, repeated(sweep, box.grid()), repeated(usual, beside.grid()));
    // The least of all rounds: what else runs on the machine only ever adds time.
    const double least = *std::min_element(times.begin(), times.end());
    state.counters["ns_per_cell"] = 1e9 * least / static_cast<double>(box.cells());
    state.counters["ratio_to_usual"] = least / *std::min_element(usual_times.begin(), usual_times.end());
}

std::string heading() {
    std::string text = printed("%-44s %8s %6s", "digits", "ns/cell", "x");
    for (const double strain : kStrains) {
        text += printed(" %8.0e", strain);
    }
    return text;
}

std::string line(const std::string& name, const benchmark::BenchmarkReporter::Run& run) {
    std::string text =
        printed("%-44s %8.2f %6.2f", name.c_str(), counter(run, "ns_per_cell"), counter(run, "ratio_to_usual"));
    for (const double strain : kStrains) {
        text += printed(" %8.1e", counter(run, error_key(strain).c_str()));
    }
    return text;
}

template <class T>
void add_rows(std::vector<Row>& rows, InstructionSet set, const char* precision, double seconds) {
    for (int form = 0; form < kStateForms; ++form) {
        for (int root = 0; root < kRoots; ++root) {
            const auto f = static_cast<StateForm>(form);
            const auto r = static_cast<Root>(root);
            if (sweep_of<T>(set, f, r) == nullptr) {
                continue;
            }
            const std::string row_name = printed("digits/%s/%s/%s/%s", std::string(name(set)).c_str(), precision,
                                                 kStateFormNames[form], kRootNames[root]);
            rows.push_back({row_name, 1, heading(), std::max(5L, std::lround(seconds / (2 * kSliceSeconds))),
                            [=](benchmark::State& state) { measure<T>(state, set, f, r); },
                            [=](const auto& run) { return line(row_name, run); }});
        }
    }
}

} // namespace

Table digit_benchmark(const RowChoices& choices) {
    Table table{kIntroduction, {}};
    for (const InstructionSet set : choices.instruction_sets) {
        add_rows<float>(table.rows, set, "float", choices.seconds);
        add_rows<double>(table.rows, set, "double", choices.seconds);
    }
    return table;
}

} // namespace hybmss::bench
