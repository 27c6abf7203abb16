#include "integrations/petsc/binary_file.hpp"

namespace hybmss::distributed {

OwnedViewer open_binary(MPI_Comm communicator, const std::string& path, PetscFileMode mode) {
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
