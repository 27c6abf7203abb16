#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"
#include "hybmss/force_plan.hpp"

#include <algorithm>
#include <string>

namespace hybmss::c_interface {
namespace {

template <class T>
struct Planned {
    ForcePlan<T> plan;
    mutable Scratch<T> scratch;

    Planned(const hybmss_body& shape, const PlanOptions& options) : plan(made_of<ForcePlan<T>>(shape, options)) {}
    std::size_t nodes() const { return plan.node_count(); }

    void add_forces(const hybmss_const_field* displacements, const hybmss_field* forces) const {
        check<T>(displacements, nodes(), "displacements");
        check<T>(forces, nodes(), "forces");
        check_apart(*displacements, *forces, "forces");
        const Input<T> u(*displacements, nodes(), scratch);
        const Output<T> f(*forces, nodes(), scratch);
        plan.add_forces(u.view(), f.view());
        f.add();
    }
    PotentialEnergy energy(const hybmss_const_field* displacements) const {
        check<T>(displacements, nodes(), "displacements");
        return plan.energy(Input<T>(*displacements, nodes(), scratch).view());
    }
    void add_hessian_product(const hybmss_const_field* displacements, const hybmss_const_field* direction,
                             const hybmss_field* product) const {
        check<T>(displacements, nodes(), "displacements");
        check<T>(direction, nodes(), "direction");
        check<T>(product, nodes(), "product");
        check_apart(*displacements, *product, "product");
        check_apart(*direction, *product, "product");
        const Input<T> u(*displacements, nodes(), scratch), p(*direction, nodes(), scratch);
        const Output<T> q(*product, nodes(), scratch);
        plan.add_hessian_product(u.view(), p.view(), q.view());
        q.add();
    }
};

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_plan {
    std::variant<std::unique_ptr<Planned<float>>, std::unique_ptr<Planned<double>>> held;
};

extern "C" {

hybmss_status hybmss_plan_create(const hybmss_body* body, hybmss_precision precision,
                                 const hybmss_plan_options* options, hybmss_plan** plan) {
    return create<Planned>(body, precision, options, plan, "plan");
}

void hybmss_plan_destroy(hybmss_plan* plan) {
    delete plan;
}

hybmss_status hybmss_plan_add_forces(const hybmss_plan* plan, const hybmss_const_field* displacements,
                                     const hybmss_field* forces) {
    return guarded(plan, "plan", [&](const auto& planned) { planned.add_forces(displacements, forces); });
}

hybmss_status hybmss_plan_energy(const hybmss_plan* plan, const hybmss_const_field* displacements, double* springs,
                                 double* volume) {
    return guarded(plan, "plan", [&](const auto& planned) {
        const PotentialEnergy energy = planned.energy(displacements);
        if (springs) {
            *springs = energy.springs;
        }
        if (volume) {
            *volume = energy.volume;
        }
    });
}

hybmss_status hybmss_plan_add_hessian_product(const hybmss_plan* plan, const hybmss_const_field* displacements,
                                              const hybmss_const_field* direction, const hybmss_field* product) {
    return guarded(plan, "plan",
                   [&](const auto& planned) { planned.add_hessian_product(displacements, direction, product); });
}

hybmss_status hybmss_plan_critical_time_step(const hybmss_plan* plan, double* time_step) {
    return guarded(plan, "plan", [&](const auto& planned) {
        require(time_step, "time_step");
        *time_step = planned.plan.critical_time_step();
    });
}

hybmss_status hybmss_plan_describe(const hybmss_plan* plan, char* text, size_t capacity, size_t* length) {
    return guarded(plan, "plan", [&](const auto& planned) {
        require(text, "text", capacity);
        const std::string description = to_string(planned.plan.describe());
        if (capacity > 0) {
            const std::size_t copied = std::min(capacity - 1, description.size());
            std::copy_n(description.data(), copied, text);
            text[copied] = '\0';
        }
        if (length) {
            *length = description.size();
        }
    });
}

} // extern "C"
