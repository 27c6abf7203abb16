/* The C interface from C99: what it computes, and that every wrong argument ends in a status and one line. */

#define _POSIX_C_SOURCE 200112L /* posix_memalign */

#include "hybmss/hybmss.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define EXPECT(condition)                                                                                              \
    do {                                                                                                               \
        if (!(condition)) {                                                                                            \
            printf("%s:%d: FAILED: %s (last error: %s)\n", __FILE__, __LINE__, #condition, hybmss_last_error());       \
            ++failures;                                                                                                \
        }                                                                                                              \
    } while (0)
#define OK(call) EXPECT((call) == HYBMSS_OK)
/* The call is refused, and the message holds the words. */
#define REFUSED(call, words) EXPECT((call) == HYBMSS_INVALID_ARGUMENT && strstr(hybmss_last_error(), words))

enum { NX = 3, NY = 4, NZ = 5, NODES = (NX + 1) * (NY + 1) * (NZ + 1) };

static hybmss_body* box(void) {
    const int32_t cells[3] = {NX, NY, NZ};
    hybmss_material material = hybmss_default_material();
    hybmss_body* body = NULL;
    material.poisson_ratio = 0.4;
    OK(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &body));
    return body;
}

static hybmss_plan* plan_of(const hybmss_body* body, hybmss_precision precision) {
    hybmss_plan* plan = NULL;
    OK(hybmss_plan_create(body, precision, NULL, &plan));
    return plan;
}

static void fill(double* u, size_t count) {
    unsigned state = 12345;
    size_t i;
    for (i = 0; i < count; ++i) {
        state = state * 1103515245u + 12345u;
        u[i] = 0.05 * ((double)(state >> 16 & 0x7fff) / 32768.0 - 0.5);
    }
}

static void bodies(void) {
    const int32_t cells[3] = {NX, NY, NZ}, empty[3] = {0, 1, 1}, two[3] = {2, 1, 1};
    const float scales[2] = {0, 1}, bad[2] = {1, -1}, not_a_number[2] = {1, NAN};
    hybmss_material material = hybmss_default_material();
    hybmss_body *body = NULL, *untouched = NULL;
    double positions[3 * 8], u[3 * 8];
    hybmss_const_field stretched = {HYBMSS_DOUBLE, u, u + 1, u + 2, 3, 8, NULL};
    hybmss_cell_stress stress;
    const double vertices[9] = {0.6, 0.1, 0.5, 0.9, 0.1, 0.5, 0.6, 0.4, 0.5};
    const uint32_t triangle[3] = {0, 1, 2};
    double x[9], normal[9];
    hybmss_field skin_positions = {HYBMSS_DOUBLE, x, x + 1, x + 2, 3, 3, NULL};
    hybmss_field skin_normals = {HYBMSS_DOUBLE, normal, normal + 1, normal + 2, 3, 3, NULL};
    hybmss_skin* skin = NULL;
    uint32_t indices[8];
    size_t count = 0, n;

    OK(hybmss_lattice_create(two, 0.5, scales, 2, &material, &body));
    OK(hybmss_body_node_count(body, &count));
    EXPECT(count == 8);
    OK(hybmss_body_rest_positions(body, positions, 24));
    EXPECT(positions[0] == 0.5 && positions[1] == 0 && positions[21] == 1 && positions[23] == 0.5);
    OK(hybmss_body_grid_indices(body, indices, 8));
    EXPECT(indices[0] == 1 && indices[1] == 2 && indices[7] == 11);
    REFUSED(hybmss_body_node_count(NULL, &count), "body is null");
    REFUSED(hybmss_body_node_count(body, NULL), "count is null");
    REFUSED(hybmss_body_rest_positions(NULL, positions, 24), "body is null");
    REFUSED(hybmss_body_rest_positions(body, NULL, 24), "positions is null");
    REFUSED(hybmss_body_rest_positions(body, positions, 8), "8 values given, 24 needed");
    REFUSED(hybmss_body_grid_indices(NULL, indices, 8), "body is null");
    REFUSED(hybmss_body_grid_indices(body, NULL, 8), "indices is null");
    REFUSED(hybmss_body_grid_indices(body, indices, 7), "7 values given, 8 needed");

    /* Stretched along y and narrower by Poisson's ratio. */
    OK(hybmss_body_cell_count(body, &count));
    EXPECT(count == 1);
    for (n = 0; n < 8; ++n) {
        u[3 * n] = -0.25e-6 * positions[3 * n];
        u[3 * n + 1] = 1e-6 * positions[3 * n + 1];
        u[3 * n + 2] = -0.25e-6 * positions[3 * n + 2];
    }
    OK(hybmss_body_stresses(body, &stretched, &stress, 1));
    EXPECT(fabs(stress.cauchy[1] - 1e-2) < 1e-7 && fabs(stress.cauchy[0]) < 1e-7 && fabs(stress.cauchy[3]) < 1e-7);
    EXPECT(fabs(stress.von_mises - 1e-2) < 1e-7 && fabs(stress.pressure + 1e-2 / 3) < 1e-7);
    EXPECT(fabs(stress.first_piola[4] - 1e-2) < 1e-7 && fabs(stress.green_strain[1] - 1e-6) < 1e-11);
    EXPECT(fabs(stress.energy_density - 0.5e-8) < 1e-13 && fabs(stress.volume_ratio - 1 - 0.5e-6) < 1e-11);
    REFUSED(hybmss_body_stresses(body, &stretched, &stress, 2), "2 values given, 1 needed");
    REFUSED(hybmss_body_stresses(body, &stretched, NULL, 1), "stresses is null");
    REFUSED(hybmss_body_stresses(body, NULL, &stress, 1), "displacements is null");
    stretched.count = 7;
    REFUSED(hybmss_body_stresses(body, &stretched, &stress, 1), "displacements");
    REFUSED(hybmss_body_cell_count(body, NULL), "count is null");

    /* A triangle on the upper face follows the stretch of a million times as much. */
    stretched.count = 8;
    for (n = 0; n < 24; ++n) {
        u[n] *= 1e6;
    }
    OK(hybmss_skin_create(body, HYBMSS_DOUBLE, vertices, 3, triangle, 1, NULL, &skin));
    OK(hybmss_skin_update(skin, &stretched, &skin_positions, &skin_normals));
    for (n = 0; n < 9; ++n) {
        EXPECT(fabs(x[n] - vertices[n] * (n % 3 == 1 ? 2 : 0.75)) < 1e-14 && fabs(normal[n] - (n % 3 == 2)) < 1e-14);
    }
    x[0] = 0;
    OK(hybmss_skin_update(skin, &stretched, &skin_positions, NULL));
    EXPECT(fabs(x[0] - 0.75 * vertices[0]) < 1e-14);
    REFUSED(hybmss_skin_update(NULL, &stretched, &skin_positions, NULL), "skin is null");
    REFUSED(hybmss_skin_update(skin, &stretched, NULL, NULL), "positions");
    skin_positions.count = 2;
    REFUSED(hybmss_skin_update(skin, &stretched, &skin_positions, NULL), "positions");
    hybmss_skin_destroy(skin);
    REFUSED(hybmss_skin_create(body, HYBMSS_DOUBLE, vertices, 2, triangle, 1, NULL, &skin), "names vertex 2");
    REFUSED(hybmss_skin_create(body, HYBMSS_DOUBLE, NULL, 3, triangle, 1, NULL, &skin), "vertices is null");
    REFUSED(hybmss_skin_create(body, HYBMSS_DOUBLE, vertices, (size_t)-1, triangle, 1, NULL, &skin), "vertices");
    REFUSED(hybmss_skin_create(body, 2, vertices, 3, triangle, 1, NULL, &skin), "precision = 2");
    REFUSED(hybmss_skin_create(NULL, HYBMSS_DOUBLE, vertices, 3, triangle, 1, NULL, &skin), "body is null");
    hybmss_body_destroy(body);
    hybmss_body_destroy(NULL);

    REFUSED(hybmss_lattice_create(NULL, 0.5, NULL, 0, &material, &untouched), "cells is null");
    REFUSED(hybmss_lattice_create(cells, 0.5, NULL, 0, NULL, &untouched), "material is null");
    REFUSED(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, NULL), "body is null");
    REFUSED(hybmss_lattice_create(empty, 0.5, NULL, 0, &material, &untouched), "each count must be at least 1");
    REFUSED(hybmss_lattice_create(cells, NAN, NULL, 0, &material, &untouched), "cell_size");
    REFUSED(hybmss_lattice_create(two, 0.5, NULL, 2, &material, &untouched), "scales is null");
    REFUSED(hybmss_lattice_create(two, 0.5, scales, 1, &material, &untouched), "1 values given, 2 needed");
    REFUSED(hybmss_lattice_create(two, 0.5, scales, (size_t)-1, &material, &untouched), "more than there is memory");
    REFUSED(hybmss_lattice_create(two, 0.5, bad, 2, &material, &untouched), "cell scale");
    REFUSED(hybmss_lattice_create(two, 0.5, not_a_number, 2, &material, &untouched), "cell scale");
    material.poisson_ratio = 0.5;
    REFUSED(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &untouched), "poisson_ratio = 0.5");
    material = hybmss_default_material();
    material.young_modulus = NAN;
    REFUSED(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &untouched), "young_modulus");
    material = hybmss_default_material();
    material.volume_energy = 7;
    REFUSED(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &untouched), "volume_energy = 7");
    material = hybmss_default_material();
    material.springs = 2;
    REFUSED(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &untouched), "springs = 2");
    material = hybmss_default_material();
    material.stiffening_quadratic = 2;
    REFUSED(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &untouched), "stiffening.quadratic = 2");
    EXPECT(untouched == NULL);
}

