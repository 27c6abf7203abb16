#pragma once

#include "integrations/petsc/petsc.hpp"

#include <string>

namespace hybmss::distributed {

/// A file of PETSc's own format, without the .info file beside it. Collective.
OwnedViewer open_binary(MPI_Comm communicator, const std::string& path, PetscFileMode mode);

} // namespace hybmss::distributed
