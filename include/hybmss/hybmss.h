#ifndef HYBMSS_HYBMSS_H
#define HYBMSS_HYBMSS_H

/*
 * hybmss in C99: bodies of hybrid mass-spring systems, their forces over memory of the caller's, and their motion.
 *
 * Every function that can fail returns a hybmss_status; hybmss_last_error() then says what was given and what is
 * allowed. Nothing is written to an output of a call that failed, but to `error` of hybmss_record_compare_* where they
 * return HYBMSS_MISMATCH. No C++ exception leaves a function, and none aborts. A null pointer is an error wherever it
 * is not said to be allowed. SI units. Order of indices: x fastest, then y, then z.
 *
 * Objects are made by *_create and go by *_destroy, which takes null too. A body may go before the plans made of it.
 * One body or plan may be used by any number of threads at the same time; a hybmss_dynamics by one at a time.
 */

#include "hybmss/export.h"
#include "hybmss/version.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- status ---- */

typedef enum hybmss_status {
    HYBMSS_OK = 0,
    HYBMSS_INVALID_ARGUMENT = 1, /* what was given is not allowed */
    HYBMSS_OUT_OF_MEMORY = 2,
    HYBMSS_FILE_ERROR = 3, /* a file cannot be read or written, is damaged, or is of another kind */
    HYBMSS_MISMATCH = 4,   /* forces or energies differ from recorded ones by more than the tolerance */
    HYBMSS_INTERNAL_ERROR = 5
} hybmss_status;

/* "ok", "invalid argument", ...; "unknown status" for other numbers. Never null. */
HYBMSS_EXPORT const char* hybmss_status_name(int status);

/* Why the last call on this thread that failed did so, in one line; "" before the first one. Valid until the next
 * failure on this thread. */
HYBMSS_EXPORT const char* hybmss_last_error(void);

/* The version of the library at run time, "major.minor.patch"; HYBMSS_VERSION_MAJOR and so on are the header's. */
HYBMSS_EXPORT const char* hybmss_version(void);

/* ---- hooks ---- */

/* Where large arrays come from; small things stay with C++'s operator new. The functions may be called from several
 * threads at the same time. allocate: `bytes` > 0 aligned to `alignment` (a power of two), or null where there is no
 * memory: the call under way then fails with HYBMSS_OUT_OF_MEMORY. release: `memory` is never null. */
typedef struct hybmss_allocator {
    void* (*allocate)(size_t bytes, size_t alignment, void* user);
    void (*release)(void* memory, size_t bytes, size_t alignment, void* user);
    void* user; /* handed back to both */
} hybmss_allocator;

/* For arrays made from now on, in the whole process; each goes back to where it came from. Null: back to the default.
 */
HYBMSS_EXPORT hybmss_status hybmss_set_allocator(const hybmss_allocator* allocator);

/* Threads of the caller's in place of oneTBB's: enqueue arranges that task(context) runs exactly once, at the latest
 * within finish, and returns a handle; null means that it ran serially, within enqueue. finish is called once for every
 * handle that is not null, on the thread that enqueued it, and returns when its task has run. Tasks may run at any time
 * in between, on any thread: results are the same to the bit. */
typedef struct hybmss_task_runner {
    int threads; /* at most, at work on one call, the caller's included; >= 1 */
    void* (*enqueue)(void (*task)(void* context), void* context, void* user);
    void (*finish)(void* handle, void* user);
    void* user; /* handed back to both; what it points to must live as long as the plans made with it */
} hybmss_task_runner;

/* ---- materials and bodies ---- */

/* Numbers that the caller gives are plain integers, so that a wrong one is an error and not undefined. */
typedef int32_t hybmss_volume_energy;
enum {
    HYBMSS_VOLUME_AUTOMATIC = 0,    /* quadratic for nu >= 1/4, mean stretch below */
    HYBMSS_VOLUME_QUADRATIC = 1,    /* phi = (J - 1)^2 / 2 */
    HYBMSS_VOLUME_MEAN_STRETCH = 2, /* phi = 9/2 (cbrt(J) - 1)^2 */
    HYBMSS_VOLUME_NONE = 3          /* springs only */
};

/* Where springs act. */
typedef int32_t hybmss_springs;
enum {
    HYBMSS_SPRINGS_NODES = 0, /* between nodes */
    HYBMSS_SPRINGS_MEANS = 1  /* on the means of each cell (HybMSS-M) */
};

typedef struct hybmss_material {
    double young_modulus;       /* Pa, > 0 */
    double poisson_ratio;       /* in (-1, 1/2) */
    double density;             /* kg/m^3, > 0 */
    double face_diagonal_ratio; /* A = k_f / k_c >= 0; 0: no face diagonals */
    hybmss_volume_energy volume_energy;
    /* Springs of strain e bear k l (e + quadratic e^2 + cubic e^3); 0 and 0: linear ones. Allowed is what leaves their
     * energy convex: cubic >= 0, 1 + 2 quadratic e + 3 cubic e^2 >= 0 for e >= -1. */
    double stiffening_quadratic, stiffening_cubic;
    hybmss_springs springs;
    /* Cells below the volume ratio J0 = crush_ratio, in (0, 1), store G V0 crush_resistance (J0 - J)^3 / (3 J0^2);
     * 0: none. Of lattices alone. */
    double crush_resistance, crush_ratio;
} hybmss_material;

/* E = 1e4 Pa, nu = 0.25, 1000 kg/m^3, A = 1, automatic, linear springs between nodes, no crush resistance. */
HYBMSS_EXPORT hybmss_material hybmss_default_material(void);

/* A body at rest: its shape and its material. Immutable. */
typedef struct hybmss_body hybmss_body;

