// The C interface's arguments: objects made, used and destroyed in any order, by calls of which some are right.

#include "tests/fuzz/c_arguments.hpp"
#include "tests/fuzz/fuzz_input.hpp"

#include <algorithm>
#include <cstring>
#include <string_view>
#include <vector>

using namespace hybmss;

namespace {

/// Every status is one of the interface's, and what fails says why in one line.
bool checked(hybmss_status status) {
    fuzz::require(std::string_view(hybmss_status_name(status)) != "unknown status", "a status without a name");
    fuzz::require(status != HYBMSS_INTERNAL_ERROR, "an internal error");
    if (status != HYBMSS_OK) {
        fuzz::require_one_line(hybmss_last_error());
    }
    return status == HYBMSS_OK;
}

/// An object and its number of nodes, which its caller has to know.
template <class Object>
struct Known {
    Object* object = nullptr;
    std::size_t nodes = 0;
};

/// Objects of one kind, a few at a time; where one is asked for there may be none: null.
template <class Object, void (*destroy)(Object*)>
class Objects {
public:
    ~Objects() {
        for (const Known<Object>& known : all_) {
            destroy(known.object);
        }
    }
    Known<Object> pick(fuzz::Arguments& arguments) {
        return all_.empty() || arguments.seldom()
                   ? Known<Object>{}
                   : all_[static_cast<std::size_t>(arguments.below(static_cast<int>(all_.size())))];
    }
    void keep(hybmss_status status, Known<Object> made) {
        if (!checked(status)) {
            fuzz::require(!made.object, "a call that failed made an object");
            return;
        }
        fuzz::require(made.object, "a call made no object");
        all_.push_back(made);
        if (all_.size() > 4) {
            destroy(all_.front().object);
            all_.erase(all_.begin());
        }
    }

private:
    std::vector<Known<Object>> all_;
};

class Calls {
public:
    explicit Calls(fuzz::Arguments& arguments) : a_(arguments) {}

    void next() {
        switch (a_.below(14)) {
        case 0:
            return make_lattice();
        case 1:
            return make_network();
        case 2:
            return make_plan();
        case 3:
            return make_dynamics();
        case 4:
            return ask_body();
        case 5:
        case 6:
            return add_forces();
        case 7:
            return energy();
        case 8:
            return add_hessian_product();
        case 9:
            return ask_plan();
        case 10:
            return hold_and_load();
        case 11:
            return step();
        case 12:
            return read_state();
        default:
            return set_state();
        }
    }

private:
    void keep_body(hybmss_status status, hybmss_body* body) {
        std::size_t nodes = 0;
        if (body) {
            fuzz::require(checked(hybmss_body_node_count(body, &nodes)), "a body without a number of nodes");
        }
        bodies_.keep(status, {body, nodes});
    }

    void make_lattice() {
        std::int32_t cells[3];
        double nodes = 1;
        for (std::int32_t& count : cells) {
            count = a_.seldom() ? a_.any<std::int32_t>() : a_.below(5);
            nodes *= std::max(count, 0) + 1.0;
        }
        if (nodes > 4096 && nodes <= 1e9) {
            return; // allowed, and large
        }
        const hybmss_material material = a_.material();
        std::size_t count = 0;
        std::vector<float> scales;
        if (a_.below(2) == 0) {
            count = a_.seldom() || nodes > 4096
                        ? static_cast<std::size_t>(a_.below(8))
                        : static_cast<std::size_t>(cells[0]) * static_cast<std::size_t>(std::max(cells[1], 0)) *
                              static_cast<std::size_t>(std::max(cells[2], 0)) % 4096;
            for (std::size_t c = 0; c < count; ++c) {
                scales.push_back(a_.seldom() ? static_cast<float>(a_.number()) : static_cast<float>(a_.below(2)));
            }
        }
        hybmss_body* body = nullptr;
        const double cell_size = a_.seldom() ? a_.number() : 0.5;
        const hybmss_status status =
            hybmss_lattice_create(a_.seldom() ? nullptr : cells, cell_size, scales.empty() ? nullptr : scales.data(),
                                  count, a_.seldom() ? nullptr : &material, &body);
        keep_body(status, body);
    }

