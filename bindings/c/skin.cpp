#include "hybmss/skin.hpp"

#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"

#include <algorithm>
#include <memory>
#include <variant>

namespace hybmss::c_interface {

TriangleMesh mesh_of(const double* vertices, std::size_t vertex_count, const std::uint32_t* triangles,
                     std::size_t triangle_count) {
    require_entries(vertices, "vertices", vertex_count, 3 * sizeof(double));
    require_entries(triangles, "triangles", triangle_count, 3 * sizeof(uint32_t));
    TriangleMesh mesh;
    mesh.vertices.resize(vertex_count);
    mesh.triangles.resize(triangle_count);
    std::copy_n(vertices, 3 * vertex_count, mesh.vertices.empty() ? nullptr : mesh.vertices[0].data());
    std::copy_n(triangles, 3 * triangle_count, mesh.triangles.empty() ? nullptr : mesh.triangles[0].data());
    return mesh;
}

namespace {

template <class T>
struct Embedded {
    Skin<T> skin;
    mutable Scratch<T> scratch;

    explicit Embedded(Skin<T> made) : skin(std::move(made)) {}

    void update(const hybmss_const_field* displacements, const hybmss_field* positions,
                const hybmss_field* normals) const {
        const std::size_t vertices = skin.vertex_count();
        check<T>(displacements, skin.node_count(), "displacements");
        check<T>(positions, vertices, "positions");
        const Input<T> u(*displacements, skin.node_count(), scratch);
        const Output<T> x(*positions, vertices, scratch);
        if (!normals) {
            skin.update(u.view(), x.view());
            return x.set();
        }
        check<T>(normals, vertices, "normals");
        const Output<T> n(*normals, vertices, scratch);
        skin.update(u.view(), x.view(), n.view());
        x.set();
        n.set();
    }
};

void put_mesh(TriangleMesh (*make)(const Lattice&), const hybmss_body* body, double* vertices, size_t* vertex_count,
              uint32_t* triangles, size_t* triangle_count) {
    require(body, "body");
    require(vertex_count, "vertex_count");
    require(triangle_count, "triangle_count");
    const TriangleMesh mesh = make(lattice_of(*body, "a lattice has a boundary of cells").lattice);
    if (vertices && !mesh.vertices.empty()) {
        std::copy_n(mesh.vertices[0].data(), 3 * mesh.vertices.size(), vertices);
    }
    if (triangles && !mesh.triangles.empty()) {
        std::copy_n(mesh.triangles[0].data(), 3 * mesh.triangles.size(), triangles);
    }
    *vertex_count = mesh.vertices.size();
    *triangle_count = mesh.triangles.size();
}

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_skin {
    std::variant<std::unique_ptr<const Embedded<float>>, std::unique_ptr<const Embedded<double>>> held;
};

extern "C" {

hybmss_status hybmss_body_boundary_mesh(const hybmss_body* body, double* vertices, size_t* vertex_count,
                                        uint32_t* triangles, size_t* triangle_count) {
    return guarded([&] { put_mesh(boundary_mesh, body, vertices, vertex_count, triangles, triangle_count); });
}

hybmss_status hybmss_body_smooth_mesh(const hybmss_body* body, double* vertices, size_t* vertex_count,
                                      uint32_t* triangles, size_t* triangle_count) {
    return guarded([&] { put_mesh(smooth_boundary_mesh, body, vertices, vertex_count, triangles, triangle_count); });
}

hybmss_status hybmss_skin_create(const hybmss_body* body, hybmss_precision precision, const double* vertices,
                                 size_t vertex_count, const uint32_t* triangles, size_t triangle_count,
                                 const hybmss_plan_options* options, hybmss_skin** skin) {
    return guarded([&] {
        require(skin, "skin");
        require(body, "body");
        const bool wide = is_double(precision, "precision");
        const TriangleMesh mesh = mesh_of(vertices, vertex_count, triangles, triangle_count);
        const Lattice& lattice = lattice_of(*body, "a lattice has a skin").lattice;
        const GivenOptions given(options);
        auto made = std::make_unique<hybmss_skin>();
        if (wide) {
            made->held = std::make_unique<const Embedded<double>>(Skin<double>(lattice, mesh, given.options));
        } else {
            made->held = std::make_unique<const Embedded<float>>(Skin<float>(lattice, mesh, given.options));
        }
        *skin = made.release();
    });
}

void hybmss_skin_destroy(hybmss_skin* skin) {
    delete skin;
}

hybmss_status hybmss_skin_update(const hybmss_skin* skin, const hybmss_const_field* displacements,
                                 const hybmss_field* positions, const hybmss_field* normals) {
    return guarded(skin, "skin", [&](const auto& held) { held.update(displacements, positions, normals); });
}

} // extern "C"
