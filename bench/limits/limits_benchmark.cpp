#include "bench/limits/limits_benchmark.hpp"

#include "bench/limits/bandwidth_benchmark.hpp"
#include "bench/limits/issue_benchmark.hpp"
#include "bench/limits/step_limits_benchmark.hpp"

namespace hybmss::bench {

const char* const kLimitsIntroduction =
    "slots/16: vector-arithmetic operations per 16 cells, counted by running the kernel's text on values that count;\n"
    "mul, add, other, stores: the same per vector. B in, B out: bytes of the body's arrays that a step reads and "
    "writes\n"
    "per node. arith., memory: the least ns per cell. All from the fastest of interleaved rounds; one thread.\n";

std::vector<Row> limits_benchmark(const RowChoices& choices, double seconds) {
    std::vector<Row> rows;
    const auto times = std::make_shared<FastestTimes>();
    for (InstructionSet set : choices.instruction_sets) {
        for (Precision precision : choices.precisions) {
            rows.push_back(issue_row(set, precision, seconds, times));
        }
        rows.push_back(bandwidth_row(set, seconds));
        for (Precision precision : choices.precisions) {
            for (int edge : {20, 32, 64}) {
                for (Model model : {Model::hybmss, Model::without_face_diagonals, Model::without_correction_forces}) {
                    rows.push_back(step_limits_row(
                        {{edge, edge, edge}, model, "flat-rows", set, precision, 1, choices.accuracy}, seconds, times));
                }
            }
        }
    }
    return rows;
}

} // namespace hybmss::bench