    void make_network() {
        const auto nodes = static_cast<std::size_t>(a_.below(24));
        std::vector<double> positions, masses;
        for (std::size_t n = 0; n < nodes; ++n) {
            for (std::size_t c = 0; c < 3; ++c) {
                positions.push_back(a_.seldom() ? a_.number()
                                                : static_cast<double>(n >> c & 1) + static_cast<double>(n >> 3));
            }
            masses.push_back(a_.seldom() ? a_.number() : 1);
        }
        const auto node = [&] {
            return a_.seldom() || nodes == 0 ? a_.any<std::int32_t>() : a_.below(static_cast<int>(nodes));
        };
        std::vector<hybmss_spring> springs(static_cast<std::size_t>(a_.below(24)));
        for (hybmss_spring& spring : springs) {
            spring = {node(), node(), a_.seldom() ? a_.number() : 10, {1, 0, 0}};
            if (a_.seldom()) {
                spring.rest_vector[0] = a_.number();
            }
        }
        std::vector<hybmss_cell> cells(static_cast<std::size_t>(a_.below(4)));
        for (hybmss_cell& cell : cells) {
            const std::int32_t first = node();
            for (std::int32_t corner = 0; corner < 8; ++corner) {
                cell.nodes[corner] = a_.seldom() ? node()
                                                 : static_cast<std::int32_t>(static_cast<std::uint32_t>(first) +
                                                                             static_cast<std::uint32_t>(corner));
            }
            cell.kappa = a_.seldom() ? a_.number() : 100;
        }
        const hybmss_network network = {a_.seldom() ? nullptr : positions.data(),
                                        a_.seldom() ? nullptr : masses.data(),
                                        nodes,
                                        a_.seldom() ? nullptr : springs.data(),
                                        springs.size(),
                                        a_.seldom() ? nullptr : cells.data(),
                                        cells.size(),
                                        a_.seldom() ? a_.any<std::int32_t>() : a_.below(4)};
        hybmss_body* body = nullptr;
        const hybmss_network* const given = a_.seldom() ? nullptr : &network;
        if (a_.below(2) == 0) {
            keep_body(hybmss_network_create(given, &body), body);
            return;
        }
        std::vector<double> scales;
        for (std::size_t c = 0; c < cells.size(); ++c) {
            scales.push_back(a_.seldom() ? a_.number() : a_.below(3));
        }
        const hybmss_material material = a_.material();
        const double cell_size = a_.seldom() ? a_.number() : 1;
        keep_body(hybmss_network_create_on_means(given, a_.seldom() ? nullptr : &material, cell_size,
                                                 a_.seldom() ? nullptr : scales.data(), scales.size(), &body),
                  body);
    }

    void make_plan() {
        const hybmss_plan_options options = a_.plan_options();
        hybmss_plan* plan = nullptr;
        const auto [body, nodes] = bodies_.pick(a_);
        const hybmss_status status =
            hybmss_plan_create(body, a_.precision(), a_.below(2) == 0 ? nullptr : &options, &plan);
        plans_.keep(status, {plan, nodes});
    }

    void make_dynamics() {
        const hybmss_plan_options options = a_.plan_options();
        hybmss_dynamics* dynamics = nullptr;
        const auto [body, nodes] = bodies_.pick(a_);
        const hybmss_status status =
            hybmss_dynamics_create(body, a_.precision(), a_.below(2) == 0 ? nullptr : &options, &dynamics);
        dynamics_.keep(status, {dynamics, nodes});
    }

