#include "bindings/c/arguments.hpp"
#include "bindings/c/fields.hpp"
#include "hybmss/force_plan.hpp"

#include <algorithm>
#include <memory>
#include <string>
#include <variant>

namespace hybmss::c_interface {
namespace {

template <class T>
struct Planned {
    ForcePlan<T> plan;
    mutable Scratch<T> scratch;

    explicit Planned(ForcePlan<T> made) : plan(std::move(made)) {}
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

template <class T>
std::unique_ptr<const Planned<T>> planned(const hybmss_body& body, const PlanOptions& options) {
    if (const auto* shape = std::get_if<LatticeBody>(&body.shape)) {
        return std::make_unique<const Planned<T>>(ForcePlan<T>(shape->lattice, shape->material, options));
    }
    return std::make_unique<const Planned<T>>(ForcePlan<T>(std::get<Network>(body.shape), options));
}

} // namespace
} // namespace hybmss::c_interface

using namespace hybmss;
using namespace hybmss::c_interface;

struct hybmss_plan {
    std::variant<std::unique_ptr<const Planned<float>>, std::unique_ptr<const Planned<double>>> planned;

    template <class Visit>
    void visit(const Visit& visit) const {
        std::visit([&](const auto& pointer) { visit(*pointer); }, planned);
    }
};

extern "C" {

hybmss_status hybmss_plan_create(const hybmss_body* body, hybmss_precision precision,
                                 const hybmss_plan_options* options, hybmss_plan** plan) {
    return guarded([&] {
        require(plan, "plan");
        require(body, "body");
        const bool wide = is_double(precision, "precision");
        const GivenOptions given(options);
        auto made = std::make_unique<hybmss_plan>();
        if (wide) {
            made->planned = planned<double>(*body, given.options);
        } else {
            made->planned = planned<float>(*body, given.options);
        }
        *plan = made.release();
    });
}

void hybmss_plan_destroy(hybmss_plan* plan) {
    delete plan;
}

hybmss_status hybmss_plan_add_forces(const hybmss_plan* plan, const hybmss_const_field* displacements,
                                     const hybmss_field* forces) {
    return guarded([&] {
        require(plan, "plan");
        plan->visit([&](const auto& planned) { planned.add_forces(displacements, forces); });
    });
}

hybmss_status hybmss_plan_energy(const hybmss_plan* plan, const hybmss_const_field* displacements, double* springs,
                                 double* volume) {
    return guarded([&] {
        require(plan, "plan");
        plan->visit([&](const auto& planned) {
            const PotentialEnergy energy = planned.energy(displacements);
            if (springs) {
                *springs = energy.springs;
            }
            if (volume) {
                *volume = energy.volume;
            }
        });
    });
}

hybmss_status hybmss_plan_add_hessian_product(const hybmss_plan* plan, const hybmss_const_field* displacements,
                                              const hybmss_const_field* direction, const hybmss_field* product) {
    return guarded([&] {
        require(plan, "plan");
        plan->visit([&](const auto& planned) { planned.add_hessian_product(displacements, direction, product); });
    });
}

hybmss_status hybmss_plan_critical_time_step(const hybmss_plan* plan, double* time_step) {
    return guarded([&] {
        require(plan, "plan");
        require(time_step, "time_step");
        plan->visit([&](const auto& planned) { *time_step = planned.plan.critical_time_step(); });
    });
}

hybmss_status hybmss_plan_describe(const hybmss_plan* plan, char* text, size_t capacity, size_t* length) {
    return guarded([&] {
        require(plan, "plan");
        require(text, "text", capacity);
        std::string description;
        plan->visit([&](const auto& planned) { description = to_string(planned.plan.describe()); });
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
