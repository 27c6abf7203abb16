// The springs of a cube of cells by this library, by the plain loops of the yardstick and by other programs, in turns,
// on one thread. Writes JSON, which scripts/peers makes its tables of.

#include "bench/machine.hpp"
#include "bench/moving_body.hpp"
#include "bench/peers/engines.hpp"
#include "hybmss/explicit_dynamics.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <limits>
#include <memory>
#include <utility>

namespace hybmss::bench {

double difference(const std::vector<Vector3>& expected, const std::vector<Vector3>& found) {
    double greatest = 0, apart = 0;
    for (std::size_t n = 0; n < expected.size(); ++n) {
        const Vector3 d = expected[n] - found.at(n);
        greatest = std::max(greatest, dot(expected[n], expected[n]));
        const double square = dot(d, d);
        apart = std::isfinite(square) ? std::max(apart, square) : std::numeric_limits<double>::infinity();
    }
    return std::sqrt(apart / greatest);
}

namespace {

Yardstick plain_body(const Network& springs, const std::vector<Vector3>& positions) {
    Yardstick body = make_yardstick(springs);
    for (std::size_t n = 0; n < positions.size(); ++n) {
        body.nodes[n].position = positions[n];
    }
    return body;
}

} // namespace

std::vector<Vector3> plain_forces(const Network& springs, const std::vector<Vector3>& positions) {
    Yardstick body = plain_body(springs, positions);
    compute_forces(body);
    std::vector<Vector3> forces;
    for (const YardstickNode& node : body.nodes) {
        forces.push_back(node.force);
    }
    return forces;
}

std::vector<Vector3> plain_motion(const Task& task, int steps) {
    Yardstick body = plain_body(task.springs, task.positions);
    std::vector<Vector3> positions;
    for (int s = 0; s < steps; ++s) {
        step(body, task.time_step, 0);
    }
    for (const YardstickNode& node : body.nodes) {
        positions.push_back(node.position);
    }
    return positions;
}

namespace {

using Json = nlohmann::json;

constexpr double kCellSize = 0.5;

Material material(bool volume) {
    Material result;
    result.poisson_ratio = 0.45;
    result.volume_energy = volume ? VolumeEnergy::quadratic : VolumeEnergy::none;
    return result;
}

const char* does(bool volume) {
    return volume ? "springs and volume" : "springs";
}

/// `network`: of explicit springs and cells, as other programs have them.
template <class T>
void add_ours(const Lattice& lattice, const Task& task, bool network, bool volume, InstructionSet set, Field& field) {
    PlanOptions options;
    options.threads = 1;
    options.instruction_set = set;
    const auto body =
        network ? std::make_shared<ExplicitDynamics<T>>(Network::from_lattice(lattice, material(volume)), options)
                : std::make_shared<ExplicitDynamics<T>>(lattice, material(volume), options);
    disturb(*body, kCellSize);
    const bool is_float = sizeof(T) == sizeof(float);
    const std::string engine =
        std::string(network ? "HybMSS, network, " : "HybMSS, ") + std::string(name(body->describe().instruction_set));
    if (!volume) {
        std::vector<T> f(3 * body->node_count());
        body->get_forces(VectorField<T>::aos(f.data(), body->node_count()));
        std::vector<Vector3> found;
        for (std::size_t n = 0; n < f.size(); n += 3) {
            found.push_back({double(f[n]), double(f[n + 1]), double(f[n + 2])});
        }
        field.checks.push_back(
            {engine + (is_float ? ", float" : ", double") + ": forces of the springs beside the plain loops'",
             difference(plain_forces(task.springs, task.positions), found), is_float ? 2e-5 : 1e-11});
    }
    StepParameters parameters;
    parameters.time_step = task.time_step;
    field.contenders.push_back({engine, is_float ? "float" : "double", does(volume), "step", body->describe().springs,
                                [body, parameters](long steps) { body->step(parameters, steps); }});
}

void add_yardstick(const Lattice& lattice, double time_step, bool volume, Field& field) {
    const auto body = std::make_shared<Yardstick>(moving_yardstick(lattice, material(volume)));
    field.contenders.push_back(
        {"yardstick: plain loops", "double", does(volume), "step", body->springs.size(), [body, time_step](long steps) {
             for (long s = 0; s < steps; ++s) {
                 step(*body, time_step, 0);
             }
         }});
}

struct Engine {
    const char* name;
    void (*add)(const Task&, Field&); ///< none: not built
};

constexpr Engine kEngines[] = {
#ifdef HYBMSS_PEERS_LAMMPS
    {"LAMMPS", add_lammps},
#else
    {"LAMMPS", nullptr},
#endif
#ifdef HYBMSS_PEERS_BULLET
    {"Bullet", add_bullet},
#else
    {"Bullet", nullptr},
#endif
};

/// Seconds on the core: other programs, which hold the steps up, are left out.
Trial on_core(Work work) {
    return [work = std::move(work)](long steps) {
        const auto now = [] {
            timespec time = {};
            clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
            return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
        };
        const double start = now();
        work(steps);
        return now() - start;
    };
}

void measure(int edge, int rounds, Json& report) {
    const Lattice lattice = Lattice::box(edge, edge, edge, kCellSize);
    const Network springs = Network::from_lattice(lattice, material(false));
    Task task{springs, {}, 0};
    // A stable step of the stiffer body, for all.
    task.time_step = 0.5 * ExplicitDynamics<double>(lattice, material(true)).critical_time_step();
    for (const YardstickNode& node : moving_yardstick(lattice, material(false)).nodes) {
        task.positions.push_back(node.position);
    }

    Field field;
    const auto ours = [&](bool network, InstructionSet set) {
        for (const bool volume : {true, false}) {
            add_ours<float>(lattice, task, network, volume, set, field);
            add_ours<double>(lattice, task, network, volume, set, field);
        }
    };
    ours(false, InstructionSet::automatic);
    ours(true, InstructionSet::automatic);
    if (field.contenders.front().engine != "HybMSS, sse2") {
        ours(false, InstructionSet::sse2); // what a distribution compiles other programs for
    }
    for (const bool volume : {true, false}) {
        add_yardstick(lattice, task.time_step, volume, field);
    }
    for (const Engine& engine : kEngines) {
        if (engine.add == nullptr) {
            report["skipped"].push_back(
                {{"place", "native"}, {"cells", edge}, {"engine", engine.name}, {"why", "its library is not there"}});
            continue;
        }
        try {
            engine.add(task, field);
        } catch (const std::exception& error) {
            report["skipped"].push_back(
                {{"place", "native"}, {"cells", edge}, {"engine", engine.name}, {"why", error.what()}});
        }
    }

    double wrong = 0;
    for (const Contender& contender : field.contenders) {
        wrong += contender.springs == springs.springs.size() ? 0 : 1;
    }
    field.checks.push_back({"contenders that count other springs than ours", wrong, 0});

    std::vector<Trial> trials;
    for (const Contender& contender : field.contenders) {
        trials.push_back(on_core(contender.steps));
    }
    Interleaved interleaved(std::move(trials), kSliceSeconds);
    std::vector<std::vector<double>> seconds(field.contenders.size());
    for (int round = 0; round < rounds; ++round) {
        const std::vector<double> next = interleaved.next();
        for (std::size_t c = 0; c < next.size(); ++c) {
            seconds[c].push_back(next[c]);
        }
    }
    for (std::size_t c = 0; c < field.contenders.size(); ++c) {
        const Contender& contender = field.contenders[c];
        // Seconds of every round: ratios are taken within a round.
        report["rows"].push_back({{"place", "native"},
                                  {"cells", edge},
                                  {"engine", contender.engine},
                                  {"numbers", contender.numbers},
                                  {"does", contender.does},
                                  {"unit", contender.unit},
                                  {"springs", contender.springs},
                                  {"seconds", seconds[c]}});
    }
    for (const Check& check : field.checks) {
        report["checks"].push_back({{"place", "native"},
                                    {"cells", edge},
                                    {"what", check.what},
                                    {"error", check.error},
                                    {"bound", check.bound}});
    }
}

int run(int argc, char** argv) {
    std::vector<int> edges;
    long rounds = 0;
    for (int i = 1; i < argc; ++i) {
        char* end = nullptr;
        const long value = std::strtol(argv[i], &end, 10);
        if (end == argv[i] || *end != '\0' || value < 1 || value > (i == 1 ? 100000 : 100)) {
            std::fprintf(
                stderr, "hybmss_peers: '%s' is not allowed: rounds, 1 to 100000, then edges of cubes, 1 to 100 cells\n",
                argv[i]);
            return 2;
        }
        if (i == 1) {
            rounds = value;
        } else {
            edges.push_back(static_cast<int>(value));
        }
    }
    if (edges.empty()) {
        std::fprintf(stderr, "usage: hybmss_peers ROUNDS EDGE...\n");
        return 2;
    }
    Json report = {{"rows", Json::array()}, {"checks", Json::array()}, {"skipped", Json::array()}};
    report["machine"] = machine_line();
    for (const int edge : edges) {
        measure(edge, static_cast<int>(rounds), report);
    }
    std::puts(report.dump().c_str());
    return 0;
}

} // namespace
} // namespace hybmss::bench

int main(int argc, char** argv) {
    try {
        return hybmss::bench::run(argc, argv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "hybmss_peers: %s\n", error.what());
        return 1;
    }
}