/* cells[0] x cells[1] x cells[2] cubic cells with edges of `cell_size` m; the low corner is the origin. `scales`: a
 * stiffness scale for every cell, finite and >= 0 (0: no cell there), `scale_count` = the number of cells; null and 0
 * for a full box. Copied. The body's nodes are the grid nodes that touch a cell, in the grid's order. */
HYBMSS_EXPORT hybmss_status hybmss_lattice_create(const int32_t cells[3], double cell_size, const float* scales,
                                                  size_t scale_count, const hybmss_material* material,
                                                  hybmss_body** body);

/* The same of cells of several materials: label 0 is no cell, n is materials[n - 1], `label_count` = the number of
 * cells. The materials, at most 255, may differ in Young's modulus, Poisson's ratio and density; with springs on means
 * in the first and the last. */
HYBMSS_EXPORT hybmss_status hybmss_lattice_create_of_materials(const int32_t cells[3], double cell_size,
                                                               const uint8_t* labels, size_t label_count,
                                                               const hybmss_material* materials, size_t material_count,
                                                               hybmss_body** body);

typedef struct hybmss_spring {
    int32_t a, b;          /* nodes, a != b */
    double stiffness;      /* N/m, >= 0 */
    double rest_vector[3]; /* X_b - X_a, m, not zero */
} hybmss_spring;

/* A hexahedron; bit 0 of a corner's number: high side in x, bit 1: y, bit 2: z. */
typedef struct hybmss_cell {
    int32_t nodes[8];
    double kappa; /* Pa; energy kappa V0 phi(V'/V0) */
} hybmss_cell;

/* Explicit springs and cells. All arrays are copied. */
typedef struct hybmss_network {
    const double* rest_positions; /* x y z a node, m */
    const double* masses;         /* one a node, kg, > 0 */
    size_t node_count;
    const hybmss_spring* springs; /* may be null where spring_count is 0 */
    size_t spring_count;
    const hybmss_cell* cells; /* may be null where cell_count is 0 */
    size_t cell_count;
    hybmss_volume_energy volume_energy; /* quadratic or mean stretch where there are cells */
} hybmss_network;

HYBMSS_EXPORT hybmss_status hybmss_network_create(const hybmss_network* network, hybmss_body** body);
/* With cells that have springs on their means (HybMSS-M), cubes with edges along x, y and z: so many times those that a
 * cube of `material` with edges of `cell_size` m has, by `scales`, one a cell, finite and >= 0; 0: a volume alone. Of
 * the material nothing else counts but how all springs stiffen. Where every kappa is 0, volume_energy may be none. */
HYBMSS_EXPORT hybmss_status hybmss_network_create_on_means(const hybmss_network* network,
                                                           const hybmss_material* material, double cell_size,
                                                           const double* scales, size_t scale_count,
                                                           hybmss_body** body);
/* ---- cells of other shapes: hybmss/polyhedra.hpp ---- */

typedef enum hybmss_cell_shape { /* the value is the number of nodes */
                                 HYBMSS_TETRAHEDRON = 4,
                                 HYBMSS_PYRAMID = 5,
                                 HYBMSS_PRISM = 6
} hybmss_cell_shape;

typedef struct hybmss_polyhedron {
    int32_t shape;    /* a hybmss_cell_shape */
    int32_t nodes[6]; /* the first 4, 5 or 6 count; in either orientation */
} hybmss_polyhedron;

/* How good fitted springs are, relative: see FittedCells. */
typedef struct hybmss_spring_fit {
    double misfit, anisotropy, modulus_error;
    size_t without; /* pairs of nodes that have no spring */
} hybmss_spring_fit;

/* A box of cells[0] x cells[1] x cells[2] cubes with edges of `edge` m that tetrahedra, whose nodes resist the change
 * of the volume around them, or pyramids fill; or two prisms, `height` m high, in the place of each, on equilateral
 * triangles. Their springs are isotropic. `height` is used by prisms alone. */
HYBMSS_EXPORT hybmss_status hybmss_cells_create(hybmss_cell_shape shape, const int32_t cells[3], double edge,
                                                double height, const hybmss_material* material, hybmss_body** body);
/* Any mesh of such cells, x y z (m) a node, with springs fitted to it. Refused where anisotropy or the error of the
 * shear modulus are above `most_anisotropy` (0.1 is much). `fit` may be null. */
HYBMSS_EXPORT hybmss_status hybmss_mesh_create(const double* nodes, size_t node_count, const hybmss_polyhedron* cells,
                                               size_t cell_count, const hybmss_material* material,
                                               double most_anisotropy, hybmss_spring_fit* fit, hybmss_body** body);
/* The same of a file: Gmsh's .msh (2.2, 4.1) or VTK's legacy .vtk, as plain text. */
HYBMSS_EXPORT hybmss_status hybmss_mesh_read(const char* path, const hybmss_material* material, double most_anisotropy,
                                             hybmss_spring_fit* fit, hybmss_body** body);
/* Such cells of a body: writes their count, and the cells where these are not null: as many as a first call with null
 * gives. */
HYBMSS_EXPORT hybmss_status hybmss_body_polyhedra(const hybmss_body* body, hybmss_polyhedron* cells, size_t* count);

/* A lattice less some cells, by their indices i + nx (j + ny k); those without a cell are passed over. Its nodes are
 * those that still touch a cell: hybmss_body_grid_indices says which. */
HYBMSS_EXPORT hybmss_status hybmss_body_without_cells(const hybmss_body* body, const uint32_t* cells, size_t count,
                                                      hybmss_body** less);
HYBMSS_EXPORT void hybmss_body_destroy(hybmss_body* body);