static void cells_of_other_shapes(void) {
    const int32_t cells[3] = {2, 2, 2};
    const hybmss_material material = hybmss_default_material();
    const hybmss_cell_shape shapes[3] = {HYBMSS_TETRAHEDRON, HYBMSS_PYRAMID, HYBMSS_PRISM};
    const double flat[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0.3, 0.3, 0.1};
    hybmss_polyhedron one = {HYBMSS_TETRAHEDRON, {0, 1, 2, 3, 0, 0}};
    hybmss_body *body = NULL, *again = NULL;
    hybmss_spring_fit fit;
    size_t s;

    for (s = 0; s < 3; ++s) {
        size_t nodes = 0, count = 0, known = 0, n;
        double *x, *u, *f, sum = 0;
        hybmss_polyhedron* all;
        hybmss_plan* plan;
        OK(hybmss_cells_create(shapes[s], cells, 0.5, 0.5, &material, &body));
        OK(hybmss_body_node_count(body, &nodes));
        OK(hybmss_body_polyhedra(body, NULL, &count));
        EXPECT(count == (shapes[s] == HYBMSS_PRISM ? 16 : shapes[s] == HYBMSS_PYRAMID ? 48 : 12 * 4 + 24));
        x = calloc(3 * nodes, sizeof *x);
        u = calloc(3 * nodes, sizeof *u);
        f = calloc(3 * nodes, sizeof *f);
        all = calloc(count, sizeof *all);
        OK(hybmss_body_rest_positions(body, x, 3 * nodes));
        OK(hybmss_body_polyhedra(body, all, &count));
        for (n = 0; n < count; ++n) {
            known += all[n].shape == (int32_t)shapes[s];
        }
        EXPECT(known == (shapes[s] == HYBMSS_TETRAHEDRON ? 48 : count));
        /* A fit to the same cells is another network, with springs that push as hard where it is stretched. */
        OK(hybmss_mesh_create(x, nodes, all, count, &material, 1, &fit, &again));
        EXPECT(fit.misfit > 0 && fit.anisotropy > 0 && fit.modulus_error > -1);
        fill(u, 3 * nodes);
        plan = plan_of(again, HYBMSS_DOUBLE);
        {
            const hybmss_const_field at = hybmss_const_double_field(u, nodes, 3);
            const hybmss_field to = hybmss_double_field(f, nodes, 3);
            OK(hybmss_plan_add_forces(plan, &at, &to));
        }
        for (n = 0; n < nodes; ++n) {
            sum += f[3 * n];
        }
        EXPECT(fabs(sum) < 1e-9 && fabs(f[0]) > 1e-3);
        hybmss_plan_destroy(plan);
        hybmss_body_destroy(again);
        hybmss_body_destroy(body);
        free(x);
        free(u);
        free(f);
        free(all);
    }
    REFUSED(hybmss_cells_create((hybmss_cell_shape)7, cells, 0.5, 0.5, &material, &body), "shape = 7");
    REFUSED(hybmss_cells_create(HYBMSS_PRISM, cells, 0.5, 0.1, &material, &body), "height = 0.1");
    REFUSED(hybmss_mesh_create(flat, 4, &one, 1, &material, 0.1, NULL, &body), "far from isotropic");
    one.shape = 3;
    REFUSED(hybmss_mesh_create(flat, 4, &one, 1, &material, 0.1, NULL, &body), "cell 0: shape = 3");
    REFUSED(hybmss_mesh_read("/nowhere/none.msh", &material, 0.1, &fit, &body), "/nowhere/none.msh");
}

static void separation(void) {
    const int32_t cells[3] = {4, 1, 1};
    const hybmss_material material = hybmss_default_material();
    const uint32_t face[2] = {2, 1}, none[2] = {0, 2};
    hybmss_body *lattice = NULL, *whole = NULL, *parted = NULL;
    double u[3 * 20] = {0}, x[3 * 20];
    uint32_t before[24], nodes[24], torn[6];
    hybmss_const_field stretched = hybmss_const_double_field(u, 20, 3);
    size_t count = 0, n;

    OK(hybmss_lattice_create(cells, 0.5, NULL, 0, &material, &lattice));
    OK(hybmss_body_separate(lattice, NULL, 0, &whole));
    OK(hybmss_body_separate(lattice, face, 1, &parted));
    OK(hybmss_body_node_count(whole, &count));
    EXPECT(count == 20);
    OK(hybmss_body_node_count(parted, &count));
    EXPECT(count == 24);
    OK(hybmss_body_nodes_before(whole, parted, before, 24));
    OK(hybmss_body_lattice_nodes(parted, nodes, 24));
    EXPECT(memcmp(before, nodes, sizeof nodes) == 0);
    OK(hybmss_body_rest_positions(whole, x, 60));
    for (n = 0; n < 20; ++n) {
        u[3 * n] = x[3 * n] > 1.1 ? 0.2 : 0;
    }
    OK(hybmss_body_torn_faces(lattice, whole, &stretched, 0.1, NULL, &count));
    EXPECT(count == 2);
    OK(hybmss_body_torn_faces(lattice, whole, &stretched, 0.1, torn, &count));
    EXPECT(torn[0] == 1 && torn[1] == 2 && torn[2] == 2 && torn[3] == 3);
    REFUSED(hybmss_body_torn_faces(lattice, whole, &stretched, 0, NULL, &count), "tear_strain");
    REFUSED(hybmss_body_torn_faces(lattice, parted, &stretched, 0.1, NULL, &count), "displacements");
    REFUSED(hybmss_body_separate(lattice, none, 1, &parted), "share no face");
    REFUSED(hybmss_body_separate(whole, face, 1, &parted), "the cells of a lattice part");
    REFUSED(hybmss_body_lattice_nodes(lattice, nodes, 20), "parted is not allowed");
    hybmss_body_destroy(parted);
    hybmss_body_destroy(whole);
    hybmss_body_destroy(lattice);
}

static void networks(void) {
    const double positions[6] = {0, 0, 0, 1, 0, 0}, masses[2] = {1, 1}, weightless[2] = {1, 0};
    hybmss_spring spring = {0, 1, 10.0, {1, 0, 0}};
    hybmss_network network = {NULL, NULL, 2, NULL, 1, NULL, 0, HYBMSS_VOLUME_QUADRATIC};
    double u[6] = {0, 0, 0, 0.5, 0, 0}, f[6] = {0};
    const hybmss_const_field displacements = hybmss_const_double_field(u, 2, 3);
    const hybmss_field forces = hybmss_double_field(f, 2, 3);
    hybmss_body* body = NULL;
    hybmss_plan* plan;
    uint32_t index[2];

    network.masses = masses;
    network.springs = &spring;
    REFUSED(hybmss_network_create(NULL, &body), "network is null");
    REFUSED(hybmss_network_create(&network, &body), "rest_positions is null");
    network.rest_positions = positions;
    REFUSED(hybmss_network_create(&network, NULL), "body is null");
    network.masses = weightless;
    REFUSED(hybmss_network_create(&network, &body), "mass of node 1");
    network.masses = masses;
    spring.b = 2;
    REFUSED(hybmss_network_create(&network, &body), "spring 0");
    spring.b = 1;
    network.cell_count = 1;
    REFUSED(hybmss_network_create(&network, &body), "cells is null");
    network.cell_count = (size_t)-1;
    REFUSED(hybmss_network_create(&network, &body), "at most");
    network.cell_count = 0;
    network.volume_energy = -1;
    REFUSED(hybmss_network_create(&network, &body), "volume_energy = -1");
    network.volume_energy = HYBMSS_VOLUME_QUADRATIC;
    EXPECT(body == NULL);

    OK(hybmss_network_create(&network, &body));
    REFUSED(hybmss_body_grid_indices(body, index, 2), "network");
    REFUSED(hybmss_body_stresses(body, &displacements, NULL, 0), "network");
    REFUSED(hybmss_body_cell_count(body, &network.cell_count), "network");
    plan = plan_of(body, HYBMSS_DOUBLE);
    OK(hybmss_plan_add_forces(plan, &displacements, &forces));
    EXPECT(fabs(f[0] - 5) < 1e-12 && fabs(f[3] + 5) < 1e-12); /* k (1 - l/|d|) d */
    hybmss_plan_destroy(plan);
    hybmss_body_destroy(body);
}

/* Two cells, each of a material of its own, which share four nodes. */
static void cells_of_materials(void) {
    const int32_t two[3] = {1, 2, 1};
    const uint8_t labels[2] = {1, 2}, unknown[2] = {1, 3};
    hybmss_material both[2];
    hybmss_body *body = NULL, *untouched = NULL;
    hybmss_dynamics* dynamics = NULL;
    double masses[12];

    both[0] = both[1] = hybmss_default_material();
    both[1].poisson_ratio = 0.45;
    both[1].density = 3000;
    OK(hybmss_lattice_create_of_materials(two, 1, labels, 2, both, 2, &body));
    OK(hybmss_dynamics_create(body, HYBMSS_DOUBLE, NULL, &dynamics));
    OK(hybmss_dynamics_masses(dynamics, masses, 12));
    EXPECT(masses[0] == 1000.0 / 8 && masses[2] == 4000.0 / 8 && masses[5] == 3000.0 / 8);
    hybmss_dynamics_destroy(dynamics);
    hybmss_body_destroy(body);
    REFUSED(hybmss_lattice_create_of_materials(two, 1, NULL, 2, both, 2, &untouched), "labels is null");
    REFUSED(hybmss_lattice_create_of_materials(two, 1, unknown, 2, both, 2, &untouched), "material 3");
    REFUSED(hybmss_lattice_create_of_materials(two, 1, labels, 2, both, 0, &untouched), "material_count = 0");
    both[1].face_diagonal_ratio = 0;
    REFUSED(hybmss_lattice_create_of_materials(two, 1, labels, 2, both, 2, &untouched), "only young_modulus");
    EXPECT(untouched == NULL);
}

