// What `hybmss view` reads: a page's messages, and the files of a run.

#include "app/view/messages.hpp"
#include "tests/fuzz/fuzz_input.hpp"

#include <cmath>
#include <stdexcept>
#include <utility>

using namespace hybmss;

namespace {

template <class Read>
void read(const Read& action) {
    try {
        action();
    } catch (const std::invalid_argument& error) {
        fuzz::require_one_line(error.what());
    }
}

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    const std::string_view text = fuzz::text(data, size);
    if (const auto message = parse_view_message(text)) {
        const double place = message->place[0] + message->place[1] + message->place[2];
        fuzz::require(message->speed > 0 && std::isfinite(message->speed + place), "a message out of its ranges");
    }
    read([&] { parse_pvd(text); });
    read([&] {
        const VtuShape shape = parse_vtu(text);
        const Surface surface = surface_of(shape.cells);
        for (const auto& triangle : surface.triangles) {
            for (const std::uint32_t point : triangle) {
                fuzz::require(point < surface.nodes.size() && surface.nodes[point] < shape.points.size(),
                              "no such point");
            }
        }
    });
    return 0;
}