HYBMSS_EXPORT hybmss_status hybmss_body_node_count(const hybmss_body* body, size_t* count);
/* Writes x y z a node, m, to an array of 3 * the node count values; `count` is that of the values given. */
HYBMSS_EXPORT hybmss_status hybmss_body_rest_positions(const hybmss_body* body, double* positions, size_t count);
/* Of a lattice: writes the grid index i + (nx + 1) (j + (ny + 1) k) of every node, ascending, to `count` = node count
 * values. */
HYBMSS_EXPORT hybmss_status hybmss_body_grid_indices(const hybmss_body* body, uint32_t* indices, size_t count);

/* ---- fields over memory of the caller's ---- */

typedef int32_t hybmss_precision;
enum { HYBMSS_FLOAT = 0, HYBMSS_DOUBLE = 1 };

/* One vector a node: component x of entry n is x[n * stride], likewise y and z, float or double as `precision` says.
 * SoA has stride 1, interleaved x y z stride 3; any stride >= 1 will do, so members of a struct whose size is a
 * multiple of the component's are fields too. `count` is the number of entries that may be touched. Where it is written
 * to, x, y and z share no memory.
 *
 * `map` is the caller's own order: null where entry n is node n (`count` is then the body's node count), else one
 * number below `count` for every node of the body: node n is entry map[n]. Entries that no node maps to stay as they
 * are. Where a map names an entry twice, what is added (forces, products) sums there; of what is set, the last node's
 * stays.
 *
 * A field that a call writes must not overlap one that it reads, nor may two of its components be the same memory. */
typedef struct hybmss_field {
    hybmss_precision precision;
    void *x, *y, *z;
    ptrdiff_t stride; /* in components, not bytes */
    size_t count;
    const uint32_t* map;
} hybmss_field;

/* The same, to read only. */
typedef struct hybmss_const_field {
    hybmss_precision precision;
    const void *x, *y, *z;
    ptrdiff_t stride;
    size_t count;
    const uint32_t* map;
} hybmss_const_field;

/* Interleaved memory: x y z (stride 3), x y z w (stride 4) or the like, in the body's order. */
static inline hybmss_field hybmss_float_field(float* xyz, size_t count, ptrdiff_t stride) {
    hybmss_field field = {HYBMSS_FLOAT, xyz, xyz ? xyz + 1 : NULL, xyz ? xyz + 2 : NULL, stride, count, NULL};
    return field;
}
static inline hybmss_field hybmss_double_field(double* xyz, size_t count, ptrdiff_t stride) {
    hybmss_field field = {HYBMSS_DOUBLE, xyz, xyz ? xyz + 1 : NULL, xyz ? xyz + 2 : NULL, stride, count, NULL};
    return field;
}
static inline hybmss_const_field hybmss_const_float_field(const float* xyz, size_t count, ptrdiff_t stride) {
    hybmss_const_field field = {HYBMSS_FLOAT, xyz, xyz ? xyz + 1 : NULL, xyz ? xyz + 2 : NULL, stride, count, NULL};
    return field;
}
static inline hybmss_const_field hybmss_const_double_field(const double* xyz, size_t count, ptrdiff_t stride) {
    hybmss_const_field field = {HYBMSS_DOUBLE, xyz, xyz ? xyz + 1 : NULL, xyz ? xyz + 2 : NULL, stride, count, NULL};
    return field;
}

/* ---- plans: forces, energy, second derivatives ---- */

/* How springs are computed: what each level promises is in docs/accuracy.md. */
enum {
    HYBMSS_ACCURATE = 0, /* to the type's precision */
    HYBMSS_EXACT = 1,    /* and the same bits on every processor with the instruction set */
    HYBMSS_FAST = 2      /* by the processor's estimates: 2^-10 of the force in float */
};
typedef int32_t hybmss_accuracy;

typedef struct hybmss_plan_options {
    const char* instruction_set; /* "sse2", "avx2", "avx512", "neon"; null or "automatic": the best there is */
    const char* layout;          /* null or "": the plan's own choice */
    hybmss_accuracy accuracy;
    int threads; /* at most; 0: all. The results do not depend on it. */
    int measure; /* 0 or 1; 1: times the candidates (a third of a second) and takes the fastest */
    const hybmss_task_runner* task_runner; /* null: oneTBB. Copied. */
} hybmss_plan_options;

/* Everything left to the plan, and oneTBB. */
HYBMSS_EXPORT hybmss_plan_options hybmss_default_plan_options(void);

typedef struct hybmss_plan hybmss_plan;

/* `options` may be null: the defaults. */
HYBMSS_EXPORT hybmss_status hybmss_plan_create(const hybmss_body* body, hybmss_precision precision,
                                               const hybmss_plan_options* options, hybmss_plan** plan);
HYBMSS_EXPORT void hybmss_plan_destroy(hybmss_plan* plan);

/* Adds to `forces` (N) the internal forces at the displacements from rest (m). Fields have the plan's precision. Values
 * are not looked at: a node that is not finite spoils those that share a cell or a spring with it, and no others. */
HYBMSS_EXPORT hybmss_status hybmss_plan_add_forces(const hybmss_plan* plan, const hybmss_const_field* displacements,
                                                   const hybmss_field* forces);
/* J, summed in double. Either output may be null. */
HYBMSS_EXPORT hybmss_status hybmss_plan_energy(const hybmss_plan* plan, const hybmss_const_field* displacements,
                                               double* springs, double* volume);
/* Adds K p to `product`, K = d^2 W / du^2 (N/m) at the displacements, p the direction (m). */
HYBMSS_EXPORT hybmss_status hybmss_plan_add_hessian_product(const hybmss_plan* plan,
                                                            const hybmss_const_field* displacements,
                                                            const hybmss_const_field* direction,
                                                            const hybmss_field* product);