/* One cube on means: the same forces as a network and as a lattice. */
static void networks_on_means(void) {
    const int32_t one[3] = {1, 1, 1};
    hybmss_cell cell = {{0, 1, 2, 3, 4, 5, 6, 7}, 0};
    double positions[24], masses[8], u[24], f[24] = {0}, expected[24] = {0}, scale = 1;
    hybmss_network network = {NULL, NULL, 8, NULL, 0, NULL, 1, HYBMSS_VOLUME_NONE};
    hybmss_material material = hybmss_default_material(); /* nu = 1/4: kappa = 0 */
    const hybmss_const_field displacements = hybmss_const_double_field(u, 8, 3);
    const hybmss_field forces = hybmss_double_field(f, 8, 3), wanted = hybmss_double_field(expected, 8, 3);
    hybmss_body *lattice = NULL, *body = NULL;
    hybmss_plan* plan;
    size_t i;

    material.springs = HYBMSS_SPRINGS_MEANS;
    OK(hybmss_lattice_create(one, 0.5, NULL, 0, &material, &lattice));
    OK(hybmss_body_rest_positions(lattice, positions, 24));
    for (i = 0; i < 8; ++i) {
        masses[i] = 1;
    }
    network.rest_positions = positions;
    network.masses = masses;
    network.cells = &cell;
    REFUSED(hybmss_network_create_on_means(NULL, &material, 0.5, &scale, 1, &body), "network is null");
    REFUSED(hybmss_network_create_on_means(&network, NULL, 0.5, &scale, 1, &body), "material is null");
    REFUSED(hybmss_network_create_on_means(&network, &material, 0, &scale, 1, &body), "cell_size = 0");
    REFUSED(hybmss_network_create_on_means(&network, &material, 0.5, NULL, 1, &body), "scales is null");
    REFUSED(hybmss_network_create_on_means(&network, &material, 0.5, &scale, 2, &body), "scales");
    scale = -1;
    REFUSED(hybmss_network_create_on_means(&network, &material, 0.5, &scale, 1, &body), "cell 0");
    scale = 1;
    positions[0] = 0.1;
    REFUSED(hybmss_network_create_on_means(&network, &material, 0.5, &scale, 1, &body), "cube");
    positions[0] = 0;
    EXPECT(body == NULL);

    OK(hybmss_network_create_on_means(&network, &material, 0.5, &scale, 1, &body));
    fill(u, 24);
    plan = plan_of(body, HYBMSS_DOUBLE);
    OK(hybmss_plan_add_forces(plan, &displacements, &forces));
    hybmss_plan_destroy(plan);
    plan = plan_of(lattice, HYBMSS_DOUBLE);
    OK(hybmss_plan_add_forces(plan, &displacements, &wanted));
    hybmss_plan_destroy(plan);
    for (i = 0; i < 24; ++i) {
        EXPECT(fabs(f[i] - expected[i]) < 1e-10 && fabs(f[i]) > 1e-3);
    }
    hybmss_body_destroy(body);
    hybmss_body_destroy(lattice);
}

/* Interleaved, separate and mapped memory give the same forces, in float and double. */
static void layouts(void) {
    hybmss_body* body = box();
    hybmss_plan* plan = plan_of(body, HYBMSS_DOUBLE);
    static double u[3 * NODES], f[3 * NODES], separate[3][NODES], result[3][NODES], mixed_u[8 * NODES],
        mixed_f[8 * NODES], blocks_u[3 * NODES], blocks_f[3 * NODES];
    static uint32_t map[NODES];
    hybmss_const_field in;
    hybmss_field out;
    size_t n, c;
    double springs = 0, volume = 0, mapped_springs = 0, sum[3] = {0, 0, 0};

    fill(u, 3 * NODES);
    in = hybmss_const_double_field(u, NODES, 3);
    out = hybmss_double_field(f, NODES, 3);
    OK(hybmss_plan_add_forces(plan, &in, &out));
    OK(hybmss_plan_energy(plan, &in, &springs, &volume));
    OK(hybmss_plan_energy(plan, &in, NULL, NULL));
    EXPECT(springs > 0 && volume > 0);
    for (n = 0; n < NODES; ++n) {
        for (c = 0; c < 3; ++c) {
            sum[c] += f[3 * n + c];
            separate[c][n] = u[3 * n + c];
        }
    }
    EXPECT(fabs(sum[0]) + fabs(sum[1]) + fabs(sum[2]) < 1e-9); /* a free body */
    EXPECT(f[0] != 0);

    in.x = separate[0], in.y = separate[1], in.z = separate[2], in.stride = 1;
    out.x = result[0], out.y = result[1], out.z = result[2], out.stride = 1;
    OK(hybmss_plan_add_forces(plan, &in, &out));
    for (n = 0; n < NODES; ++n) {
        for (c = 0; c < 3; ++c) {
            EXPECT(result[c][n] == f[3 * n + c]);
        }
    }

    /* Backwards, with a gap after every entry, and one entry more than the body has nodes. */
    for (n = 0; n < NODES; ++n) {
        map[n] = (uint32_t)(NODES - n);
        memcpy(mixed_u + 4 * map[n], u + 3 * n, 3 * sizeof(double));
    }
    mixed_f[0] = 42;
    mixed_f[7] = 43;
    in = hybmss_const_double_field(mixed_u, NODES + 1, 4);
    in.map = map;
    out = hybmss_double_field(mixed_f, NODES + 1, 4);
    out.map = map;
    OK(hybmss_plan_add_forces(plan, &in, &out));
    OK(hybmss_plan_energy(plan, &in, &mapped_springs, NULL));
    EXPECT(mapped_springs == springs);
    for (n = 0; n < NODES; ++n) {
        EXPECT(memcmp(mixed_f + 4 * map[n], f + 3 * n, 3 * sizeof(double)) == 0);
    }
    EXPECT(mixed_f[0] == 42 && mixed_f[7] == 43);
    /* They are added. */
    OK(hybmss_plan_add_forces(plan, &in, &out));
    EXPECT(mixed_f[4 * map[0]] == 2 * f[0]);

    /* Blocks: four of x, then of y, then of z. */
    for (n = 0; n < NODES; ++n) {
        map[n] = (uint32_t)(12 * (n / 4) + n % 4);
        for (c = 0; c < 3; ++c) {
            blocks_u[map[n] + 4 * c] = u[3 * n + c];
        }
    }
    in.x = blocks_u, in.y = blocks_u + 4, in.z = blocks_u + 8, in.stride = 1, in.count = 3 * NODES - 8;
    out.x = blocks_f, out.y = blocks_f + 4, out.z = blocks_f + 8;
    out.stride = 1, out.count = in.count;
    OK(hybmss_plan_add_forces(plan, &in, &out));
    for (n = 0; n < NODES; ++n) {
        for (c = 0; c < 3; ++c) {
            EXPECT(blocks_f[map[n] + 4 * c] == f[3 * n + c]);
        }
    }
    hybmss_plan_destroy(plan);

    {
        static float u_float[3 * NODES], f_float[3 * NODES];
        hybmss_const_field in_float = hybmss_const_float_field(u_float, NODES, 3);
        hybmss_field out_float = hybmss_float_field(f_float, NODES, 3);
        double largest = 0, error = 0;
        for (n = 0; n < 3 * NODES; ++n) {
            u_float[n] = (float)u[n];
        }
        plan = plan_of(body, HYBMSS_FLOAT);
        OK(hybmss_plan_add_forces(plan, &in_float, &out_float));
        for (n = 0; n < 3 * NODES; ++n) {
            largest = fmax(largest, fabs(f[n]));
            error = fmax(error, fabs(f[n] - (double)f_float[n]));
        }
        EXPECT(error < 1e-5 * largest); /* some ten roundings of float */
        hybmss_plan_destroy(plan);
    }
    hybmss_body_destroy(body);
}

/* K p is what the forces change by. */
static void second_derivatives(void) {
    hybmss_body* body = box();
    hybmss_plan* plan = plan_of(body, HYBMSS_DOUBLE);
    static double u[3 * NODES], v[3 * NODES], p[3 * NODES], f[3 * NODES], g[3 * NODES], product[3 * NODES];
    hybmss_const_field at_u = hybmss_const_double_field(u, NODES, 3), at_v = hybmss_const_double_field(v, NODES, 3),
                       direction = hybmss_const_double_field(p, NODES, 3);
    hybmss_field to_f = hybmss_double_field(f, NODES, 3), to_g = hybmss_double_field(g, NODES, 3),
                 to_product = hybmss_double_field(product, NODES, 3);
    double largest = 0, error = 0;
    size_t i;
    fill(u, 3 * NODES);
    for (i = 0; i < 3 * NODES; ++i) {
        p[i] = u[3 * NODES - 1 - i];
        v[i] = u[i] + 1e-6 * p[i];
        u[i] -= 1e-6 * p[i];
    }
    OK(hybmss_plan_add_forces(plan, &at_u, &to_f));
    OK(hybmss_plan_add_forces(plan, &at_v, &to_g));
    for (i = 0; i < 3 * NODES; ++i) {
        u[i] += 1e-6 * p[i];
    }
    OK(hybmss_plan_add_hessian_product(plan, &at_u, &direction, &to_product));
    for (i = 0; i < 3 * NODES; ++i) {
        largest = fmax(largest, fabs(product[i]));
        error = fmax(error, fabs(product[i] - (f[i] - g[i]) / 2e-6));
    }
    EXPECT(largest > 0 && error < 1e-6 * largest);
    REFUSED(hybmss_plan_add_hessian_product(NULL, &at_u, &direction, &to_product), "plan is null");
    REFUSED(hybmss_plan_add_hessian_product(plan, NULL, &direction, &to_product), "displacements is null");
    REFUSED(hybmss_plan_add_hessian_product(plan, &at_u, NULL, &to_product), "direction is null");
    REFUSED(hybmss_plan_add_hessian_product(plan, &at_u, &direction, NULL), "product is null");
    hybmss_plan_destroy(plan);
    hybmss_body_destroy(body);
}

