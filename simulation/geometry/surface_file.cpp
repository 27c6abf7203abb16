#include "layouts/read_file.hpp"
#include "simulation/geometry/triangle_surface.hpp"

#include <assimp/Importer.hpp>
#include <assimp/mesh.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <string>
#include <system_error>

namespace hybmss {
namespace {

void append(TriangleSurface& surface, const aiMesh& mesh) {
    const auto first = static_cast<std::uint32_t>(surface.vertices.size());
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
        const aiVector3D& x = mesh.mVertices[v];
        if (!std::isfinite(x.x) || !std::isfinite(x.y) || !std::isfinite(x.z)) {
            throw std::runtime_error("a vertex of it is not finite");
        }
        surface.vertices.push_back({static_cast<double>(x.x), static_cast<double>(x.y), static_cast<double>(x.z)});
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        if (face.mNumIndices == 3) { // what has fewer is a point or a line of an OBJ file
            surface.triangles.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
        }
    }
}

} // namespace

TriangleSurface read_surface(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const bool places_meshes = extension == ".gltf" || extension == ".glb"; // by a tree of nodes
    if (!places_meshes && extension != ".stl" && extension != ".obj" && extension != ".ply") {
        throw std::runtime_error("its name must end in .stl, .obj, .ply, .gltf or .glb");
    }
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) {
        throw std::runtime_error("it cannot be read: " + (error ? error.message() : std::string("no regular file")));
    }
    Assimp::Importer importer;
    const aiScene* scene =
        importer.ReadFile(path.string(), aiProcess_Triangulate | (places_meshes ? aiProcess_PreTransformVertices : 0u));
    if (!scene) {
        throw std::runtime_error("it cannot be read: " + one_line(importer.GetErrorString()));
    }
    TriangleSurface surface;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        append(surface, *scene->mMeshes[m]);
    }
    return surface;
}

} // namespace hybmss