/* A guaranteed lower bound of the largest stable explicit step near rest, s. */
HYBMSS_EXPORT hybmss_status hybmss_plan_critical_time_step(const hybmss_plan* plan, double* time_step);
/* What the plan chose, one fact a line, ended by a null character: at most `capacity` bytes with it, cut where the text
 * is longer. `length` (may be null) becomes the length of the whole text; `text` may be null where `capacity` is 0. */
HYBMSS_EXPORT hybmss_status hybmss_plan_describe(const hybmss_plan* plan, char* text, size_t capacity, size_t* length);

/* ---- stress ---- */

/* Of a cell, a mean over it; components of symmetric tensors: xx, yy, zz, xy, yz, xz. hybmss/stress.hpp says more. */
typedef struct hybmss_cell_stress {
    double first_piola[9]; /* Pa, row by row */
    double cauchy[6];      /* Pa */
    double green_strain[6];
    double volume_ratio;
    double energy_density; /* J/m^3 at rest */
    double von_mises;      /* Pa */
    double pressure;       /* Pa */
} hybmss_cell_stress;

/* Of a lattice: how many cells have a scale above zero. */
HYBMSS_EXPORT hybmss_status hybmss_body_cell_count(const hybmss_body* body, size_t* count);
/* Of a lattice: writes the stresses of those cells in index order, to `count` = cell count entries. */
HYBMSS_EXPORT hybmss_status hybmss_body_stresses(const hybmss_body* body, const hybmss_const_field* displacements,
                                                 hybmss_cell_stress* stresses, size_t count);

/* ---- cuts along faces of cells, and tears: hybmss/separation.hpp ---- */

/* The network of a lattice whose cells have parted along faces: two cells each, by their indices i + nx (j + ny k). No
 * mass is lost. */
HYBMSS_EXPORT hybmss_status hybmss_body_separate(const hybmss_body* lattice, const uint32_t* faces, size_t face_count,
                                                 hybmss_body** parted);
/* Of such a network: writes each node's number in the lattice, to `count` = node count values. */
HYBMSS_EXPORT hybmss_status hybmss_body_lattice_nodes(const hybmss_body* parted, uint32_t* nodes, size_t count);
/* Each node's number in `before`, which has fewer parted faces, to `count` = node count values: a state goes over by
 * it. */
HYBMSS_EXPORT hybmss_status hybmss_body_nodes_before(const hybmss_body* before, const hybmss_body* after,
                                                     uint32_t* nodes, size_t count);
/* The faces that tear at the displacements, of double: where cells are stretched by more than `tear_strain`, > 0,
 * across a face that holds. Writes their count, and two cells a face where `faces` is not null. */
HYBMSS_EXPORT hybmss_status hybmss_body_torn_faces(const hybmss_body* lattice, const hybmss_body* parted,
                                                   const hybmss_const_field* displacements, double tear_strain,
                                                   uint32_t* faces, size_t* count);

/* ---- skin ---- */

/* The faces of a lattice's cells that no other cell shares, two triangles each, counter-clockwise seen from outside;
 * vertices are the nodes on them. Writes the counts, and x y z (m) of each vertex and three numbers a triangle where
 * these are not null: to arrays as long as the counts that a first call with null gives. */
HYBMSS_EXPORT hybmss_status hybmss_body_boundary_mesh(const hybmss_body* body, double* vertices, size_t* vertex_count,
                                                      uint32_t* triangles, size_t* triangle_count);

/* The same triangles with their vertices on the smooth surface that the cells' fills are of, or that terraces are
 * smoothed to: smooth_boundary_mesh() of hybmss/skin.hpp. */
HYBMSS_EXPORT hybmss_status hybmss_body_smooth_mesh(const hybmss_body* body, double* vertices, size_t* vertex_count,
                                                    uint32_t* triangles, size_t* triangle_count);

/* Triangles that move with a lattice: hybmss/skin.hpp says how. Not changed by use: may be used by several threads. */
typedef struct hybmss_skin hybmss_skin;

/* `vertices`: x y z at rest of each, m from the grid's low corner; `triangles`: the numbers of three of them each,
 * counter-clockwise seen from outside. Counts are of vertices and triangles. Of the options (null: the defaults) the
 * threads and the task runner. */
HYBMSS_EXPORT hybmss_status hybmss_skin_create(const hybmss_body* body, hybmss_precision precision,
                                               const double* vertices, size_t vertex_count, const uint32_t* triangles,
                                               size_t triangle_count, const hybmss_plan_options* options,
                                               hybmss_skin** skin);
HYBMSS_EXPORT void hybmss_skin_destroy(hybmss_skin* skin);
/* Sets the vertices' positions, m, and unit normals (null: none), at displacements of the body's nodes, m; fields of
 * the skin's precision. */
HYBMSS_EXPORT hybmss_status hybmss_skin_update(const hybmss_skin* skin, const hybmss_const_field* displacements,
                                               const hybmss_field* positions, const hybmss_field* normals);

/* ---- motion ---- */

/* A body that moves by semi-implicit Euler steps, v <- (v + dt (f/m + g)) / (1 + dt c), u <- u + dt v, or by leapfrog
 * steps, and owns its state. Starts at rest. */
typedef struct hybmss_dynamics hybmss_dynamics;

/* Leapfrog is of the second order at the same price; a reading of velocities or of the kinetic energy then takes an
 * evaluation of forces. hybmss/explicit_dynamics.hpp says all. */
typedef int32_t hybmss_integrator;
enum { HYBMSS_SYMPLECTIC_EULER = 0, HYBMSS_LEAPFROG = 1 };

typedef struct hybmss_step_parameters {
    double time_step;       /* s, > 0 */
    double acceleration[3]; /* m/s^2 */
    double mass_damping;    /* c, 1/s, >= 0 */
    hybmss_integrator integrator;
} hybmss_step_parameters;