static void refused_fields(void) {
    hybmss_body* body = box();
    hybmss_plan *plan = plan_of(body, HYBMSS_FLOAT), *none = NULL;
    static float u[3 * NODES], f[3 * NODES];
    static uint32_t map[NODES];
    const hybmss_const_field good = hybmss_const_float_field(u, NODES, 3);
    const hybmss_field out = hybmss_float_field(f, NODES, 3);
    hybmss_const_field bad;
    hybmss_field worse;
    hybmss_plan_options options = hybmss_default_plan_options();
    hybmss_task_runner runner = {0, NULL, NULL, NULL};
    char text[16];
    size_t length = 0;
    double dt = 0;

    REFUSED(hybmss_plan_create(NULL, HYBMSS_FLOAT, NULL, &none), "body is null");
    REFUSED(hybmss_plan_create(body, HYBMSS_FLOAT, NULL, NULL), "plan is null");
    REFUSED(hybmss_plan_create(body, 2, NULL, &none), "precision = 2");
    options.threads = -1;
    REFUSED(hybmss_plan_create(body, HYBMSS_FLOAT, &options, &none), "threads = -1");
    options = hybmss_default_plan_options();
    options.accuracy = 3;
    REFUSED(hybmss_plan_create(body, HYBMSS_FLOAT, &options, &none), "accuracy = 3");
    options = hybmss_default_plan_options();
    options.measure = -1;
    REFUSED(hybmss_plan_create(body, HYBMSS_FLOAT, &options, &none), "measure = -1");
    options = hybmss_default_plan_options();
    options.layout = "spiral";
    REFUSED(hybmss_plan_create(body, HYBMSS_FLOAT, &options, &none), "spiral");
    options = hybmss_default_plan_options();
    options.instruction_set = "mmx";
    REFUSED(hybmss_plan_create(body, HYBMSS_FLOAT, &options, &none), "mmx");
    options = hybmss_default_plan_options();
    options.task_runner = &runner;
    REFUSED(hybmss_plan_create(body, HYBMSS_FLOAT, &options, &none), "task_runner");
    EXPECT(none == NULL);

    REFUSED(hybmss_plan_add_forces(NULL, &good, &out), "plan is null");
    REFUSED(hybmss_plan_add_forces(plan, NULL, &out), "displacements is null");
    REFUSED(hybmss_plan_add_forces(plan, &good, NULL), "forces is null");
    REFUSED(hybmss_plan_energy(NULL, &good, NULL, NULL), "plan is null");
    REFUSED(hybmss_plan_energy(plan, NULL, NULL, NULL), "displacements is null");
    bad = good, bad.precision = HYBMSS_DOUBLE;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "precision = 1");
    bad = good, bad.precision = -5;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "precision = -5");
    bad = good, bad.count = NODES - 1;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "count = 119");
    bad = good, bad.stride = 0;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "stride = 0");
    bad = good, bad.stride = -3;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "stride = -3");
    bad = good, bad.stride = PTRDIFF_MAX;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "more than there is memory");
    bad = good, bad.y = NULL;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "y is null");
    bad = good, bad.z = (const char*)good.z + 1;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "z is not aligned");
    bad = good, bad.map = map, map[3] = NODES;
    REFUSED(hybmss_plan_add_forces(plan, &bad, &out), "map[3] = 120");
    map[3] = 0;
    worse = out, worse.x = worse.y;
    REFUSED(hybmss_plan_add_forces(plan, &good, &worse), "different memory");
    worse = out, worse.stride = 1; /* interleaved memory: y of an entry is x of the next */
    REFUSED(hybmss_plan_add_forces(plan, &good, &worse), "different memory");
    worse.x = (void*)good.x, worse.y = (void*)good.y, worse.z = (void*)good.z, worse.stride = good.stride;
    worse.precision = HYBMSS_FLOAT;
    REFUSED(hybmss_plan_add_forces(plan, &good, &worse), "forces: what is written must be other memory");
    worse = out, worse.precision = HYBMSS_DOUBLE;
    REFUSED(hybmss_plan_add_forces(plan, &good, &worse), "forces: precision");

    REFUSED(hybmss_plan_critical_time_step(NULL, &dt), "plan is null");
    REFUSED(hybmss_plan_critical_time_step(plan, NULL), "time_step is null");
    OK(hybmss_plan_critical_time_step(plan, &dt));
    EXPECT(dt > 0);
    REFUSED(hybmss_plan_describe(NULL, text, sizeof text, &length), "plan is null");
    REFUSED(hybmss_plan_describe(plan, NULL, 10, &length), "text is null");
    OK(hybmss_plan_describe(plan, NULL, 0, &length));
    EXPECT(length > sizeof text);
    OK(hybmss_plan_describe(plan, text, sizeof text, NULL));
    EXPECT(strlen(text) == sizeof text - 1);
    hybmss_plan_destroy(plan);
    hybmss_plan_destroy(NULL);
    hybmss_body_destroy(body);
}

