// Voxel files: NumPy's and NRRD's, told apart by their first bytes.

#include "simulation/geometry/voxel_grid.hpp"
#include "tests/fuzz/fuzz_input.hpp"

#include <stdexcept>

using namespace hybmss;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    try {
        const VoxelGrid grid = parse_voxels(fuzz::text(data, size));
        fuzz::require(grid.labels.size() == static_cast<std::size_t>(grid.cells[0] * grid.cells[1] * grid.cells[2]),
                      "not one label a cell");
    } catch (const std::runtime_error& error) {
        fuzz::require_one_line(error.what());
    }
    return 0;
}
