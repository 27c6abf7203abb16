// Random small scenes: damped motion comes to rest where a static solve says; a damaged scene ends in an answer or in
// one clear line, and `explain` judges it as `run` does. The counts by class are printed at the end.
//
// HYBMSS_RANDOM_SCENES=N draws N times as many; HYBMSS_SEED=S draws from another seed on.

#include "hybmss/equilibrium.hpp"
#include "hybmss/simulation/simulation.hpp"
#include "reference/forces.hpp"
#include "simulation/run/boundary_conditions.hpp"
#include "tests/program.hpp"
#include "tests/simulation/files.hpp"
#include "tests/simulation/random_scenes.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <map>
#include <optional>

namespace hybmss {
namespace {

using test::Draw;
using test::RandomScene;

long from_environment(const char* name, long otherwise) {
    const char* value = std::getenv(name);
    return value ? std::strtol(value, nullptr, 10) : otherwise;
}

// -- Counts

enum class End { right, error, several, wrong };

/// How attempts of one class ended.
class Counts : public ::testing::Environment {
public:
    void add(const std::string& of, End end) { ++ends_[of][static_cast<std::size_t>(end)]; }
    void TearDown() override {
        if (ends_.empty()) {
            return;
        }
        std::printf("\n%-60s %8s %8s %8s %8s %6s\n", "class", "attempts", "right", "error", "several", "WRONG");
        for (const auto& [of, n] : ends_) {
            std::printf("%-60s %8d %8d %8d %8d %6d\n", of.c_str(), n[0] + n[1] + n[2] + n[3], n[0], n[1], n[2], n[3]);
        }
    }

private:
    std::map<std::string, std::array<int, 4>> ends_;
};
Counts& counts() {
    static auto* const counts = static_cast<Counts*>(::testing::AddGlobalTestEnvironment(new Counts));
    return *counts;
}
const Counts& registered = counts();

/// One scene after the other, each of its own seed, so that one that fails can be drawn alone.
template <class Attempt>
void for_each_scene(long count, const Attempt& attempt) {
    const long first = from_environment("HYBMSS_SEED", 1);
    for (long n = 0; n < count * from_environment("HYBMSS_RANDOM_SCENES", 1); ++n) {
        SCOPED_TRACE(::testing::Message() << "HYBMSS_SEED=" << first + n);
        Draw draw(static_cast<unsigned>(first + n));
        attempt(draw);
    }
}

// -- Equilibrium against motion

using reference::Vector3d;

std::vector<Vector3d> vectors(std::span<const std::array<double, 3>> field) {
    std::vector<Vector3d> all;
    for (const auto& v : field) {
        all.emplace_back(v[0], v[1], v[2]);
    }
    return all;
}

double greatest(const std::vector<Vector3d>& all) {
    double most = 0;
    for (const Vector3d& v : all) {
        most = std::max(most, v.norm());
    }
    return most;
}

/// The least eigenvalue of the tangent over the components that nothing holds.
double least_eigenvalue(const reference::Body& body, std::span<const PrescribedNode> held,
                        const std::vector<Vector3d>& u) {
    std::vector<unsigned> axes(u.size(), 0);
    for (const PrescribedNode& node : held) {
        axes[node.node] |= node.axes;
    }
    std::vector<Eigen::Index> free;
    for (std::size_t c = 0; c < 3 * u.size(); ++c) {
        if (!(axes[c / 3] >> c % 3 & 1)) {
            free.push_back(static_cast<Eigen::Index>(c));
        }
    }
    const Eigen::MatrixXd all = reference::hessian(body, u);
    const Eigen::MatrixXd tangent = all(free, free);
    return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(tangent, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

/// Along the loading, followed in small steps: the least eigenvalue of the tangent over that at rest, at its smallest;
/// nothing where the way ends early, or where the body is neutral at rest, as one without face diagonals may be. Where
/// it stays well above zero, there is one equilibrium to come to.
std::optional<double> least_on_the_way(const Scene& scene, const Lattice& lattice,
                                       std::span<const std::array<double, 3>> rest) {
    constexpr int kParts = 20;
    const reference::Body body = reference::assemble(lattice, scene.material);
    EquilibriumSolver<double> solver(lattice, scene.material);
    Supports supports(scene, rest);
    const std::vector<Vector3> loads = nodal_loads(scene, loaded_nodes(scene, lattice, rest), rest.size(), 0);
    std::vector<std::array<double, 3>> u(rest.size());
    const double at_rest = least_eigenvalue(body, supports.present(), vectors(u));
    if (at_rest < 1e-6 * scene.material.young_modulus * lattice.cell_size()) {
        return std::nullopt;
    }
    double least = 1;
    for (int part = 1; part <= kParts; ++part) {
        const EquilibriumResult result = solver.follow(
            [&](double fraction) {
                const double all = (part - 1 + fraction) / kParts;
                const auto held = supports.at_part(all);
                Loading loading{{held.begin(), held.end()}, loads, scene.gravity.acceleration};
                for (std::size_t a = 0; a < 3; ++a) {
                    loading.acceleration[a] *= all;
                    for (Vector3& force : loading.forces) {
                        force[a] *= all;
                    }
                }
                return loading;
            },
            VectorField<double>::aos(u.data()->data(), u.size()));
        if (result.status != EquilibriumStatus::converged) {
            return std::nullopt;
        }
        least = std::min(least, least_eigenvalue(body, supports.present(), vectors(u)) / at_rest);
    }
    return least;
}

/// Whether the full loading has a strict minimum at each of two states: two equilibria, then.
bool both_are_minima(const Scene& scene, const Lattice& lattice, std::span<const std::array<double, 3>> rest,
                     const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
    const reference::Body body = reference::assemble(lattice, scene.material);
    Supports supports(scene, rest);
    const auto held = supports.at_part(1);
    return least_eigenvalue(body, {held.begin(), held.end()}, a) > 0 &&
           least_eigenvalue(body, {held.begin(), held.end()}, b) > 0;
}

/// What a run came to, or the line that says why to nothing.
struct Ended {
    std::string error; ///< "" where it came to rest
    Summary summary;
    std::vector<Vector3d> u;
};

Ended ended(const Scene& scene, const SimulationOptions& options) {
    Ended end;
    try {
        Simulation simulation(scene, options);
        end.summary = simulation.run();
        end.error = end.summary.converged ? "" : end.summary.failure;
        end.u = vectors(simulation.displacements());
    } catch (const std::invalid_argument& error) {
        end.error = error.what();
    } catch (const SceneError& error) {
        end.error = error.what();
    }
    return end;
}

/// How far two runs are apart, by the problem's own scale: forces and torques over the greatest force (times the
/// shortest edge), displacements over the greatest.
double difference(const Ended& a, const Ended& b, double edge) {
    double force = 1e-300, apart = 0, way = std::max({greatest(a.u), greatest(b.u), 1e-300});
    for (const Ended* end : {&a, &b}) {
        for (const ProbeReading& probe : end->summary.probes) {
            for (std::size_t c = 0; c < 3; ++c) {
                force = std::max({force, std::abs(probe.force[c]), std::abs(probe.torque[c]) / edge});
            }
        }
    }
    for (std::size_t p = 0; p < a.summary.probes.size(); ++p) {
        const ProbeReading &x = a.summary.probes[p], &y = b.summary.probes[p];
        for (std::size_t c = 0; c < 3; ++c) {
            apart = std::max({apart, std::abs(x.force[c] - y.force[c]) / force,
                              std::abs(x.torque[c] - y.torque[c]) / (force * edge)});
        }
    }
    for (std::size_t n = 0; n < a.u.size(); ++n) {
        apart = std::max(apart, (a.u[n] - b.u[n]).norm() / way);
    }
    return apart;
}

SimulationOptions random_options(Draw& draw) {
    SimulationOptions options;
    options.plan.threads = draw.whole(1, 2);
    options.plan.layout = draw.chance(0.5) ? "" : draw.word({"flat-rows", "active-rows", "network"});
    return options;
}

class RandomScenes : public ::testing::Test {
protected:
    std::string path(const char* name) const { return (directory_.path() / name).string(); }
    Scene parsed(const RandomScene& scene, const std::string& text) {
        if (!scene.voxels.empty()) {
            test::write_text(path("voxels.npy"), scene.voxels);
        }
        return parse_scene(text, path("s.toml"));
    }
    test::TemporaryDirectory directory_;
};

TEST_F(RandomScenes, rest_where_static_solves_say) {
    // Where the tangent keeps this part of its least eigenvalue, no branch is near.
    constexpr double kBranching = 0.05;
    for_each_scene(200, [&](Draw& draw) {
        const RandomScene scene = test::random_scene_of(draw);
        const Scene still = parsed(scene, scene.at_rest()), moving = parsed(scene, scene.damped(1e-6));
        const Ended at_rest = ended(still, random_options(draw)), in_time = ended(moving, random_options(draw));
        const char* const kClass = "equilibrium against damped motion";
        for (const Ended* end : {&at_rest, &in_time}) {
            EXPECT_EQ(end->error.find('\n'), std::string::npos) << end->error;
        }
        const double edge = still.body.cell_size;
        const double apart = at_rest.error.empty() && in_time.error.empty() ? difference(at_rest, in_time, edge) : 0;
        if (apart <= 0.01 && at_rest.error.empty()) {
            counts().add(kClass, in_time.error.empty() ? End::right : End::error);
            return;
        }
        if (!in_time.error.empty()) {
            counts().add(kClass, End::error);
            return;
        }
        Simulation body(still);
        const std::optional<double> least = least_on_the_way(still, body.lattice(), body.rest_positions());
        // Cells without face diagonals have several shapes at one load, near the way too (docs/stability.md): there the
        // eigenvalues at both ends tell.
        const bool several = !least || *least < kBranching ||
                             (still.material.face_diagonal_ratio == 0 && at_rest.error.empty() &&
                              both_are_minima(still, body.lattice(), body.rest_positions(), at_rest.u, in_time.u));
        counts().add(kClass, several ? at_rest.error.empty() ? End::several : End::error : End::wrong);
        EXPECT_TRUE(several) << apart << " apart, the least eigenvalue on the way " << *least << " of that at rest\n"
                             << at_rest.error << "\n"
                             << scene.at_rest();
    });
}

// -- The program

/// Everything that a run wrote is finite.
bool all_finite(const std::filesystem::path& folder) {
    bool good = true;
    if (!std::filesystem::exists(folder)) {
        return good;
    }
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const std::string text = test::read_text(entry.path());
        if (entry.path().extension() == ".vtu") {
            for (const char* array : {"displacement", "velocity", "volume_ratio"}) {
                for (const double x : test::vtu_array<double>(text, array)) {
                    good = good && std::isfinite(x);
                }
            }
        } else if (entry.path().extension() == ".csv") {
            good = good && text.find("nan") == std::string::npos && text.find("inf") == std::string::npos;
        } else if (entry.path().extension() == ".json") {
            good = good && text.find("null") == std::string::npos; // what JSON makes of a NaN
        }
    }
    return good;
}

/// The lines that are no warnings, nor tell what a long run may take.
std::string errors_of(const std::string& text) {
    std::string errors;
    for (const std::string& line : test::random_scene::lines_of(text)) {
        const bool told = line.starts_with("hybmss: warning: ") || line.find(": it may take about ") != line.npos;
        errors += told ? "" : line + "\n";
    }
    return errors;
}

class RandomPrograms : public RandomScenes {
protected:
    /// `hybmss COMMAND s.toml OPTIONS`: asked to stop after a while, killed where it does not.
    test::ProgramResult program(const std::string& command, const std::string& options) const {
        return test::run_program("-k 5 10 '" HYBMSS_APP "' " + command + " s.toml " + options, directory_.path(),
                                 "timeout");
    }
    void write(const RandomScene& scene, const std::string& text) const {
        std::filesystem::remove_all(path("out"));
        if (!scene.voxels.empty()) {
            test::write_text(path("voxels.npy"), scene.voxels);
        }
        test::write_text(path("s.toml"), text);
    }
    /// Runs what lies there. An answer with its files; or one line, and no files where it is the scene's fault.
    End run(const RandomScene& scene, test::ProgramResult& result) const {
        result = program("run", scene.options + " --quiet --out out");
        const std::string errors = errors_of(result.errors);
        const bool one_line = errors.starts_with("hybmss: error: ") && errors.find('\n') == errors.size() - 1 &&
                              errors.find("-nan") == std::string::npos;
        const bool files = std::filesystem::exists(path("out") + "/summary.json");
        if (!all_finite(path("out"))) {
            return End::wrong;
        }
        switch (result.exit_code) {
        case 0:
            return errors.empty() && files ? End::right : End::wrong;
        case 1:
            return one_line ? End::error : End::wrong;
        case 2:
            return one_line && !std::filesystem::exists(path("out")) ? End::error : End::wrong;
        case 124: // it goes on for longer than a test may take, and stopped when it was told to
            return errors.starts_with("hybmss: stopped by SIGTERM after step ") ? End::right : End::wrong;
        default:
            return End::wrong;
        }
    }
};

TEST_F(RandomPrograms, explain_judges_as_run_does) {
    for_each_scene(60, [&](Draw& draw) {
        const RandomScene scene = test::random_motion(draw);
        const bool damaged = draw.chance(0.5);
        const std::string text =
            damaged ? test::kDamages[draw.below(test::kDamages.size())].of(scene.text, draw) : scene.text;
        write(scene, text);
        test::ProgramResult ran;
        const End end = run(scene, ran);
        const test::ProgramResult explained = program("explain", scene.options);
        const std::string errors = errors_of(explained.errors);
        // What is refused is refused by both in the same words; what fails as it runs may fail as it is timed.
        const bool alike = ran.exit_code == 2
                               ? explained.exit_code == 2 && errors == errors_of(ran.errors)
                               : explained.exit_code == 0 || (explained.exit_code == 1 && ran.exit_code == 1);
        const bool right = end != End::wrong && alike && explained.output.find("nan") == std::string::npos &&
                           explained.output.find("inf ") == std::string::npos;
        counts().add("explain against run", !right ? End::wrong : ran.exit_code == 2 ? End::error : End::right);
        EXPECT_TRUE(right) << "run: " << ran.exit_code << " " << ran.errors << "explain: " << explained.exit_code << " "
                           << explained.errors << explained.output << text;
    });
}

TEST_F(RandomPrograms, damaged_scenes_end_in_an_answer_or_one_line) {
    for_each_scene(300, [&](Draw& draw) {
        const RandomScene scene = test::random_motion(draw);
        const test::Damage& damage = test::kDamages[draw.below(test::kDamages.size())];
        std::string text = damage.of(scene.text, draw);
        write(scene, text);
        test::ProgramResult result;
        const End end = run(scene, result);
        counts().add(damage.name, end);
        EXPECT_TRUE(end != End::wrong) << damage.name << ": " << result.exit_code << " " << result.errors << text;
    });
}

} // namespace
} // namespace hybmss