/* Displacement (m) and velocity (m/s) of a node, held along the axes given: bit 0 is x, bit 1 y, bit 2 z. */
typedef struct hybmss_prescribed_node {
    uint32_t node;
    uint32_t axes; /* 0 to 7 */
    double displacement[3];
    double velocity[3];
} hybmss_prescribed_node;

typedef struct hybmss_nodal_load {
    uint32_t node;
    double force[3]; /* N */
} hybmss_nodal_load;

HYBMSS_EXPORT hybmss_status hybmss_dynamics_create(const hybmss_body* body, hybmss_precision precision,
                                                   const hybmss_plan_options* options, hybmss_dynamics** dynamics);
HYBMSS_EXPORT void hybmss_dynamics_destroy(hybmss_dynamics* dynamics);

/* Replace the whole list. `nodes` and `loads` may be null where `count` is 0. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_prescribe(hybmss_dynamics* dynamics, const hybmss_prescribed_node* nodes,
                                                      size_t count);
HYBMSS_EXPORT hybmss_status hybmss_dynamics_load(hybmss_dynamics* dynamics, const hybmss_nodal_load* loads,
                                                 size_t count);
/* Pressure on faces of cells that follows them: hybmss/pressure.hpp and ExplicitDynamics::press() say all. */
/* The faces of a body's cells that no other cell shares: writes their count, and four nodes a face, counter-clockwise
 * seen from outside, where `nodes` is not null: as many as a first call with null gives. */
HYBMSS_EXPORT hybmss_status hybmss_body_surface_faces(const hybmss_body* body, uint32_t* nodes, size_t* count);
/* Replaces the pressed faces, four nodes and a pressure (Pa; above 0 it pushes into the body) each; none for `count` 0,
 * where both may be null. `body`: what the dynamics was made of. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_press(hybmss_dynamics* dynamics, const hybmss_body* body,
                                                  const uint32_t* nodes, const double* pressures, size_t count);
/* Other pressures on the same faces. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_set_pressures(hybmss_dynamics* dynamics, const double* pressures,
                                                          size_t count);
/* Damps all springs along themselves from now on: a dashpot of stiffness_damping (s, >= 0; 0: none) times its stiffness
 * beside each. Shortens the critical time step. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_damp_springs(hybmss_dynamics* dynamics, double stiffness_damping);
/* A branch of a Prony series: ExplicitDynamics::relax() says all. */
typedef struct hybmss_relaxation {
    double part; /* times the moduli of slow loads, > 0 */
    double time; /* s, > 0 */
} hybmss_relaxation;
/* Gives a lattice's material a memory from now on, by at most four branches; none for `count` 0, where `branches` may
 * be null. `body`: what the dynamics was made of. Shortens the critical time step. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_relax(hybmss_dynamics* dynamics, const hybmss_body* body,
                                                  const hybmss_relaxation* branches, size_t count);
/* Makes a lattice's cells of another size at rest, by their indices: three stretches a cell, of the axes x, y and z,
 * each in [0.1, 10]; none for `count` 0, where both may be null. `body`: what the dynamics was made of.
 * ExplicitDynamics::actuate() says all. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_actuate(hybmss_dynamics* dynamics, const hybmss_body* body,
                                                    const uint32_t* cells, const double* stretches, size_t count);
/* Other stretches of the same cells. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_set_rest_stretches(hybmss_dynamics* dynamics, const double* stretches,
                                                               size_t count);
/* Takes `count` >= 0 steps. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_step(hybmss_dynamics* dynamics, const hybmss_step_parameters* parameters,
                                                 int64_t count);

/* Removes cells, by their indices, from the moving body: hybmss/explicit_dynamics.hpp says what becomes of nodes and
 * masses. Nodes keep their numbers. `body`: the lattice that the dynamics was made of, which stays as it is. `removed`
 * (may be null) becomes how many there were. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_remove_cells(hybmss_dynamics* dynamics, const hybmss_body* body,
                                                         const uint32_t* cells, size_t count, size_t* removed);

/* Fields have the precision of the dynamics. What is set must be finite. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_get_displacements(const hybmss_dynamics* dynamics, const hybmss_field* out);
HYBMSS_EXPORT hybmss_status hybmss_dynamics_get_velocities(const hybmss_dynamics* dynamics, const hybmss_field* out);
HYBMSS_EXPORT hybmss_status hybmss_dynamics_get_forces(const hybmss_dynamics* dynamics, const hybmss_field* out);
HYBMSS_EXPORT hybmss_status hybmss_dynamics_set_displacements(hybmss_dynamics* dynamics, const hybmss_const_field* in);
HYBMSS_EXPORT hybmss_status hybmss_dynamics_set_velocities(hybmss_dynamics* dynamics, const hybmss_const_field* in);

/* J. Any of the outputs may be null. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_energies(const hybmss_dynamics* dynamics, double* springs, double* volume,
                                                     double* kinetic);
/* `steps`: 0 while all displacements and velocities are finite; else how many steps the body had taken when that was
 * first found out: by hybmss_dynamics_step(), which looks where 64 steps or more were taken since the last look, or by
 * this, which looks at once. To set the state starts anew. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_not_finite_at(const hybmss_dynamics* dynamics, int64_t* steps);
/* kg, one a node; `count` is that of the values given. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_masses(const hybmss_dynamics* dynamics, double* masses, size_t count);
HYBMSS_EXPORT hybmss_status hybmss_dynamics_critical_time_step(const hybmss_dynamics* dynamics, double* time_step);

/* ---- rigid obstacles: hybmss/contact.hpp says all ---- */

