// What hybmss.js takes for granted of the C interface: where members lie, in bytes. And what threads are begun with.
#include "hybmss/hybmss.h"

#include <cstddef>

#include <pthread.h>

/// Where the stack of a thread begins that has been made and not yet begun: it grows down.
extern "C" void* hybmss_thread_stack(pthread_t thread) {
    pthread_attr_t attributes;
    void* low = nullptr;
    std::size_t bytes = 0;
    pthread_getattr_np(thread, &attributes);
    pthread_attr_getstack(&attributes, &low, &bytes);
    return static_cast<char*>(low) + bytes;
}

#define AT(type, member, offset) static_assert(offsetof(type, member) == (offset))
#define SIZE(type, size) static_assert(sizeof(type) == (size))

AT(hybmss_material, volume_energy, 32);
AT(hybmss_material, stiffening_quadratic, 40);
AT(hybmss_material, springs, 56);
AT(hybmss_material, crush_resistance, 64);
SIZE(hybmss_material, 80);

AT(hybmss_spring, stiffness, 8);
AT(hybmss_spring, rest_vector, 16);
SIZE(hybmss_spring, 40);
AT(hybmss_cell, kappa, 32);
SIZE(hybmss_cell, 40);
AT(hybmss_network, node_count, 8);
AT(hybmss_network, springs, 12);
AT(hybmss_network, cells, 20);
AT(hybmss_network, volume_energy, 28);
SIZE(hybmss_network, 32);

AT(hybmss_plan_options, layout, 4);
AT(hybmss_plan_options, accuracy, 8);
AT(hybmss_plan_options, threads, 12);
AT(hybmss_plan_options, measure, 16);
SIZE(hybmss_plan_options, 24);

AT(hybmss_field, x, 4);
AT(hybmss_field, stride, 16);
AT(hybmss_field, count, 20);
AT(hybmss_field, map, 24);
SIZE(hybmss_field, 28);
AT(hybmss_const_field, map, 24);
SIZE(hybmss_const_field, 28);

AT(hybmss_step_parameters, acceleration, 8);
AT(hybmss_step_parameters, mass_damping, 32);
AT(hybmss_step_parameters, integrator, 40);
SIZE(hybmss_step_parameters, 48);

AT(hybmss_prescribed_node, axes, 4);
AT(hybmss_prescribed_node, displacement, 8);
AT(hybmss_prescribed_node, velocity, 32);
SIZE(hybmss_prescribed_node, 56);

AT(hybmss_nodal_load, force, 8);
SIZE(hybmss_nodal_load, 32);

AT(hybmss_pose, rotation, 24);
AT(hybmss_pose, velocity, 96);
AT(hybmss_pose, angular_velocity, 120);
SIZE(hybmss_pose, 144);

AT(hybmss_obstacle, dimensions, 8);
AT(hybmss_obstacle, pose, 32);
AT(hybmss_obstacle, friction, 176);
AT(hybmss_obstacle, friction_delay, 192);
AT(hybmss_obstacle, solid, 200);
AT(hybmss_obstacle, mass, 208);
AT(hybmss_obstacle, inertia, 216);
SIZE(hybmss_obstacle, 240);

AT(hybmss_obstacle_reading, depth, 48);
AT(hybmss_obstacle_reading, energy, 64);
AT(hybmss_obstacle_reading, impulse, 80);
AT(hybmss_obstacle_reading, nodes, 128);
SIZE(hybmss_obstacle_reading, 136);

AT(hybmss_cell_stress, volume_ratio, 168);
SIZE(hybmss_cell_stress, 200);

AT(hybmss_body_contact, friction, 8);
SIZE(hybmss_body_contact, 32);

AT(hybmss_body_contact_reading, impulse, 24);
AT(hybmss_body_contact_reading, depth, 48);
AT(hybmss_body_contact_reading, nodes, 64);
SIZE(hybmss_body_contact_reading, 72);

AT(hybmss_anchor, point, 8);
SIZE(hybmss_anchor, 32);