/* Hangs from one held face under gravity, and conserves what it should. */
static void motion(void) {
    hybmss_body* body = box();
    hybmss_dynamics *dynamics = NULL, *none = NULL;
    hybmss_step_parameters parameters = {0, {0, 0, -10}, 0, HYBMSS_SYMPLECTIC_EULER};
    hybmss_prescribed_node held = {0, 7, {0, 0, 0}, {0, 0, 0}};
    hybmss_nodal_load load = {NODES - 1, {1, 0, 0}};
    static double u[3 * NODES], v[3 * NODES], masses[NODES];
    hybmss_field to_u = hybmss_double_field(u, NODES, 3), to_v = hybmss_double_field(v, NODES, 3);
    hybmss_const_field from_u = hybmss_const_double_field(u, NODES, 3);
    double dt = 0, springs = -1, volume = -1, kinetic = -1, mass = 0, momentum = 0, fallen = 0;
    int64_t steps = -1;
    size_t n;

    REFUSED(hybmss_dynamics_create(NULL, HYBMSS_DOUBLE, NULL, &none), "body is null");
    REFUSED(hybmss_dynamics_create(body, HYBMSS_DOUBLE, NULL, NULL), "dynamics is null");
    REFUSED(hybmss_dynamics_create(body, 9, NULL, &none), "precision = 9");
    EXPECT(none == NULL);
    OK(hybmss_dynamics_create(body, HYBMSS_DOUBLE, NULL, &dynamics));
    OK(hybmss_dynamics_critical_time_step(dynamics, &dt));
    parameters.time_step = dt / 2;

    /* Free fall: every node's speed is g t, and momentum is mass times that. */
    OK(hybmss_dynamics_step(dynamics, &parameters, 10));
    OK(hybmss_dynamics_get_velocities(dynamics, &to_v));
    OK(hybmss_dynamics_masses(dynamics, masses, NODES));
    for (n = 0; n < NODES; ++n) {
        mass += masses[n];
        momentum += masses[n] * v[3 * n + 2];
    }
    EXPECT(fabs(mass - 1000 * NX * NY * NZ * 0.125) < 1e-9);
    EXPECT(fabs(momentum / mass + 10 * 10 * parameters.time_step) < 1e-12);
    OK(hybmss_dynamics_energies(dynamics, &springs, &volume, &kinetic));
    EXPECT(kinetic > 0 && springs >= 0 && springs < 1e-20 && volume < 1e-20);
    OK(hybmss_dynamics_energies(dynamics, NULL, NULL, NULL));
    OK(hybmss_dynamics_not_finite_at(dynamics, &steps));
    EXPECT(steps == 0);

    /* Leapfrog falls as the equation says: from u and v = g t, u by v t' + g t'^2 / 2. */
    OK(hybmss_dynamics_get_displacements(dynamics, &to_u));
    fallen = u[2];
    parameters.integrator = HYBMSS_LEAPFROG;
    OK(hybmss_dynamics_step(dynamics, &parameters, 10));
    OK(hybmss_dynamics_get_displacements(dynamics, &to_u));
    EXPECT(fabs(u[2] - fallen + 10 * (100 + 50) * parameters.time_step * parameters.time_step) < 1e-12);
    OK(hybmss_dynamics_get_velocities(dynamics, &to_v));
    EXPECT(fabs(v[2] + 10 * 20 * parameters.time_step) < 1e-12);
    parameters.integrator = 2;
    REFUSED(hybmss_dynamics_step(dynamics, &parameters, 1), "integrator = 2");
    parameters.integrator = HYBMSS_SYMPLECTIC_EULER;

    /* Held and loaded nodes. */
    OK(hybmss_dynamics_prescribe(dynamics, &held, 1));
    OK(hybmss_dynamics_load(dynamics, &load, 1));
    OK(hybmss_dynamics_step(dynamics, &parameters, 5));
    OK(hybmss_dynamics_get_displacements(dynamics, &to_u));
    EXPECT(u[0] == 0 && u[1] == 0 && u[2] == 0 && u[3 * (NODES - 1)] > 0);
    OK(hybmss_dynamics_get_forces(dynamics, &to_v));
    OK(hybmss_dynamics_prescribe(dynamics, NULL, 0));
    OK(hybmss_dynamics_load(dynamics, NULL, 0));
    OK(hybmss_dynamics_set_displacements(dynamics, &from_u));
    OK(hybmss_dynamics_set_velocities(dynamics, &from_u));

    REFUSED(hybmss_dynamics_prescribe(NULL, &held, 1), "dynamics is null");
    REFUSED(hybmss_dynamics_prescribe(dynamics, NULL, 1), "nodes is null");
    REFUSED(hybmss_dynamics_prescribe(dynamics, &held, (size_t)-1), "more than there is memory");
    held.axes = 8;
    REFUSED(hybmss_dynamics_prescribe(dynamics, &held, 1), "axes");
    held.axes = 7, held.node = NODES;
    REFUSED(hybmss_dynamics_prescribe(dynamics, &held, 1), "prescribed node 120");
    held.node = 0, held.displacement[1] = NAN;
    REFUSED(hybmss_dynamics_prescribe(dynamics, &held, 1), "prescribed displacement");
    REFUSED(hybmss_dynamics_load(NULL, &load, 1), "dynamics is null");
    REFUSED(hybmss_dynamics_load(dynamics, NULL, 1), "loads is null");
    REFUSED(hybmss_dynamics_load(dynamics, &load, (size_t)-1), "more than there is memory");
    load.node = NODES;
    REFUSED(hybmss_dynamics_load(dynamics, &load, 1), "loaded node 120");
    load.node = 0, load.force[2] = INFINITY;
    REFUSED(hybmss_dynamics_load(dynamics, &load, 1), "not finite");
    REFUSED(hybmss_dynamics_step(NULL, &parameters, 1), "dynamics is null");
    REFUSED(hybmss_dynamics_step(dynamics, NULL, 1), "parameters is null");
    REFUSED(hybmss_dynamics_step(dynamics, &parameters, -1), "count = -1");
    parameters.time_step = NAN;
    REFUSED(hybmss_dynamics_step(dynamics, &parameters, 1), "time_step");
    parameters.time_step = dt / 2, parameters.acceleration[0] = NAN;
    REFUSED(hybmss_dynamics_step(dynamics, &parameters, 1), "acceleration");
    parameters.acceleration[0] = 0, parameters.mass_damping = -1;
    REFUSED(hybmss_dynamics_step(dynamics, &parameters, 1), "damping");
    REFUSED(hybmss_dynamics_get_displacements(NULL, &to_u), "dynamics is null");
    REFUSED(hybmss_dynamics_get_displacements(dynamics, NULL), "out is null");
    REFUSED(hybmss_dynamics_get_velocities(NULL, &to_u), "dynamics is null");
    REFUSED(hybmss_dynamics_get_velocities(dynamics, NULL), "out is null");
    REFUSED(hybmss_dynamics_get_forces(NULL, &to_u), "dynamics is null");
    REFUSED(hybmss_dynamics_get_forces(dynamics, NULL), "out is null");
    REFUSED(hybmss_dynamics_set_displacements(NULL, &from_u), "dynamics is null");
    REFUSED(hybmss_dynamics_set_displacements(dynamics, NULL), "in is null");
    REFUSED(hybmss_dynamics_set_velocities(NULL, &from_u), "dynamics is null");
    REFUSED(hybmss_dynamics_set_velocities(dynamics, NULL), "in is null");
    u[4] = NAN;
    REFUSED(hybmss_dynamics_set_displacements(dynamics, &from_u), "displacement of node 1");
    REFUSED(hybmss_dynamics_set_velocities(dynamics, &from_u), "velocity of node 1");
    REFUSED(hybmss_dynamics_energies(NULL, NULL, NULL, NULL), "dynamics is null");
    REFUSED(hybmss_dynamics_not_finite_at(NULL, &steps), "dynamics is null");
    REFUSED(hybmss_dynamics_not_finite_at(dynamics, NULL), "steps is null");
    REFUSED(hybmss_dynamics_masses(NULL, masses, NODES), "dynamics is null");
    REFUSED(hybmss_dynamics_masses(dynamics, NULL, NODES), "masses is null");
    REFUSED(hybmss_dynamics_masses(dynamics, masses, 1), "1 values given, 120 needed");
    {
        double damped = 0;
        OK(hybmss_dynamics_damp_springs(dynamics, 0.1));
        OK(hybmss_dynamics_critical_time_step(dynamics, &damped));
        EXPECT(damped < dt);
        REFUSED(hybmss_dynamics_damp_springs(dynamics, -1), "stiffness_damping = -1");
        REFUSED(hybmss_dynamics_damp_springs(NULL, 0), "dynamics is null");
        OK(hybmss_dynamics_damp_springs(dynamics, 0));
        OK(hybmss_dynamics_critical_time_step(dynamics, &damped));
        EXPECT(damped == dt);
    }
    {
        const uint32_t muscle[2] = {0, 3};
        const double short_ones[6] = {1, 0.8, 1, 1, 0.8, 1}, none[6] = {1, 1, 1, 1, 0, 1};
        double grown = 0;
        OK(hybmss_dynamics_actuate(dynamics, body, muscle, short_ones, 2));
        OK(hybmss_dynamics_critical_time_step(dynamics, &grown));
        EXPECT(fabs(dt * dt / (grown * grown) - 1.25) < 1e-9);
        OK(hybmss_dynamics_set_rest_stretches(dynamics, short_ones, 2));
        REFUSED(hybmss_dynamics_set_rest_stretches(dynamics, none, 2), "actuated cell 1 = 0");
        REFUSED(hybmss_dynamics_set_rest_stretches(dynamics, short_ones, 1), "1 stretches given for 2");
        REFUSED(hybmss_dynamics_actuate(dynamics, body, NULL, short_ones, 2), "cells is null");
        REFUSED(hybmss_dynamics_actuate(dynamics, NULL, muscle, short_ones, 2), "body is null");
        REFUSED(hybmss_dynamics_actuate(NULL, body, muscle, short_ones, 2), "dynamics is null");
        OK(hybmss_dynamics_actuate(dynamics, body, NULL, NULL, 0));
        OK(hybmss_dynamics_critical_time_step(dynamics, &grown));
        EXPECT(grown == dt);
    }
    {
        const hybmss_relaxation branches[2] = {{0.5, 0.1}, {0.25, 1}};
        const hybmss_relaxation bad = {0.5, 0};
        double remembering = 0;
        OK(hybmss_dynamics_relax(dynamics, body, branches, 2));
        OK(hybmss_dynamics_critical_time_step(dynamics, &remembering));
        EXPECT(fabs(dt * dt / (remembering * remembering) - 1.75) < 1e-9);
        REFUSED(hybmss_dynamics_relax(dynamics, body, &bad, 1), "time above 0");
        REFUSED(hybmss_dynamics_relax(dynamics, body, NULL, 1), "branches is null");
        REFUSED(hybmss_dynamics_relax(dynamics, NULL, branches, 2), "body is null");
        REFUSED(hybmss_dynamics_relax(NULL, body, branches, 2), "dynamics is null");
        OK(hybmss_dynamics_relax(dynamics, body, NULL, 0));
        OK(hybmss_dynamics_critical_time_step(dynamics, &remembering));
        EXPECT(remembering == dt);
    }
    {
        enum { FACES = 2 * (NX * NY + NY * NZ + NZ * NX) };
        static uint32_t faces[4 * FACES];
        static double pressures[FACES];
        const hybmss_step_parameters step = {dt / 2, {0, 0, 0}, 50, HYBMSS_LEAPFROG};
        size_t count = 0, n;
        double before = 0, after = 0;
        OK(hybmss_body_surface_faces(body, NULL, &count));
        EXPECT(count == FACES);
        OK(hybmss_body_surface_faces(body, faces, &count));
        for (n = 0; n < FACES; ++n) {
            EXPECT(faces[4 * n] < NODES);
        }
        OK(hybmss_dynamics_press(dynamics, body, faces, pressures, FACES));
        OK(hybmss_dynamics_energies(dynamics, &before, NULL, NULL));
        for (n = 0; n < FACES; ++n) {
            pressures[n] = 1e3;
        }
        OK(hybmss_dynamics_set_pressures(dynamics, pressures, FACES));
        OK(hybmss_dynamics_step(dynamics, &step, 20));
        OK(hybmss_dynamics_energies(dynamics, &after, NULL, NULL));
        EXPECT(after != before);
        REFUSED(hybmss_dynamics_set_pressures(dynamics, pressures, 1), "1 pressures given for 94 faces");
        REFUSED(hybmss_dynamics_set_pressures(dynamics, NULL, 1), "pressures is null");
        REFUSED(hybmss_dynamics_set_pressures(NULL, pressures, 1), "dynamics is null");
        faces[1] = NODES;
        REFUSED(hybmss_dynamics_press(dynamics, body, faces, pressures, FACES), "node 120");
        REFUSED(hybmss_dynamics_press(dynamics, body, NULL, pressures, 1), "nodes is null");
        REFUSED(hybmss_dynamics_press(dynamics, body, faces, NULL, 1), "pressures is null");
        REFUSED(hybmss_dynamics_press(dynamics, NULL, faces, pressures, 1), "body is null");
        REFUSED(hybmss_dynamics_press(NULL, body, faces, pressures, 1), "dynamics is null");
        REFUSED(hybmss_body_surface_faces(NULL, NULL, &count), "body is null");
        REFUSED(hybmss_body_surface_faces(body, NULL, NULL), "count is null");
        OK(hybmss_dynamics_press(dynamics, body, NULL, NULL, 0));
    }
    REFUSED(hybmss_dynamics_critical_time_step(NULL, &dt), "dynamics is null");
    REFUSED(hybmss_dynamics_critical_time_step(dynamics, NULL), "time_step is null");
    hybmss_dynamics_destroy(dynamics);
    hybmss_dynamics_destroy(NULL);
    hybmss_body_destroy(body);
}