typedef int32_t hybmss_shape;
enum {
    HYBMSS_PLANE = 0,   /* dimensions: the normal, to where the body is, of any length */
    HYBMSS_SPHERE = 1,  /* dimensions[0]: the radius, m */
    HYBMSS_BOX = 2,     /* dimensions: the lengths of the edges, m */
    HYBMSS_CAPSULE = 3, /* dimensions[0]: the radius, m; [1]: the length of its axis, along the obstacle's y, m, >= 0 */
    HYBMSS_SOLID = 4    /* dimensions are not used; the obstacle's `solid` tells */
};

/* A convex hull, a closed mesh or a height field, in the obstacle's axes, m. Made once: may serve any number of
 * obstacles, bodies and threads, and be destroyed where obstacles of it are in use. */
typedef struct hybmss_solid hybmss_solid;

/* HullShape: the convex hull of points, x y z each. */
HYBMSS_EXPORT hybmss_status hybmss_solid_create_hull(const double* points, size_t count, hybmss_solid** solid);
/* MeshShape: vertices and triangles as for hybmss_skin_create(), closed; `cells`: of the grid on which distances are
 * kept, along the longest side, 4 to 256; 0: 64. */
HYBMSS_EXPORT hybmss_status hybmss_solid_create_mesh(const double* vertices, size_t vertex_count,
                                                     const uint32_t* triangles, size_t triangle_count, int32_t cells,
                                                     hybmss_solid** solid);
/* HeightShape: heights along y, x fastest, then z; counts and spacings (m) along x and z. */
HYBMSS_EXPORT hybmss_status hybmss_solid_create_heights(const double* heights, const size_t counts[2],
                                                        const double spacing[2], hybmss_solid** solid);
HYBMSS_EXPORT void hybmss_solid_destroy(hybmss_solid* solid);

typedef struct hybmss_pose {
    double position[3];         /* m */
    double rotation[9];         /* row by row, from the obstacle's axes to space */
    double velocity[3];         /* m/s */
    double angular_velocity[3]; /* rad/s, in space */
} hybmss_pose;

typedef struct hybmss_obstacle {
    hybmss_shape shape;
    double dimensions[3];
    hybmss_pose pose;
    double friction;           /* Coulomb's coefficient, >= 0 */
    double stiffness;          /* 1/s^2, a kg of a node; 0: by the body's critical time step */
    double friction_delay;     /* s; 0: likewise */
    const hybmss_solid* solid; /* of HYBMSS_SOLID; else not used */
    double mass;               /* kg; 0: it is led, else free: bodies and gravity move it, in explicit steps */
    double inertia[3];         /* kg m^2 about its axes, of a free one; all 0: those of the full shape */
} hybmss_obstacle;

typedef struct hybmss_obstacle_reading {
    double force[3];       /* N, on the body */
    double torque[3];      /* N m, about the obstacle's position */
    double depth;          /* m, of the deepest node */
    double greatest_depth; /* m, since the obstacle was set */
    double energy;         /* J, that contact stores */
    double dissipated;     /* J, by friction and impacts since it was set */
    double impulse[3], angular_impulse[3];
    size_t nodes; /* that touch */
} hybmss_obstacle_reading;

/* Replaces all obstacles; none for `count` 0, where `obstacles` may be null. `body`: what the dynamics was made of; its
 * surface touches, after cuts with the nodes that they laid bare. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_set_obstacles(hybmss_dynamics* dynamics, const hybmss_body* body,
                                                          const hybmss_obstacle* obstacles, size_t count);
/* Likewise, touched by the points of a skin in the body, a lattice: ExplicitDynamics::set_skin_obstacles(); the mesh as
 * for hybmss_skin_create(). */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_set_skin_obstacles(hybmss_dynamics* dynamics, const hybmss_body* body,
                                                               const double* vertices, size_t vertex_count,
                                                               const uint32_t* triangles, size_t triangle_count,
                                                               const hybmss_obstacle* obstacles, size_t count);
/* Sets where the obstacles are now, one pose each; in the steps that follow they go on by their velocities. Those of
 * free ones are not used. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_move_obstacles(hybmss_dynamics* dynamics, const hybmss_pose* poses,
                                                           size_t count);
/* Where they are now, one an obstacle. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_obstacle_poses(const hybmss_dynamics* dynamics, hybmss_pose* poses,
                                                           size_t count);
/* One an obstacle. */
HYBMSS_EXPORT hybmss_status hybmss_dynamics_obstacle_readings(const hybmss_dynamics* dynamics,
                                                              hybmss_obstacle_reading* readings, size_t count);

/* ---- equilibria: hybmss/equilibrium.hpp says all ---- */

/* Finds where a body comes to rest under loads, and takes implicit steps; its state is the caller's. */
typedef struct hybmss_equilibrium hybmss_equilibrium;

typedef int32_t hybmss_preconditioner;
enum { HYBMSS_PRECONDITIONER_AUTOMATIC = 0, HYBMSS_BLOCK_JACOBI = 1, HYBMSS_MULTIGRID = 2 };

/* How a solve ended. */
typedef enum hybmss_outcome {
    HYBMSS_CONVERGED = 0,
    HYBMSS_ITERATIONS_EXHAUSTED = 1,
    HYBMSS_NO_DESCENT = 2, /* rounding hides what is left to gain */
    HYBMSS_UNBOUNDED = 3,  /* the energy falls without end: nothing holds the body */
    HYBMSS_INVERTED = 4,   /* cells are turned inside out */
    HYBMSS_NOT_FINITE = 5,
    HYBMSS_STOPPED = 6 /* by the progress function */
} hybmss_outcome;

