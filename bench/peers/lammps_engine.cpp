#include "bench/peers/engines.hpp"

#include <lammps/library.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <limits>
#include <map>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace hybmss::bench {
namespace {

class Lammps {
public:
    Lammps() {
        std::array<std::string, 6> words = {"lammps", "-screen", "none", "-log", "none", "-nocite"};
        std::array<char*, 6> arguments = {};
        for (std::size_t i = 0; i < words.size(); ++i) {
            arguments[i] = words[i].data();
        }
        handle_ = lammps_open_no_mpi(static_cast<int>(arguments.size()), arguments.data(), nullptr);
        if (handle_ == nullptr) {
            throw std::runtime_error("LAMMPS does not start");
        }
    }
    ~Lammps() { lammps_close(handle_); }
    Lammps(const Lammps&) = delete;
    Lammps& operator=(const Lammps&) = delete;

    /// Lines of LAMMPS's input language.
    void operator()(const std::string& commands) {
        lammps_commands_string(handle_, commands.c_str());
        if (lammps_has_error(handle_) != 0) {
            std::array<char, 500> message = {};
            lammps_get_last_error_message(handle_, message.data(), static_cast<int>(message.size()));
            throw std::runtime_error("LAMMPS: " + std::string(message.data()));
        }
    }

    /// "x", "v" or "f" of the atoms, by their numbers.
    std::vector<Vector3> gather(std::string name, std::size_t atoms) {
        std::vector<double> values(3 * atoms);
        lammps_gather_atoms(handle_, name.data(), 1, 3, values.data());
        std::vector<Vector3> field(atoms);
        for (std::size_t n = 0; n < atoms; ++n) {
            field[n] = {values[3 * n], values[3 * n + 1], values[3 * n + 2]};
        }
        return field;
    }

    void scatter(std::string name, const std::vector<Vector3>& field) {
        std::vector<double> values;
        for (const Vector3& v : field) {
            values.insert(values.end(), {v.x, v.y, v.z});
        }
        lammps_scatter_atoms(handle_, name.data(), 1, 3, values.data());
    }

    std::size_t bonds() { return static_cast<std::size_t>(lammps_get_thermo(handle_, const_cast<char*>("bonds"))); }

private:
    void* handle_ = nullptr;
};

/// Numbers the distinct values that it is asked for, from 1: LAMMPS gives masses and bonds by type.
template <class Value>
class Types {
public:
    int operator()(const Value& value) { return numbers_.try_emplace(value, int(numbers_.size()) + 1).first->second; }
    const std::map<Value, int>& all() const { return numbers_; }

private:
    std::map<Value, int> numbers_;
};

/// A file of LAMMPS's read_data with the body's atoms and bonds; removed with this object.
class DataFile {
public:
    explicit DataFile(const Task& task) {
        const Network& body = task.springs;
        Types<double> masses;
        Types<std::pair<double, double>> bonds;
        std::vector<int> mass_of, bond_of;
        for (const double mass : body.masses) {
            mass_of.push_back(masses(mass));
        }
        for (const Network::Spring& spring : body.springs) {
            const auto& r = spring.rest_vector;
            bond_of.push_back(bonds({spring.stiffness, std::hypot(r[0], r[1], r[2])}));
        }

        const char* folder = std::getenv("TMPDIR");
        name_ = std::string(folder != nullptr ? folder : "/tmp") + "/hybmss_peers_XXXXXX";
        const int descriptor = mkstemp(name_.data());
        if (descriptor < 0) {
            throw std::runtime_error("cannot make a file like " + name_);
        }
        close(descriptor);
        std::ofstream out(name_);
        out << std::setprecision(std::numeric_limits<double>::max_digits10);
        out << "a body of springs\n\n"
            << body.masses.size() << " atoms\n"
            << body.springs.size() << " bonds\n"
            << masses.all().size() << " atom types\n"
            << bonds.all().size() << " bond types\n";
        double reach = 0;
        for (const auto& x : body.rest_positions) {
            reach = std::max({reach, x[0], x[1], x[2]});
        }
        for (const char* axis : {"x", "y", "z"}) {
            out << -reach << ' ' << 2 * reach << ' ' << axis << "lo " << axis << "hi\n";
        }
        out << "\nMasses\n\n";
        for (const auto& [mass, type] : masses.all()) {
            out << type << ' ' << mass << '\n';
        }
        out << "\nBond Coeffs\n\n"; // E = K (r - r0)^2, so K is half of a spring's stiffness
        for (const auto& [spring, type] : bonds.all()) {
            out << type << ' ' << 0.5 * spring.first << ' ' << spring.second << '\n';
        }
        out << "\nAtoms # bond\n\n";
        for (std::size_t n = 0; n < body.masses.size(); ++n) {
            const Vector3& x = task.positions[n];
            out << n + 1 << " 1 " << mass_of[n] << ' ' << x.x << ' ' << x.y << ' ' << x.z << '\n';
        }
        out << "\nBonds\n\n";
        for (std::size_t s = 0; s < body.springs.size(); ++s) {
            out << s + 1 << ' ' << bond_of[s] << ' ' << body.springs[s].a + 1 << ' ' << body.springs[s].b + 1 << '\n';
        }
        if (!out.flush()) {
            throw std::runtime_error("cannot write " + name_);
        }
    }
    ~DataFile() { unlink(name_.c_str()); }
    DataFile(const DataFile&) = delete;
    DataFile& operator=(const DataFile&) = delete;