    void ask_body() {
        const auto [body, nodes] = bodies_.pick(a_);
        std::size_t count = 0;
        checked(hybmss_body_node_count(body, a_.seldom() ? nullptr : &count));
        const std::size_t three = a_.seldom() ? static_cast<std::size_t>(a_.below(64)) : 3 * nodes;
        checked(hybmss_body_rest_positions(
            body, a_.seldom() ? nullptr : static_cast<double*>(a_.memory(three * sizeof(double))), three));
        const std::size_t one = a_.seldom() ? static_cast<std::size_t>(a_.below(64)) : nodes;
        checked(hybmss_body_grid_indices(
            body, a_.seldom() ? nullptr : static_cast<std::uint32_t*>(a_.memory(one * sizeof(std::uint32_t))), one));
        read_stresses(body, nodes);
        wear_skin(body, nodes);
    }

    void read_stresses(const hybmss_body* body, std::size_t nodes) {
        std::size_t count = 0;
        checked(hybmss_body_cell_count(body, &count));
        const auto u = a_.field<hybmss_const_field>(nodes);
        const std::size_t given = a_.seldom() ? static_cast<std::size_t>(a_.below(64)) : count;
        std::vector<hybmss_cell_stress> stresses(given);
        checked(hybmss_body_stresses(body, a_.seldom() ? nullptr : &u, a_.seldom() ? nullptr : stresses.data(), given));
    }

    void wear_skin(const hybmss_body* body, std::size_t nodes) {
        std::vector<double> vertices(static_cast<std::size_t>(3 * a_.below(9)));
        for (double& x : vertices) {
            x = a_.seldom() ? a_.number() : 0.1 * a_.below(64);
        }
        const std::size_t count = vertices.size() / 3;
        std::vector<std::uint32_t> triangles(count > 0 ? static_cast<std::size_t>(3 * a_.below(5)) : 0);
        for (std::uint32_t& vertex : triangles) {
            vertex =
                a_.seldom() ? a_.any<std::uint32_t>() : static_cast<std::uint32_t>(a_.below(static_cast<int>(count)));
        }
        const auto u = a_.field<hybmss_const_field>(nodes);
        const auto x = a_.field<hybmss_field>(count), n = a_.field<hybmss_field>(count);
        hybmss_skin* skin = nullptr;
        if (checked(hybmss_skin_create(body, u.precision, vertices.data(), count, triangles.data(),
                                       triangles.size() / 3, nullptr, &skin))) {
            checked(hybmss_skin_update(skin, a_.seldom() ? nullptr : &u, a_.seldom() ? nullptr : &x,
                                       a_.below(2) == 0 ? nullptr : &n));
        }
        hybmss_skin_destroy(skin);
    }

    void add_forces() {
        const auto [plan, count] = plans_.pick(a_);
        const auto u = a_.field<hybmss_const_field>(count);
        const auto f = a_.field<hybmss_field>(count);
        checked(hybmss_plan_add_forces(plan, a_.seldom() ? nullptr : &u, a_.seldom() ? nullptr : &f));
    }

    void energy() {
        const auto [plan, count] = plans_.pick(a_);
        const auto u = a_.field<hybmss_const_field>(count);
        double springs = -1, volume = -1;
        if (!checked(
                hybmss_plan_energy(plan, a_.seldom() ? nullptr : &u, a_.below(2) == 0 ? nullptr : &springs, &volume))) {
            fuzz::require(springs == -1 && volume == -1, "a call that failed wrote an energy");
        }
    }

    void add_hessian_product() {
        const auto [plan, count] = plans_.pick(a_);
        const auto u = a_.field<hybmss_const_field>(count), p = a_.field<hybmss_const_field>(count);
        const auto q = a_.field<hybmss_field>(count);
        checked(hybmss_plan_add_hessian_product(plan, a_.seldom() ? nullptr : &u, a_.seldom() ? nullptr : &p,
                                                a_.seldom() ? nullptr : &q));
    }