/* What holds and loads a body. Any pointer may be null where its count is 0. */
typedef struct hybmss_loading {
    const hybmss_prescribed_node* supports; /* where they are held, m from rest; velocities are not used */
    size_t support_count;
    const hybmss_nodal_load* loads; /* several on one node add up */
    size_t load_count;
    double acceleration[3];  /* gravity, m/s^2 */
    const double* pressures; /* Pa, one a face of hybmss_equilibrium_press, or none */
    size_t pressure_count;
    const hybmss_pose* obstacles; /* where they are, one each, or none: where they were; velocities are not used */
    size_t obstacle_count;
    const double* stretches; /* three a cell of hybmss_equilibrium_actuate, or none: as they were */
    size_t stretch_count;    /* of cells */
} hybmss_loading;

typedef struct hybmss_equilibrium_options {
    double tolerance;          /* largest unbalanced force by the largest support force or load, in (0, 1) */
    int32_t newton_iterations; /* at most, a load step */
    int32_t load_steps;        /* at most */
    double first_load_step;    /* part of the loading that is tried first, in (0, 1] */
    hybmss_preconditioner preconditioner;
    int32_t leave_saddles; /* 0 or 1; 1: go on to a lower minimum from where no force points away from a saddle */
    /* Called at every iteration; other than 0 stops. May be null. */
    int (*progress)(double load_fraction, int32_t newton_iteration, double residual, void* user);
    void* user; /* handed back to it */
} hybmss_equilibrium_options;

/* Those of EquilibriumOptions in C++. */
HYBMSS_EXPORT hybmss_equilibrium_options hybmss_default_equilibrium_options(void);

typedef struct hybmss_equilibrium_result {
    hybmss_outcome outcome;
    double residual, potential; /* the latter in J */
    double load_fraction;       /* the part of the loading that the state is at; 1 where all went well */
    int32_t load_steps, newton_iterations;
    int64_t cg_iterations;
    double least_volume_ratio, greatest_volume_ratio; /* of the cells */
} hybmss_equilibrium_result;

HYBMSS_EXPORT hybmss_status hybmss_equilibrium_create(const hybmss_body* body, hybmss_precision precision,
                                                      const hybmss_plan_options* options,
                                                      hybmss_equilibrium** equilibrium);
HYBMSS_EXPORT void hybmss_equilibrium_destroy(hybmss_equilibrium* equilibrium);

/* Replaces the faces that a loading's pressures press, four nodes each; none for `count` 0. `body`, here and below:
 * what the equilibrium was made of. */
HYBMSS_EXPORT hybmss_status hybmss_equilibrium_press(hybmss_equilibrium* equilibrium, const hybmss_body* body,
                                                     const uint32_t* nodes, size_t count);
/* Replaces all obstacles, without friction, at their poses; the body's surface touches them. */
HYBMSS_EXPORT hybmss_status hybmss_equilibrium_set_obstacles(hybmss_equilibrium* equilibrium, const hybmss_body* body,
                                                             const hybmss_obstacle* obstacles, size_t count);
/* Replaces the cells, by their indices, that a loading gives another size at rest. */
HYBMSS_EXPORT hybmss_status hybmss_equilibrium_actuate(hybmss_equilibrium* equilibrium, const uint32_t* cells,
                                                       size_t count);

/* From the displacements (m) to equilibrium; written there, as `result` is, also where the outcome is no equilibrium:
 * then the last one on the way. `options` may be null: the defaults. */
HYBMSS_EXPORT hybmss_status hybmss_equilibrium_solve(hybmss_equilibrium* equilibrium, const hybmss_loading* loading,
                                                     const hybmss_field* displacements,
                                                     const hybmss_equilibrium_options* options,
                                                     hybmss_equilibrium_result* result);
/* One step of backward Euler, stable for any `time_step` (s); `mass_damping` in 1/s. */
HYBMSS_EXPORT hybmss_status hybmss_equilibrium_step(hybmss_equilibrium* equilibrium, const hybmss_loading* loading,
                                                    double time_step, double mass_damping,
                                                    const hybmss_field* displacements, const hybmss_field* velocities,
                                                    const hybmss_equilibrium_options* options,
                                                    hybmss_equilibrium_result* result);
/* Why the last solve or step found none, in one line; "" where it did. Valid until the next one. */
HYBMSS_EXPORT const char* hybmss_equilibrium_message(const hybmss_equilibrium* equilibrium);

/* ---- worlds: several bodies that touch and are tied; hybmss/world.hpp says all ---- */

typedef struct hybmss_world hybmss_world;

/* That two bodies touch, or one itself where both numbers are the same. */
typedef struct hybmss_body_contact {
    size_t first, second;
    double friction;       /* Coulomb's coefficient, >= 0 */
    double stiffness;      /* 1/s^2; 0: by the bodies' critical time steps */
    double friction_delay; /* s; 0: likewise */
} hybmss_body_contact;

typedef struct hybmss_body_contact_reading {
    double force[3];       /* N, on the first body in the last step */
    double impulse[3];     /* N s, on the first body since the contact was set */
    double depth;          /* m, of the deepest node */
    double greatest_depth; /* m, since the contact was set */
    size_t nodes;          /* of either that touched */
} hybmss_body_contact_reading;

/* A free obstacle of a body; those with the same `one` are the same. */
typedef struct hybmss_shared_obstacle {
    size_t body, obstacle, one;
} hybmss_shared_obstacle;

#define HYBMSS_IN_SPACE SIZE_MAX
/* A point of a body at rest, in a cell or on a node; or, with the number HYBMSS_IN_SPACE, a point in space. m */
typedef struct hybmss_anchor {
    size_t body;
    double point[3];
} hybmss_anchor;