    const std::string& name() const { return name_; }

private:
    std::string name_;
};

/// Everything that a step does not need is off: no pairs, no neighbours after the first, no sorting, no energies, and
/// `run` sets nothing up anew.
std::shared_ptr<Lammps> make_lammps(const Task& task) {
    const DataFile data(task);
    auto lammps = std::make_shared<Lammps>();
    std::ostringstream step;
    step << std::setprecision(std::numeric_limits<double>::max_digits10) << task.time_step;
    (*lammps)("units si\n"
              "atom_style bond\n"
              "atom_modify map array sort 0 0\n"
              "boundary f f f\n"
              "special_bonds lj/coul 1 1 1\n"
              "bond_style harmonic\n"
              "read_data " +
              data.name() +
              " extra/special/per/atom 32\n"
              "comm_modify cutoff 1e-6\n"
              "neigh_modify once yes\n"
              "thermo_style custom step bonds\n"
              "thermo_modify norm no lost warn\n"
              "thermo 0\n"
              "fix motion all nve\n"
              "timestep " +
              step.str() + "\nrun 0 post no\n");
    return lammps;
}

} // namespace

void add_lammps(const Task& task, Field& field) {
    const std::size_t nodes = task.positions.size();
    const auto lammps = make_lammps(task);

    const std::vector<Vector3> forces = lammps->gather("f", nodes);
    field.checks.push_back({"LAMMPS's forces of the springs beside the plain loops'",
                            difference(plain_forces(task.springs, task.positions), forces), 1e-10});
    // Velocity Verlet, begun with what half a step gives, goes through the same places.
    std::vector<Vector3> velocities;
    for (std::size_t n = 0; n < nodes; ++n) {
        velocities.push_back((0.5 * task.time_step / task.springs.masses[n]) * forces[n]);
    }
    lammps->scatter("v", velocities);
    constexpr int kSteps = 100;
    (*lammps)("run " + std::to_string(kSteps) + " pre no post no");
    std::vector<Vector3> expected = plain_motion(task, kSteps), found = lammps->gather("x", nodes);
    for (std::size_t n = 0; n < nodes; ++n) {
        const auto& x = task.springs.rest_positions[n];
        expected[n] = expected[n] - Vector3{x[0], x[1], x[2]};
        found[n] = found[n] - Vector3{x[0], x[1], x[2]};
    }
    field.checks.push_back(
        {"LAMMPS's displacements after 100 steps beside the plain loops'", difference(expected, found), 1e-8});

    field.contenders.push_back({"LAMMPS", "double", "springs", "step", lammps->bonds(), [lammps](long steps) {
                                    (*lammps)("run " + std::to_string(steps) + " pre no post no");
                                }});
}

} // namespace hybmss::bench
