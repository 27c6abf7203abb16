// Started by mpirun: what a body on several ranks computes beside the same body on one.

#include "integrations/petsc/petsc.hpp"

#include <gtest/gtest.h>

int main(int argc, char** argv) {
    MPI_Init(&argc, &argv);
    PetscInitializeNoPointers(0, nullptr, nullptr, nullptr);
    testing::InitGoogleTest(&argc, argv);
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    auto& listeners = testing::UnitTest::GetInstance()->listeners();
    if (rank > 0) { // differences are of all ranks: one speaks for them
        delete listeners.Release(listeners.default_result_printer());
    }
    const int failed = RUN_ALL_TESTS();
    PetscFinalize();
    MPI_Finalize();
    return failed;
}