/* `threads`: at most, 0 for all of the machine. All bodies have one precision. */
HYBMSS_EXPORT hybmss_status hybmss_world_create(hybmss_precision precision, int32_t threads, hybmss_world** world);
HYBMSS_EXPORT void hybmss_world_destroy(hybmss_world* world);
/* Adds a body at rest whose low corner, of a lattice's grid, is at `origin` (m; null: zero; of a network it must be).
 * Sets its number, and lends it: `dynamics` (may be null) is a handle of its own, to be destroyed as any other, before
 * or after the world. It is for all but steps and removing cells, which are the world's. */
HYBMSS_EXPORT hybmss_status hybmss_world_add(hybmss_world* world, const hybmss_body* body,
                                             const hybmss_plan_options* options, const double* origin, size_t* number,
                                             hybmss_dynamics** dynamics);
/* Puts a body as it is at rest where the pose brings it: what is at X to position + rotation X. */
HYBMSS_EXPORT hybmss_status hybmss_world_place(hybmss_world* world, size_t number, const hybmss_pose* pose);
/* As hybmss_dynamics_remove_cells, which is not for bodies of a world: steps refuse them then. */
HYBMSS_EXPORT hybmss_status hybmss_world_remove_cells(hybmss_world* world, size_t number, const hybmss_body* body,
                                                      const uint32_t* cells, size_t count, size_t* removed);

/* A part of a body that has become a body: its number, and handles of its own, to be destroyed: what it is made of, a
 * lattice on the same grid, and the body lent. */
typedef struct hybmss_body_part {
    size_t number;
    hybmss_body* body;
    hybmss_dynamics* dynamics;
} hybmss_body_part;

/* World::split_parts(): parts of a body of cells that have no node in common become bodies of their own, with their
 * places, velocities, attachments and contacts; the largest stays. Sets `count` and writes as many `parts`, at most
 * `capacity`: where there are more it fails, and nothing has changed. `body`: what the body was made of. */
HYBMSS_EXPORT hybmss_status hybmss_world_split_parts(hybmss_world* world, size_t number, const hybmss_body* body,
                                                     const hybmss_plan_options* options, hybmss_body_part* parts,
                                                     size_t capacity, size_t* count);
/* Replaces the contacts. */
HYBMSS_EXPORT hybmss_status hybmss_world_set_contacts(hybmss_world* world, const hybmss_body_contact* contacts,
                                                      size_t count);
/* Replaces the free obstacles that several bodies share: World::set_shared_obstacles(). */
HYBMSS_EXPORT hybmss_status hybmss_world_set_shared_obstacles(hybmss_world* world,
                                                              const hybmss_shared_obstacle* obstacles, size_t count);
/* One a contact. */
HYBMSS_EXPORT hybmss_status hybmss_world_contact_readings(const hybmss_world* world,
                                                          hybmss_body_contact_reading* readings, size_t count);
/* Ties two points by a spring without length; `stiffness` in N/m, INFINITY: welded. Sets its number. */
HYBMSS_EXPORT hybmss_status hybmss_world_attach(hybmss_world* world, const hybmss_anchor* from, const hybmss_anchor* to,
                                                double stiffness, size_t* attachment);
HYBMSS_EXPORT hybmss_status hybmss_world_move_anchor(hybmss_world* world, size_t attachment, const double* point);
/* N, three numbers: on what it comes from, in the last step. */
HYBMSS_EXPORT hybmss_status hybmss_world_attachment_force(const hybmss_world* world, size_t attachment, double* force);
HYBMSS_EXPORT hybmss_status hybmss_world_detach(hybmss_world* world, size_t attachment);
HYBMSS_EXPORT hybmss_status hybmss_world_step(hybmss_world* world, const hybmss_step_parameters* parameters,
                                              int64_t count);
HYBMSS_EXPORT hybmss_status hybmss_world_critical_time_step(const hybmss_world* world, double* time_step);

/* ---- records: states and forces to check against ---- */

/* A file of `hybmss record`: a body, states of it, and the forces and energies of each by the scalar reference. A
 * program loads it in its tests, brings the displacements to where it keeps its own, computes forces as it always does,
 * and asks whether they are the recorded ones. Immutable. */
typedef struct hybmss_record hybmss_record;

/* HYBMSS_FILE_ERROR for a file that cannot be read, is no record, or is damaged. */
HYBMSS_EXPORT hybmss_status hybmss_record_load(const char* path, hybmss_record** record);
/* The same of the text of such a file. */
HYBMSS_EXPORT hybmss_status hybmss_record_parse(const char* text, size_t length, hybmss_record** record);
HYBMSS_EXPORT void hybmss_record_destroy(hybmss_record* record);
/* Makes the body that was recorded; the caller destroys it. */
HYBMSS_EXPORT hybmss_status hybmss_record_body(const hybmss_record* record, hybmss_body** body);
HYBMSS_EXPORT hybmss_status hybmss_record_state_count(const hybmss_record* record, size_t* count);
/* Writes a state's displacements, m, in the precision of the field. */
HYBMSS_EXPORT hybmss_status hybmss_record_displacements(const hybmss_record* record, size_t state,
                                                        const hybmss_field* displacements);
/* HYBMSS_MISMATCH where the forces (N, not added to anything else) differ from the recorded ones by more than the
 * tolerance of their precision; the message then names the node. `error` (may be null) becomes the largest difference
 * of a component over the largest sum of force magnitudes at a node, also where they match. */
HYBMSS_EXPORT hybmss_status hybmss_record_compare_forces(const hybmss_record* record, size_t state,
                                                         const hybmss_const_field* forces, double* error);
/* The same for energies computed in this precision, J. */
HYBMSS_EXPORT hybmss_status hybmss_record_compare_energy(const hybmss_record* record, size_t state,
                                                         hybmss_precision precision, double springs, double volume,
                                                         double* error);

#ifdef __cplusplus
}
#endif

#endif
