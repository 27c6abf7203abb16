#pragma once

// PETSc's objects with owners, and its error codes as exceptions.

#include <petscdmda.h>
#include <petscsf.h>
#include <petscsnes.h>
#include <petscts.h>

#include <source_location>
#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss::distributed {

/// Throws std::runtime_error that names the place where a call of PETSc failed.
inline void check(PetscErrorCode code, const std::source_location& where = std::source_location::current()) {
    if (code != 0) {
        const char* text = nullptr;
        PetscErrorMessage(code, &text, nullptr);
        throw std::runtime_error("PETSc: " + std::string(text ? text : "unknown error") + " (" + where.function_name() +
                                 ")");
    }
}

/// A call from PETSc's C into ours: no exception crosses, it becomes an error of PETSc's with the same text.
template <class Function>
PetscErrorCode guarded(const Function& function) noexcept {
    try {
        function();
        return 0;
    } catch (const std::exception& error) {
        return PetscError(PETSC_COMM_SELF, 0, "callback", "", PETSC_ERR_LIB, PETSC_ERROR_INITIAL, "%s", error.what());
    }
}

/// Owns one object of PETSc.
template <class Handle, PetscErrorCode (*destroy)(Handle*)>
class Owned {
public:
    Owned() = default;
    Owned(Owned&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
    Owned& operator=(Owned&& other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    ~Owned() {
        if (handle_) {
            destroy(&handle_);
        }
    }

    operator Handle() const { return handle_; }
    /// For the call that makes the object.
    Handle* make() { return &handle_; }

private:
    Handle handle_ = nullptr;
};

using OwnedDm = Owned<DM, DMDestroy>;
using OwnedVec = Owned<Vec, VecDestroy>;
using OwnedMat = Owned<Mat, MatDestroy>;
using OwnedSf = Owned<PetscSF, PetscSFDestroy>;
using OwnedIs = Owned<IS, ISDestroy>;
using OwnedSnes = Owned<SNES, SNESDestroy>;
using OwnedTs = Owned<TS, TSDestroy>;
using OwnedViewer = Owned<PetscViewer, PetscViewerDestroy>;

/// A file of PETSc's own format, without the .info file beside it. Collective.
inline OwnedViewer open_binary(MPI_Comm communicator, const std::string& path, PetscFileMode mode) {
    OwnedViewer viewer;
    check(PetscViewerCreate(communicator, viewer.make()));
    check(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
    check(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE));
    check(PetscViewerFileSetMode(viewer, mode));
    // PETSc's own text does not name the file.
    if (PetscViewerFileSetName(viewer, path.c_str()) != 0) {
        throw std::invalid_argument(path + " cannot be opened for " + (mode == FILE_MODE_READ ? "reading" : "writing"));
    }
    return viewer;
}

} // namespace hybmss::distributed
