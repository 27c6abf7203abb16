#include "integrations/petsc/checkpoint.hpp"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <filesystem>

namespace hybmss::distributed {
namespace {

// A file of PETSc's: the numbers below (a double holds each exactly), the facts of the run, then two vectors.
constexpr double kMagic = 4869426.0, kVersion = 1;
enum Header : std::size_t { magic, version, step_taken, checksum_low, checksum_high, facts };

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw std::invalid_argument("checkpoint " + path + ": " + why);
}

std::uintmax_t whole_size(const Block& block, const RunIdentity& run) {
    std::uintmax_t nodes = 1;
    for (const PetscInt cells : block.grid().cells) {
        nodes *= static_cast<std::uintmax_t>(cells + 1);
    }
    // PETSc puts two integers before a vector.
    return 8 * (facts + run.size()) + 2 * (2 * sizeof(PetscInt) + 24 * nodes);
}

/// The finaliser of splitmix64 (Steele, Lea, Flood 2014).
std::uint64_t mix(std::uint64_t bits) {
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111ebu;
    return bits ^ bits >> 31;
}

struct Digest {
    std::uint64_t checksum = 0; ///< a sum, so that it does not matter which rank has which node
    bool finite = true;
};

Digest digest(const Block& block, Vec displacement, Vec velocity) {
    std::uint64_t own[2] = {0, 0}, all[2] = {0, 0};
    const auto &cells = block.grid().cells, &size = block.owned().size;
    const NodeBox grid{{0, 0, 0}, {cells[0] + 1, cells[1] + 1, cells[2] + 1}};
    std::uint64_t field = 0;
    for (const Vec vector : {displacement, velocity}) {
        const PetscScalar* values = nullptr;
        check(VecGetArrayRead(vector, &values));
        const std::size_t nodes = NodeBox{{0, 0, 0}, size}.count();
        for (std::size_t n = 0; n < nodes; ++n) {
            const auto [i, j, k] = block.owned().place(n);
            for (std::size_t c = 0; c < 3; ++c) {
                const double value = values[3 * n + c];
                const std::uint64_t place = 6 * grid.index(i, j, k) + 3 * field + c;
                own[0] += mix(mix(place + 1) ^ std::bit_cast<std::uint64_t>(value));
                own[1] += std::isfinite(value) ? 0 : 1;
            }
        }
        check(VecRestoreArrayRead(vector, &values));
        ++field;
    }
    MPI_Allreduce(own, all, 2, MPI_UINT64_T, MPI_SUM, block.communicator());
    return {all[0], all[1] == 0};
}

double low_half(std::uint64_t bits) {
    return static_cast<double>(bits & 0xffffffffu);
}
double high_half(std::uint64_t bits) {
    return static_cast<double>(bits >> 32);
}

} // namespace

void write_checkpoint(const std::string& path, const Block& block, const RunIdentity& run, long step, Vec displacement,
                      Vec velocity) {
    const Digest state = digest(block, displacement, velocity);
    if (!state.finite) {
        throw std::runtime_error("the motion is not finite at step " + std::to_string(step) +
                                 ", no checkpoint is written: the time step may be too long");
    }
    std::vector<double> header = {kMagic, kVersion, static_cast<double>(step), low_half(state.checksum),
                                  high_half(state.checksum)};
    for (const RunFact& fact : run) {
        header.push_back(fact.value);
    }
    const std::string temporary = path + ".new";
    {
        const OwnedViewer file = open_binary(block.communicator(), temporary, FILE_MODE_WRITE);
        check(PetscViewerBinaryWrite(file, header.data(), static_cast<PetscInt>(header.size()), PETSC_DOUBLE));
        check(VecView(displacement, file));
        check(VecView(velocity, file));
    }
    MPI_Barrier(block.communicator());
    int failed = 0;
    if (block.rank() == 0) {
        failed = std::rename(temporary.c_str(), path.c_str()) != 0;
    }
    MPI_Bcast(&failed, 1, MPI_INT, 0, block.communicator());
    if (failed) {
        throw std::runtime_error("checkpoint " + path + " cannot be written");
    }
}

long read_checkpoint(const std::string& path, const Block& block, const RunIdentity& run, Vec displacement,
                     Vec velocity) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(path, error);
    if (error) {
        refuse(path, error.message());
    }
    std::vector<double> header(facts + run.size());
    if (size < 8 * header.size()) {
        refuse(path, "no checkpoint, it has " + std::to_string(size) + " bytes alone");
    }
    const OwnedViewer file = open_binary(block.communicator(), path, FILE_MODE_READ);
    check(PetscViewerBinaryRead(file, header.data(), static_cast<PetscInt>(header.size()), nullptr, PETSC_DOUBLE));
    if (header[magic] != kMagic || header[version] != kVersion) {
        refuse(path, "no checkpoint of this program, or of another version");
    }
    for (std::size_t f = 0; f < run.size(); ++f) {
        if (header[facts + f] != run[f].value) {
            refuse(path, "of another run: " + run[f].name + " = " + std::to_string(header[facts + f]) + " in it, " +
                             std::to_string(run[f].value) + " now");
        }
    }
    if (const std::uintmax_t whole = whole_size(block, run); size != whole) {
        refuse(path, "damaged, it has " + std::to_string(size) + " bytes instead of " + std::to_string(whole));
    }
    check(VecLoad(displacement, file));
    check(VecLoad(velocity, file));
    const Digest state = digest(block, displacement, velocity);
    if (low_half(state.checksum) != header[checksum_low] || high_half(state.checksum) != header[checksum_high]) {
        refuse(path, "damaged, its checksum differs");
    }
    return static_cast<long>(header[step_taken]);
}

} // namespace hybmss::distributed