/* A body that falls on a floor, is cut there, and what is left of its surface. */
static void obstacles_and_cuts(void) {
    enum { VERTICES = 2 * (4 * 5 + 4 * 6 + 5 * 6) - 4 * (4 + 5 + 6) + 8, TRIANGLES = 4 * (3 * 4 + 3 * 5 + 4 * 5) };
    hybmss_body *body = box(), *less = NULL, *other = NULL;
    hybmss_dynamics* dynamics = NULL;
    const double skin_vertices[9] = {1, 1, 0, 1.5, 1, 0, 1, 1.5, 0};
    const uint32_t skin_triangle[3] = {0, 2, 1};
    hybmss_obstacle floor = {HYBMSS_PLANE, {0, 0, 1}, {{0, 0, -0.01}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}, {0}}, 0.5, 0, 0,
                             NULL, 0, {0}};
    hybmss_obstacle_reading reading;
    hybmss_step_parameters parameters = {0, {0, 0, -0.1}, 5, HYBMSS_SYMPLECTIC_EULER};
    const uint32_t corner[2] = {0, 0}, outside = NX * NY * NZ;
    static double masses[NODES], vertices[3 * VERTICES];
    static uint32_t indices[NODES], triangles[3 * TRIANGLES];
    size_t count = 0, triangle_count = 0, smooth_count = 0, same_count = 0, removed = 9, n;
    double weight = 0;

    OK(hybmss_body_boundary_mesh(body, NULL, &count, NULL, &triangle_count));
    EXPECT(count == VERTICES && triangle_count == TRIANGLES);
    OK(hybmss_body_boundary_mesh(body, vertices, &count, triangles, &triangle_count));
    EXPECT(vertices[3 * VERTICES - 3] == NX * 0.5 && vertices[3 * VERTICES - 1] == NZ * 0.5);
    for (n = 0; n < 3 * TRIANGLES; ++n) {
        EXPECT(triangles[n] < VERTICES);
    }
    OK(hybmss_body_smooth_mesh(body, NULL, &smooth_count, NULL, &same_count));
    EXPECT(smooth_count == count && same_count == triangle_count);
    REFUSED(hybmss_body_smooth_mesh(NULL, NULL, &count, NULL, &count), "body is null");
    REFUSED(hybmss_body_boundary_mesh(NULL, NULL, &count, NULL, &count), "body is null");
    REFUSED(hybmss_body_boundary_mesh(body, NULL, NULL, NULL, &count), "vertex_count is null");
    REFUSED(hybmss_body_boundary_mesh(body, NULL, &count, NULL, NULL), "triangle_count is null");

    OK(hybmss_body_without_cells(body, corner, 2, &less));
    OK(hybmss_body_node_count(less, &count));
    EXPECT(count == NODES - 1);
    OK(hybmss_body_grid_indices(less, indices, count));
    EXPECT(indices[0] == 1);
    REFUSED(hybmss_body_without_cells(NULL, corner, 1, &other), "body is null");
    REFUSED(hybmss_body_without_cells(body, NULL, 1, &other), "cells is null");
    REFUSED(hybmss_body_without_cells(body, corner, 1, NULL), "less is null");
    REFUSED(hybmss_body_without_cells(body, &outside, 1, &other), "cell 60 is not in the grid, which has 60 cells");
    EXPECT(other == NULL);

    OK(hybmss_dynamics_create(body, HYBMSS_DOUBLE, NULL, &dynamics));
    OK(hybmss_dynamics_critical_time_step(dynamics, &parameters.time_step));
    parameters.time_step *= 0.9;
    REFUSED(hybmss_dynamics_remove_cells(dynamics, less, corner, 1, &removed),
            "body has 119 nodes and the dynamics 120");
    REFUSED(hybmss_dynamics_remove_cells(dynamics, body, &outside, 1, &removed), "60");
    REFUSED(hybmss_dynamics_remove_cells(dynamics, body, NULL, 1, &removed), "cells is null");
    REFUSED(hybmss_dynamics_remove_cells(dynamics, NULL, corner, 1, &removed), "body is null");
    REFUSED(hybmss_dynamics_remove_cells(NULL, body, corner, 1, &removed), "dynamics is null");
    EXPECT(removed == 9);
    OK(hybmss_dynamics_remove_cells(dynamics, body, corner, 2, &removed));
    EXPECT(removed == 1);
    OK(hybmss_dynamics_remove_cells(dynamics, body, corner, 1, NULL));

    /* At rest the floor bears the weight, with the nodes of the lower face that are left. */
    OK(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1));
    OK(hybmss_dynamics_step(dynamics, &parameters, 4000));
    OK(hybmss_dynamics_masses(dynamics, masses, NODES));
    for (n = 0; n < NODES; ++n) {
        weight += 0.1 * masses[n];
    }
    OK(hybmss_dynamics_obstacle_readings(dynamics, &reading, 1));
    EXPECT(reading.nodes > NX * NY && reading.nodes < (NX + 1) * (NY + 1)); /* those beside the hole may lift off */
    EXPECT(fabs(reading.force[2] - weight) < 1e-3 * weight);
    EXPECT(reading.depth > 0 && reading.depth <= reading.greatest_depth && reading.impulse[2] > 0);
    floor.pose.position[2] = -10;
    OK(hybmss_dynamics_move_obstacles(dynamics, &floor.pose, 1));
    OK(hybmss_dynamics_step(dynamics, &parameters, 1));
    OK(hybmss_dynamics_obstacle_readings(dynamics, &reading, 1));
    EXPECT(reading.nodes == 0);

    /* A skin of one triangle touches with its three points. */
    floor.pose.position[2] = 10;
    OK(hybmss_dynamics_set_skin_obstacles(dynamics, body, skin_vertices, 3, skin_triangle, 1, &floor, 1));
    OK(hybmss_dynamics_obstacle_readings(dynamics, &reading, 1));
    EXPECT(reading.nodes == 3 && reading.depth > 5);
    REFUSED(hybmss_dynamics_set_skin_obstacles(dynamics, body, NULL, 3, skin_triangle, 1, &floor, 1),
            "vertices is null");
    REFUSED(hybmss_dynamics_set_skin_obstacles(dynamics, less, skin_vertices, 3, skin_triangle, 1, &floor, 1),
            "it must be the body");
    floor.pose.position[2] = -10;

    REFUSED(hybmss_dynamics_set_obstacles(dynamics, less, &floor, 1), "it must be the body");
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, body, NULL, 1), "obstacles is null");
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, NULL, &floor, 1), "body is null");
    REFUSED(hybmss_dynamics_set_obstacles(NULL, body, &floor, 1), "dynamics is null");
    REFUSED(hybmss_dynamics_move_obstacles(dynamics, &floor.pose, 2), "2");
    REFUSED(hybmss_dynamics_move_obstacles(dynamics, NULL, 1), "poses is null");
    REFUSED(hybmss_dynamics_move_obstacles(NULL, &floor.pose, 1), "dynamics is null");
    REFUSED(hybmss_dynamics_obstacle_readings(dynamics, &reading, 2), "2 values given, 1 needed");
    REFUSED(hybmss_dynamics_obstacle_readings(dynamics, NULL, 1), "readings is null");
    REFUSED(hybmss_dynamics_obstacle_readings(NULL, &reading, 1), "dynamics is null");
    floor.shape = 5;
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1), "shape = 5");
    floor.shape = HYBMSS_SOLID, floor.solid = NULL;
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1), "solid is null");
    floor.shape = HYBMSS_SPHERE;
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1), "radius");
    floor.shape = HYBMSS_CAPSULE, floor.dimensions[0] = 1, floor.dimensions[1] = -1;
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1), "dimensions[1] = -1");
    hybmss_dynamics_destroy(dynamics);
    OK(hybmss_dynamics_create(body, HYBMSS_DOUBLE, NULL, &dynamics));
    /* along y, with its upper end half a metre above the corner at the origin */
    floor.dimensions[1] = 4, floor.pose.position[1] = -2.5, floor.pose.position[2] = 0;
    OK(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1));
    OK(hybmss_dynamics_obstacle_readings(dynamics, &reading, 1));
    EXPECT(fabs(reading.depth - 0.5) < 1e-12);
    floor.shape = HYBMSS_BOX, floor.dimensions[0] = 1, floor.dimensions[1] = 1;
    OK(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1));
    /* the same depth in solids that are made, and destroyed while they are touched */
    const double corners[] = {-1, -1, -1, 1, -1, -1, -1, 1, -1, 1, 1, -1, -1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1};
    const uint32_t faces[] = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                              2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
    const double flat[] = {1, 1, 1, 1}, spacing[] = {2, 2};
    const size_t counts[] = {2, 2}, too_many[] = {SIZE_MAX, SIZE_MAX};
    hybmss_solid* solids[3] = {NULL, NULL, NULL};
    OK(hybmss_solid_create_hull(corners, 8, &solids[0]));
    OK(hybmss_solid_create_mesh(corners, 8, faces, 12, 16, &solids[1]));
    OK(hybmss_solid_create_heights(flat, counts, spacing, &solids[2]));
    for (int s = 0; s < 3; ++s) {
        floor.shape = HYBMSS_SOLID, floor.solid = solids[s];
        floor.pose.position[1] = -0.75;
        OK(hybmss_dynamics_set_obstacles(dynamics, body, &floor, 1));
        hybmss_solid_destroy(solids[s]);
        OK(hybmss_dynamics_obstacle_readings(dynamics, &reading, 1));
        EXPECT(fabs(reading.depth - 0.25) < 1e-12);
    }
    hybmss_solid_destroy(NULL);
    floor.solid = NULL;
    REFUSED(hybmss_solid_create_hull(corners, 3, &solids[0]), "3 points given");
    REFUSED(hybmss_solid_create_hull(corners, 8, NULL), "solid is null");
    REFUSED(hybmss_solid_create_hull(NULL, 8, &solids[0]), "points is null");
    REFUSED(hybmss_solid_create_mesh(corners, 8, faces, 11, 0, &solids[1]), "not closed");
    REFUSED(hybmss_solid_create_mesh(corners, 8, faces, 12, 3, &solids[1]), "cells = 3");
    REFUSED(hybmss_solid_create_mesh(corners, 7, faces, 12, 0, &solids[1]), "has the vertex 7");
    REFUSED(hybmss_solid_create_heights(flat, too_many, spacing, &solids[2]), "heights are not allowed");
    REFUSED(hybmss_solid_create_heights(NULL, counts, spacing, &solids[2]), "heights is null");
    /* A free ball falls alone, by symplectic Euler. */
    hybmss_pose pose;
    hybmss_obstacle ball = {HYBMSS_SPHERE, {0.5, 0, 0}, {{0, 0, 20}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}, {0}}, 0, 0, 0,
                            NULL, 2, {0}};
    const double before_ball[3] = {parameters.acceleration[0], parameters.acceleration[1], parameters.acceleration[2]};
    parameters.acceleration[0] = parameters.acceleration[1] = 0, parameters.acceleration[2] = -10;
    OK(hybmss_dynamics_set_obstacles(dynamics, body, &ball, 1));
    OK(hybmss_dynamics_step(dynamics, &parameters, 10));
    OK(hybmss_dynamics_obstacle_poses(dynamics, &pose, 1));
    EXPECT(fabs(pose.velocity[2] + 100 * parameters.time_step) < 1e-12);
    EXPECT(fabs(pose.position[2] - 20 + 550 * parameters.time_step * parameters.time_step) < 1e-12);
    EXPECT(pose.rotation[0] == 1 && pose.angular_velocity[2] == 0);
    REFUSED(hybmss_dynamics_obstacle_poses(dynamics, &pose, 2), "2 values given, 1 needed");
    REFUSED(hybmss_dynamics_obstacle_poses(dynamics, NULL, 1), "poses is null");
    ball.mass = -1;
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, body, &ball, 1), "mass = -1");
    ball.mass = 1, ball.shape = HYBMSS_PLANE, ball.dimensions[1] = 1;
    REFUSED(hybmss_dynamics_set_obstacles(dynamics, body, &ball, 1), "cannot be free");
    memcpy(parameters.acceleration, before_ball, sizeof before_ball);
    OK(hybmss_dynamics_set_obstacles(dynamics, body, NULL, 0));
    OK(hybmss_dynamics_obstacle_readings(dynamics, NULL, 0));
    hybmss_dynamics_destroy(dynamics);
    hybmss_body_destroy(less);
    hybmss_body_destroy(body);
}