    void ask_plan() {
        hybmss_plan* const plan = plans_.pick(a_).object;
        double step = 0;
        checked(hybmss_plan_critical_time_step(plan, a_.seldom() ? nullptr : &step));
        const auto capacity = static_cast<std::size_t>(a_.below(40));
        char* text = static_cast<char*>(a_.memory(capacity));
        std::size_t length = 0;
        if (checked(
                hybmss_plan_describe(plan, a_.seldom() ? nullptr : text, capacity, a_.seldom() ? nullptr : &length)) &&
            capacity > 0) {
            fuzz::require(std::memchr(text, 0, capacity) != nullptr, "a description without an end");
        }
    }

    void hold_and_load() {
        hybmss_dynamics* const dynamics = dynamics_.pick(a_).object;
        const auto node = [&] {
            return a_.seldom() ? a_.any<std::uint32_t>() : static_cast<std::uint32_t>(a_.below(8));
        };
        std::vector<hybmss_prescribed_node> held(static_cast<std::size_t>(a_.below(4)));
        for (hybmss_prescribed_node& one : held) {
            one = {node(), a_.seldom() ? a_.any<std::uint32_t>() : 7u, {0, 0, 0}, {0, 0, 0}};
            one.displacement[0] = a_.seldom() ? a_.number() : 0;
        }
        checked(hybmss_dynamics_prescribe(dynamics, a_.seldom() ? nullptr : held.data(), held.size()));
        std::vector<hybmss_nodal_load> loads(static_cast<std::size_t>(a_.below(4)));
        for (hybmss_nodal_load& load : loads) {
            load = {node(), {a_.number(), 0, 0}};
        }
        checked(hybmss_dynamics_load(dynamics, a_.seldom() ? nullptr : loads.data(), loads.size()));
    }

    void step() {
        hybmss_dynamics* const dynamics = dynamics_.pick(a_).object;
        const hybmss_step_parameters parameters = {a_.seldom() ? a_.number() : 1e-3,
                                                   {0, a_.seldom() ? a_.number() : -10, 0},
                                                   a_.seldom() ? a_.number() : 0,
                                                   a_.below(2) == 0 ? HYBMSS_SYMPLECTIC_EULER : HYBMSS_LEAPFROG};
        checked(hybmss_dynamics_step(dynamics, a_.seldom() ? nullptr : &parameters,
                                     a_.seldom() ? -a_.below(100) : a_.below(3)));
    }

    void read_state() {
        const auto [dynamics, count] = dynamics_.pick(a_);
        const auto out = a_.field<hybmss_field>(count);
        const hybmss_field* given = a_.seldom() ? nullptr : &out;
        checked(hybmss_dynamics_get_displacements(dynamics, given));
        checked(hybmss_dynamics_get_velocities(dynamics, given));
        checked(hybmss_dynamics_get_forces(dynamics, given));
        double energies[3];
        checked(hybmss_dynamics_energies(dynamics, energies, nullptr, a_.seldom() ? nullptr : energies + 2));
        checked(hybmss_dynamics_masses(dynamics, static_cast<double*>(a_.memory(count * sizeof(double))), count));
        checked(hybmss_dynamics_critical_time_step(dynamics, a_.seldom() ? nullptr : energies));
    }

    void set_state() {
        const auto [dynamics, count] = dynamics_.pick(a_);
        const auto in = a_.field<hybmss_const_field>(count);
        const hybmss_const_field* given = a_.seldom() ? nullptr : &in;
        checked(hybmss_dynamics_set_displacements(dynamics, given));
        checked(hybmss_dynamics_set_velocities(dynamics, given));
    }

    fuzz::Arguments& a_;
    Objects<hybmss_body, hybmss_body_destroy> bodies_;
    Objects<hybmss_plan, hybmss_plan_destroy> plans_;
    Objects<hybmss_dynamics, hybmss_dynamics_destroy> dynamics_;
};

} // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    fuzz::Arguments arguments(data, size);
    Calls calls(arguments);
    while (arguments.left()) {
        calls.next();
    }
    return 0;
}
