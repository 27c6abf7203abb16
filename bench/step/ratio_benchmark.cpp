#include "bench/step/ratio_benchmark.hpp"

namespace hybmss::bench {

const char* const kRatioIntroduction = "Two bodies in the same rounds; medians of the rounds' ratios. `by count`: the "
                                       "speed-up if time went by the vector\n"
                                       "operations of the inner loop; `random / ordered`, `/ 64^3`: time of a step, or "
                                       "of a filled cell, over the other's.\n";

std::vector<Row> ratio_benchmark(const RowChoices& choices, double seconds) {
    std::vector<Row> rows;
    const auto append = [&](auto make, std::array<int, 3> mesh, Model model, const char* layout, int wall) {
        for (const InstructionSet set : choices.instruction_sets) {
            for (const Precision precision : choices.precisions) {
                for (const int threads : choices.threads) {
                    rows.push_back(
                        make({mesh, model, layout, set, precision, threads, choices.accuracy, wall}, seconds));
                }
            }
        }
    };
    for (const int edge : {20, 32, 64}) {
        for (const Model model : {Model::without_correction_forces, Model::without_face_diagonals}) {
            append(model_row, {edge, edge, edge}, model, "flat-rows", 0);
        }
    }
    for (const Model model : {Model::hybmss, Model::without_correction_forces}) {
        append(numbering_row, {64, 64, 64}, model, "network", 0);
    }
    for (const int edge : {128, 256}) {
        append(filled_row, {edge, edge, edge}, Model::hybmss, "lattice", 4);
    }
    return rows;
}

} // namespace hybmss::bench
