#include "hybmss/hybmss.h"

#include <stdio.h>

int main(void) {
    const int32_t cells[3] = {10, 10, 10}; /* 10^3 cells of 0.5 m */
    hybmss_material material = hybmss_default_material();
    hybmss_body* cube = NULL;
    hybmss_plan* plan = NULL;
    material.poisson_ratio = 0.45;
    if (hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &cube) != HYBMSS_OK ||
        hybmss_plan_create(cube, HYBMSS_FLOAT, NULL, &plan) != HYBMSS_OK) {
        fprintf(stderr, "%s\n", hybmss_last_error());
        return 1;
    }

    static float u[3 * 11 * 11 * 11], f[3 * 11 * 11 * 11]; /* your own arrays: x y z of each node, in m and N */
    const size_t top = 3 * (5 + 11 * (10 + 11 * 5)) + 1;
    u[top] = -0.05f; /* the middle of the top face, 5 cm down */
    const hybmss_const_field displacements = hybmss_const_float_field(u, 11 * 11 * 11, 3);
    const hybmss_field forces = hybmss_float_field(f, 11 * 11 * 11, 3);
    if (hybmss_plan_add_forces(plan, &displacements, &forces) != HYBMSS_OK) {
        fprintf(stderr, "%s\n", hybmss_last_error());
        return 1;
    }

    printf("the node is pushed back up with %.1f N\n", f[top]);
    hybmss_plan_destroy(plan);
    hybmss_body_destroy(cube);
    return f[top] > 0 ? 0 : 1;
}