/* ---- hooks ---- */

struct arena {
    long taken, given_back;
    int left; /* allocations until there is no memory; < 0: no end */
};

#ifdef _WIN32
static int posix_memalign(void** memory, size_t alignment, size_t bytes) {
    *memory = _aligned_malloc(bytes, alignment);
    return *memory == NULL;
}
#define free_aligned _aligned_free
#else
#define free_aligned free
#endif

static void* take(size_t bytes, size_t alignment, void* user) {
    struct arena* arena = user;
    void* memory = NULL;
    if (arena->left == 0) {
        return NULL;
    }
    --arena->left;
    ++arena->taken;
    return posix_memalign(&memory, alignment, bytes) == 0 ? memory : NULL;
}
static void give_back(void* memory, size_t bytes, size_t alignment, void* user) {
    struct arena* arena = user;
    (void)bytes;
    (void)alignment;
    ++arena->given_back;
    free_aligned(memory);
}

static void allocators(void) {
    struct arena arena = {0, 0, -1};
    hybmss_allocator allocator = {take, give_back, NULL};
    hybmss_body* body = box();
    hybmss_plan *plan, *none = NULL;
    allocator.user = &arena;
    OK(hybmss_set_allocator(&allocator));
    plan = plan_of(body, HYBMSS_FLOAT);
    EXPECT(arena.taken > 0 && arena.given_back < arena.taken);
    OK(hybmss_set_allocator(NULL));
    hybmss_plan_destroy(plan); /* to where it came from */
    EXPECT(arena.given_back == arena.taken);

    arena.left = 3;
    OK(hybmss_set_allocator(&allocator));
    EXPECT(hybmss_plan_create(body, HYBMSS_FLOAT, NULL, &none) == HYBMSS_OUT_OF_MEMORY);
    EXPECT(none == NULL && strcmp(hybmss_last_error(), "out of memory") == 0);
    EXPECT(arena.given_back == arena.taken);
    allocator.release = NULL;
    REFUSED(hybmss_set_allocator(&allocator), "both");
    OK(hybmss_set_allocator(NULL));
    hybmss_body_destroy(body);
}

static void worlds(void) {
    const int32_t cells[3] = {3, 3, 3};
    const double above[3] = {0.02, 0.3, 0.02}, corner[3] = {0.32, 0.6, 0.32};
    hybmss_material firm = hybmss_default_material();
    hybmss_body* cube = NULL;
    hybmss_world* world = NULL;
    hybmss_dynamics *low = NULL, *high = NULL, *none = NULL;
    size_t numbers[2] = {9, 9}, pointer = 9, i;
    firm.young_modulus = 1e6;
    OK(hybmss_lattice_create(cells, 0.1, NULL, 0, &firm, &cube));
    OK(hybmss_world_create(HYBMSS_DOUBLE, 1, &world));
    OK(hybmss_world_add(world, cube, NULL, NULL, &numbers[0], &low));
    OK(hybmss_world_add(world, cube, NULL, above, &numbers[1], &high));
    EXPECT(numbers[0] == 0 && numbers[1] == 1);

    const hybmss_obstacle ground = {
        HYBMSS_PLANE, {0, 1, 0}, {{0, 0, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 0, 0}, {0, 0, 0}}, 0.5, 0, 0, NULL, 0, {0}};
    const hybmss_body_contact contact = {0, 1, 0.5, 0, 0};
    hybmss_body_contact_reading reading;
    hybmss_step_parameters parameters = {0};
    double weight = 0, masses[64], force[3];
    OK(hybmss_dynamics_set_obstacles(low, cube, &ground, 1));
    OK(hybmss_world_set_contacts(world, &contact, 1));
    OK(hybmss_world_critical_time_step(world, &parameters.time_step));
    parameters.time_step *= 0.5;
    parameters.acceleration[1] = -10;
    parameters.mass_damping = 20;
    OK(hybmss_world_step(world, &parameters, 6000));
    OK(hybmss_world_contact_readings(world, &reading, 1));
    OK(hybmss_dynamics_masses(high, masses, 64));
    for (i = 0; i < 64; ++i) {
        weight += 10 * masses[i];
    }
    EXPECT(fabs(reading.force[1] + weight) < 1e-3 * weight && reading.nodes > 0);

    const hybmss_anchor hook = {1, {corner[0], corner[1], corner[2]}};
    hybmss_anchor hand = {HYBMSS_IN_SPACE, {corner[0], corner[1], corner[2]}};
    OK(hybmss_world_attach(world, &hook, &hand, 1e5, &pointer));
    hand.point[1] += 0.5; /* it turns about its corner as it hangs */
    OK(hybmss_world_move_anchor(world, pointer, hand.point));
    OK(hybmss_world_step(world, &parameters, 6000));
    OK(hybmss_world_attachment_force(world, pointer, force));
    EXPECT(fabs(force[1] - weight) < 1e-2 * weight);
    OK(hybmss_world_contact_readings(world, &reading, 1));
    EXPECT(reading.nodes == 0);
    OK(hybmss_world_detach(world, pointer));

    hybmss_pose pose = ground.pose;
    pose.velocity[0] = 1;
    OK(hybmss_world_place(world, 1, &pose));
    REFUSED(hybmss_world_place(world, 2, &pose), "body 2 is not there: the world has 2");
    pose.rotation[0] = 2;
    REFUSED(hybmss_world_place(world, 1, &pose), "body 1: its rotation must be");
    const hybmss_shared_obstacle same[2] = {{0, 0, 0}, {1, 0, 0}};
    REFUSED(hybmss_world_set_shared_obstacles(world, same, 2), "obstacle 0 of body 0 is not there or not free");
    REFUSED(hybmss_world_set_shared_obstacles(world, NULL, 2), "obstacles is null");
    OK(hybmss_world_set_shared_obstacles(world, NULL, 0));
    REFUSED(hybmss_world_step(world, &parameters, -1), "count = -1");
    REFUSED(hybmss_world_detach(world, 7), "attachment 7 is not there");
    REFUSED(hybmss_world_attach(world, &hand, &hand, 1, &pointer), "between two points in space");
    REFUSED(hybmss_world_add(world, NULL, NULL, NULL, &numbers[0], &none), "body is null");
    EXPECT(none == NULL);

    const uint32_t first[2] = {0, 1};
    size_t removed = 9;
    OK(hybmss_world_remove_cells(world, 0, cube, first, 2, &removed));
    EXPECT(removed == 2);
    REFUSED(hybmss_world_remove_cells(world, 3, cube, first, 2, &removed), "body 3 is not there");
    OK(hybmss_dynamics_set_obstacles(high, cube, &ground, 1)); /* where it was added: above the ground */
    hybmss_obstacle_reading on_ground;
    OK(hybmss_dynamics_obstacle_readings(high, &on_ground, 1));
    EXPECT(on_ground.nodes == 0);
    OK(hybmss_world_step(world, &parameters, 1));
    OK(hybmss_dynamics_remove_cells(high, cube, first, 1, NULL));
    REFUSED(hybmss_world_step(world, &parameters, 1), "cells of body 1 were removed through the body itself");

    hybmss_world_destroy(world); /* what it has lent lives on */
    double v[192];
    const hybmss_field field = hybmss_double_field(v, 64, 3);
    OK(hybmss_dynamics_get_velocities(high, &field));
    EXPECT(v[189] > 0.9);
    hybmss_dynamics_destroy(low);
    hybmss_dynamics_destroy(high);
    hybmss_body_destroy(cube);
}

/* The bar's middle cell goes, and its ends part. */
static void parts_of_a_body(void) {
    const int32_t cells[3] = {5, 1, 1};
    hybmss_material firm = hybmss_default_material();
    hybmss_body* bar = NULL;
    hybmss_world* world = NULL;
    hybmss_dynamics* whole = NULL;
    hybmss_body_part part = {9, NULL, NULL};
    const double origin[3] = {0, 2, 0};
    const uint32_t middle = 2;
    size_t number = 9, count = 9;
    firm.density = 1000;
    OK(hybmss_lattice_create(cells, 0.1, NULL, 0, &firm, &bar));
    OK(hybmss_world_create(HYBMSS_DOUBLE, 1, &world));
    OK(hybmss_world_add(world, bar, NULL, origin, &number, &whole));
    OK(hybmss_world_split_parts(world, 0, bar, NULL, NULL, 0, &count));
    EXPECT(count == 0);
    OK(hybmss_world_remove_cells(world, 0, bar, &middle, 1, NULL));
    REFUSED(hybmss_world_split_parts(world, 0, bar, NULL, NULL, 0, &count), "capacity = 0");
    REFUSED(hybmss_world_split_parts(world, 0, bar, NULL, &part, 1, NULL), "count is null");
    REFUSED(hybmss_world_split_parts(world, 1, bar, NULL, &part, 1, &count), "body 1 is not there");
    EXPECT(count == 0 && part.body == NULL);
    double v[72];
    for (int i = 0; i < 72; ++i) {
        v[i] = i;
    }
    const hybmss_const_field given = hybmss_const_double_field(v, 24, 3);
    OK(hybmss_dynamics_set_velocities(whole, &given));
    OK(hybmss_world_split_parts(world, 0, bar, NULL, &part, 1, &count));
    EXPECT(count == 1 && part.number == 1);
    OK(hybmss_body_node_count(part.body, &count));
    EXPECT(count == 12);
    double own[36], masses[12], sum = 0;
    const hybmss_field field = hybmss_double_field(own, 12, 3);
    OK(hybmss_dynamics_get_velocities(part.dynamics, &field));
    EXPECT(own[0] == 9 && own[35] == 71); /* of node 3 of the whole, and of its last */
    OK(hybmss_dynamics_masses(part.dynamics, masses, 12));
    for (int n = 0; n < 12; ++n) {
        sum += masses[n];
    }
    EXPECT(fabs(sum - 2) < 1e-12);
    const hybmss_obstacle ground = {
        HYBMSS_PLANE, {0, 1, 0}, {{0, 2.01, 0}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}, {0}}, 0, 0, 0, NULL, 0, {0}};
    hybmss_obstacle_reading reading;
    OK(hybmss_dynamics_set_obstacles(part.dynamics, part.body, &ground, 1)); /* where the bar was added */
    OK(hybmss_dynamics_obstacle_readings(part.dynamics, &reading, 1));
    EXPECT(reading.nodes == 6);
    hybmss_world_destroy(world);
    hybmss_dynamics_destroy(part.dynamics);
    hybmss_dynamics_destroy(whole);
    hybmss_body_destroy(part.body);
    hybmss_body_destroy(bar);
}

