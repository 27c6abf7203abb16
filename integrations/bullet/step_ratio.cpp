// A step of Bullet's deformable world with HybMSS bodies beside one with Bullet's own tetrahedra on the same nodes:
// rounds of all by turns, the least of each and their ratio.

#include "integrations/bullet/hybmss_force.hpp"
#include "integrations/bullet/world.hpp"

#include <BulletSoftBody/btDeformableLinearElasticityForce.h>
#include <BulletSoftBody/btDeformableNeoHookeanForce.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace {

using namespace hybmss;
using Clock = std::chrono::steady_clock;

const Material kMaterial{.young_modulus = 5e4, .poisson_ratio = 0.3, .density = 1000};
constexpr double kCellSize = 0.05;
constexpr btScalar kTimeStep = btScalar(5e-4);

/// Six tetrahedra a cell, around the diagonal from its low to its high corner: the same nodes, the same mass.
void fill_with_tetrahedra(btSoftBody& body, const Lattice& lattice) {
    constexpr int kPaths[6][2] = {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}};
    const auto& n = lattice.cells();
    for (int k = 0; k < n[2]; ++k) {
        for (int j = 0; j < n[1]; ++j) {
            for (int i = 0; i < n[0]; ++i) {
                const auto corner = [&](int c) {
                    return static_cast<int>(lattice.grid_node_index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
                };
                for (const auto& path : kPaths) {
                    body.appendTetra(corner(0), corner(path[0]), corner(path[1]), corner(7));
                }
            }
        }
    }
    body.initializeDmInverse();
    body.m_tetraScratches.resize(body.m_tetras.size());
    body.m_tetraScratchesTn.resize(body.m_tetras.size());
}

struct Candidate {
    explicit Candidate(const char* label, bool implicit)
        : name(label), world(btVector3(0, btScalar(-9.81), 0), implicit) {}
    std::string name;
    std::unique_ptr<btDeformableLagrangianForce> force;
    std::unique_ptr<bullet::HybmssForce> maker; // of the nodes of bodies made of tetrahedra
    bullet::World world;
    std::vector<double> seconds;
};

std::unique_ptr<Candidate> make(const char* name, int cells, bool implicit) {
    auto candidate = std::make_unique<Candidate>(name, implicit);
    const auto lattice = Lattice::box(cells, cells, cells, kCellSize);
    auto hybmss = std::make_unique<bullet::HybmssForce>();
    std::unique_ptr<btSoftBody> body(
        hybmss->make_body(candidate->world.info(), lattice, kMaterial, btVector3(0, btScalar(0.001), 0)));
    const double mu = shear_modulus(kMaterial), nu = kMaterial.poisson_ratio, lambda = 2 * mu * nu / (1 - 2 * nu);
    if (candidate->name == "HybMSS") {
        candidate->force = std::move(hybmss);
    } else {
        fill_with_tetrahedra(*body, lattice);
        if (candidate->name == "NeoHookean") {
            candidate->force =
                std::make_unique<btDeformableNeoHookeanForce>(btScalar(mu), btScalar(lambda), btScalar(0));
        } else {
            candidate->force = std::make_unique<btDeformableLinearElasticityForce>(btScalar(mu), btScalar(lambda),
                                                                                   btScalar(0), btScalar(0));
        }
        candidate->maker = std::move(hybmss);
    }
    candidate->world.add(std::move(body), *candidate->force);
    candidate->world.add_floor(0);
    return candidate;
}

void measure(int cells, bool implicit, int rounds) {
    std::vector<std::unique_ptr<Candidate>> all;
    for (const char* name : {"HybMSS", "NeoHookean", "LinearElasticity"}) {
        all.push_back(make(name, cells, implicit));
        all.back()->world.step(kTimeStep, 10);
    }
    for (int round = 0; round < rounds; ++round) {
        for (const auto& candidate : all) {
            const auto start = Clock::now();
            candidate->world.step(kTimeStep, 2);
            candidate->seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count() / 2);
        }
    }
    double first = 0;
    for (const auto& candidate : all) {
        const double least = *std::min_element(candidate->seconds.begin(), candidate->seconds.end());
        first = first > 0 ? first : least;
        std::printf("%2d^3 cells  %-8s  %-17s %9.3f ms/step  ratio %6.2f\n", cells, implicit ? "implicit" : "explicit",
                    candidate->name.c_str(), 1e3 * least, least / first);
    }
}

/// The forces alone, as the world asks for them once a step.
void measure_forces(int cells, int rounds) {
    std::vector<std::unique_ptr<Candidate>> all;
    for (const char* name : {"HybMSS", "NeoHookean", "LinearElasticity"}) {
        all.push_back(make(name, cells, false));
        all.back()->world.step(kTimeStep, 10);
    }
    btDeformableLagrangianForce::TVStack forces;
    forces.resize((cells + 1) * (cells + 1) * (cells + 1), btVector3(0, 0, 0));
    for (int round = 0; round < rounds; ++round) {
        for (const auto& candidate : all) {
            const auto start = Clock::now();
            candidate->world.dynamics().getSoftBodyArray()[0]->updateDeformation(); // nothing without tetrahedra
            candidate->force->addScaledForces(kTimeStep, forces);
            candidate->seconds.push_back(std::chrono::duration<double>(Clock::now() - start).count());
        }
    }
    double first = 0;
    for (const auto& candidate : all) {
        const double least = *std::min_element(candidate->seconds.begin(), candidate->seconds.end());
        first = first > 0 ? first : least;
        std::printf("%2d^3 cells  forces    %-17s %9.3f ms       ratio %6.2f\n", cells, candidate->name.c_str(),
                    1e3 * least, least / first);
    }
}

} // namespace

int main(int argc, char** argv) {
    const int rounds = argc > 1 ? std::atoi(argv[1]) : 41;
    if (argc > 2 || rounds < 1) {
        std::fprintf(stderr, "bullet_step_ratio: %s is not allowed: the number of rounds, an integer >= 1\n",
                     argc > 1 ? argv[1] : "");
        return 2;
    }
    for (const int cells : {10, 20}) {
        measure_forces(cells, rounds);
        measure(cells, false, rounds);
        measure(cells, true, std::max(1, rounds / 4));
    }
    return 0;
}