static int stop_at_once(double fraction, int32_t iteration, double residual, void* user) {
    ++*(int*)user;
    return fraction <= 1 && iteration >= 0 && residual >= 0;
}

static void equilibria(void) {
    hybmss_body* body = box();
    hybmss_equilibrium* equilibrium = NULL;
    hybmss_equilibrium_options options = hybmss_default_equilibrium_options();
    hybmss_equilibrium_result result, untouched;
    hybmss_prescribed_node feet[(NX + 1) * (NY + 1)];
    hybmss_loading loading = {0};
    hybmss_obstacle floor = {HYBMSS_PLANE, {0, 0, 1}, {{0, 0, -0.01}, {1, 0, 0, 0, 1, 0, 0, 0, 1}, {0}, {0}}, 0, 0, 0,
                             NULL, 0, {0}};
    static double u[3 * NODES], v[3 * NODES], mapped[3 * NODES], stretches[3 * NX * NY * NZ];
    static float narrow[3 * NODES];
    static uint32_t backwards[NODES], cells[NX * NY * NZ];
    const uint32_t face[4] = {0, NX + 1, NX + 2, 1};
    const double pressure = 10;
    hybmss_field field = hybmss_double_field(u, NODES, 3), velocities = hybmss_double_field(v, NODES, 3);
    hybmss_field back = hybmss_double_field(mapped, NODES, 3), floats = hybmss_float_field(narrow, NODES, 3);
    int calls = 0;
    size_t n;

    memset(&untouched, 7, sizeof untouched);
    memset(feet, 0, sizeof feet);
    for (n = 0; n < (NX + 1) * (NY + 1); ++n) {
        feet[n].node = (uint32_t)n;
        feet[n].axes = 7;
    }
    for (n = 0; n < NODES; ++n) {
        backwards[n] = (uint32_t)(NODES - 1 - n);
    }
    back.map = backwards;
    loading.supports = feet;
    loading.support_count = (NX + 1) * (NY + 1);
    loading.acceleration[2] = -0.1;

    OK(hybmss_equilibrium_create(body, HYBMSS_DOUBLE, NULL, &equilibrium));
    OK(hybmss_equilibrium_solve(equilibrium, &loading, &field, NULL, &result));
    EXPECT(result.outcome == HYBMSS_CONVERGED && result.load_fraction == 1 && result.residual < options.tolerance);
    EXPECT(u[3 * NODES - 1] < 0 && result.least_volume_ratio < 1 && result.potential < 0);
    EXPECT(strcmp(hybmss_equilibrium_message(equilibrium), "") == 0);
    OK(hybmss_equilibrium_solve(equilibrium, &loading, &back, NULL, &result));
    for (n = 0; n < NODES; ++n) {
        EXPECT(mapped[3 * (NODES - 1 - n) + 2] == u[3 * n + 2]);
    }
    /* Held where it is, the body stays; let go of its weight, it comes back. */
    OK(hybmss_equilibrium_step(equilibrium, &loading, 0.1, 0, &field, &velocities, NULL, &result));
    EXPECT(result.outcome == HYBMSS_CONVERGED && fabs(v[3 * NODES - 1]) < 1e-6);
    loading.acceleration[2] = 0;
    OK(hybmss_equilibrium_step(equilibrium, &loading, 0.1, 0, &field, &velocities, NULL, &result));
    EXPECT(v[3 * NODES - 1] > 1e-6);

    /* Cells of another size, a pressed face, an obstacle. */
    for (n = 0; n < NX * NY * NZ; ++n) {
        cells[n] = (uint32_t)n;
        stretches[3 * n] = stretches[3 * n + 1] = 1;
        stretches[3 * n + 2] = 0.9;
    }
    OK(hybmss_equilibrium_actuate(equilibrium, cells, NX * NY * NZ));
    loading.stretches = stretches;
    loading.stretch_count = NX * NY * NZ;
    OK(hybmss_equilibrium_solve(equilibrium, &loading, &field, NULL, &result));
    EXPECT(result.outcome == HYBMSS_CONVERGED && fabs(u[3 * NODES - 1] + 0.1 * NZ * 0.5) < 0.05);
    loading.stretch_count = 3;
    REFUSED(hybmss_equilibrium_solve(equilibrium, &loading, &field, NULL, &untouched), "3 stretches given for 60");
    loading.stretch_count = 0;
    OK(hybmss_equilibrium_actuate(equilibrium, NULL, 0));
    OK(hybmss_equilibrium_press(equilibrium, body, face, 1));
    loading.pressures = &pressure;
    loading.pressure_count = 1;
    OK(hybmss_equilibrium_solve(equilibrium, &loading, &field, NULL, &result)); /* on held nodes: no matter */
    EXPECT(result.outcome == HYBMSS_CONVERGED);
    loading.pressure_count = 0;
    loading.support_count = 0;
    loading.acceleration[2] = -0.1;
    OK(hybmss_equilibrium_solve(equilibrium, &loading, &field, NULL, &result));
    EXPECT(result.outcome == HYBMSS_UNBOUNDED && strstr(hybmss_equilibrium_message(equilibrium), "along z"));
    OK(hybmss_equilibrium_set_obstacles(equilibrium, body, &floor, 1));
    memset(u, 0, sizeof u);
    options.tolerance = 1e-6;
    OK(hybmss_equilibrium_solve(equilibrium, &loading, &field, &options, &result));
    EXPECT(result.outcome == HYBMSS_CONVERGED && u[2] < -0.01);
    floor.friction = 0.5;
    REFUSED(hybmss_equilibrium_set_obstacles(equilibrium, body, &floor, 1), "friction");

    options.progress = stop_at_once;
    options.user = &calls;
    OK(hybmss_equilibrium_solve(equilibrium, &loading, &field, &options, &result));
    EXPECT(result.outcome == HYBMSS_STOPPED && calls > 0);
    options.tolerance = 2;
    REFUSED(hybmss_equilibrium_solve(equilibrium, &loading, &field, &options, &untouched), "tolerance = 2");
    options = hybmss_default_equilibrium_options();
    options.preconditioner = 3;
    REFUSED(hybmss_equilibrium_solve(equilibrium, &loading, &field, &options, &untouched), "preconditioner = 3");
    options.preconditioner = 0;
    options.leave_saddles = 2;
    REFUSED(hybmss_equilibrium_solve(equilibrium, &loading, &field, &options, &untouched), "leave_saddles = 2");
    REFUSED(hybmss_equilibrium_solve(NULL, &loading, &field, NULL, &untouched), "equilibrium is null");
    REFUSED(hybmss_equilibrium_solve(equilibrium, NULL, &field, NULL, &untouched), "loading is null");
    REFUSED(hybmss_equilibrium_solve(equilibrium, &loading, NULL, NULL, &untouched), "displacements is null");
    REFUSED(hybmss_equilibrium_solve(equilibrium, &loading, &floats, NULL, &untouched), "displacements");
    REFUSED(hybmss_equilibrium_solve(equilibrium, &loading, &field, NULL, NULL), "result is null");
    EXPECT(((unsigned char*)&untouched)[0] == 7);
    REFUSED(hybmss_equilibrium_step(equilibrium, &loading, 0, 0, &field, &velocities, NULL, &result), "time_step = 0");
    REFUSED(hybmss_equilibrium_step(equilibrium, &loading, 1, 0, &field, NULL, NULL, &result), "velocities is null");
    REFUSED(hybmss_equilibrium_press(equilibrium, NULL, face, 1), "body is null");
    REFUSED(hybmss_equilibrium_press(equilibrium, body, NULL, 1), "nodes is null");
    REFUSED(hybmss_equilibrium_set_obstacles(equilibrium, NULL, &floor, 1), "body is null");
    REFUSED(hybmss_equilibrium_actuate(equilibrium, NULL, 1), "cells is null");
    REFUSED(hybmss_equilibrium_create(NULL, HYBMSS_DOUBLE, NULL, &equilibrium), "body is null");
    EXPECT(strcmp(hybmss_equilibrium_message(NULL), "equilibrium is null") == 0);
    hybmss_equilibrium_destroy(equilibrium);
    hybmss_equilibrium_destroy(NULL);
    hybmss_body_destroy(body);
}

int main(void) {
    char version[32];
    snprintf(version, sizeof version, "%d.%d.%d", HYBMSS_VERSION_MAJOR, HYBMSS_VERSION_MINOR, HYBMSS_VERSION_PATCH);
    EXPECT(strcmp(hybmss_last_error(), "") == 0);
    EXPECT(strcmp(hybmss_status_name(HYBMSS_OUT_OF_MEMORY), "out of memory") == 0);
    EXPECT(strcmp(hybmss_status_name(99), "unknown status") == 0);
    EXPECT(strcmp(hybmss_version(), version) == 0);
    bodies();
    networks();
    cells_of_other_shapes();
    separation();
    cells_of_materials();
    networks_on_means();
    layouts();
    second_derivatives();
    refused_fields();
    motion();
    obstacles_and_cuts();
    equilibria();
    worlds();
    parts_of_a_body();
    allocators();
    if (failures > 0) {
        printf("%d checks failed\n", failures);
        return 1;
    }
    printf("all checks passed\n");
    return 0;
}
