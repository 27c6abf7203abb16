#include "bindings/c/options.hpp"

#include "bindings/c/status.hpp"
#include "hybmss/allocator.hpp"

#include <stdexcept>
#include <string>

namespace hybmss::c_interface {
namespace {

bool truth(int value, const char* name) {
    if (value != 0 && value != 1) {
        throw std::invalid_argument(std::string(name) + " = " + std::to_string(value) +
                                    " is not allowed: it must be 0 or 1");
    }
    return value == 1;
}

Accuracy given_accuracy(hybmss_accuracy accuracy) {
    switch (accuracy) {
    case HYBMSS_ACCURATE:
        return Accuracy::accurate;
    case HYBMSS_EXACT:
        return Accuracy::exact;
    case HYBMSS_FAST:
        return Accuracy::fast;
    }
    throw std::invalid_argument("accuracy = " + std::to_string(accuracy) +
                                " is not allowed: it must be 0 (HYBMSS_ACCURATE), 1 (HYBMSS_EXACT) or 2 (HYBMSS_FAST)");
}

} // namespace

GivenOptions::GivenOptions(const hybmss_plan_options* given) {
    if (!given) {
        return;
    }
    if (given->instruction_set) {
        options.instruction_set = parse_instruction_set(given->instruction_set);
    }
    options.layout = given->layout ? given->layout : "";
    options.accuracy = given_accuracy(given->accuracy);
    options.threads = given->threads;
    options.effort = truth(given->measure, "measure") ? Effort::measure : Effort::estimate;
    if (given->task_runner) {
        runner = {given->task_runner->threads, given->task_runner->enqueue, given->task_runner->finish,
                  given->task_runner->user};
        options.task_runner = &runner;
    }
}

bool is_double(hybmss_precision precision, const char* name) {
    if (precision != HYBMSS_FLOAT && precision != HYBMSS_DOUBLE) {
        throw std::invalid_argument(std::string(name) + " = " + std::to_string(precision) +
                                    " is not allowed: it must be 0 (HYBMSS_FLOAT) or 1 (HYBMSS_DOUBLE)");
    }
    return precision == HYBMSS_DOUBLE;
}

} // namespace hybmss::c_interface

extern "C" {

hybmss_plan_options hybmss_default_plan_options(void) {
    return {nullptr, nullptr, HYBMSS_ACCURATE, 0, 0, nullptr};
}

hybmss_status hybmss_set_allocator(const hybmss_allocator* allocator) {
    return hybmss::c_interface::guarded([&] {
        hybmss::set_allocator(allocator ? hybmss::Allocator{allocator->allocate, allocator->release, allocator->user}
                                        : hybmss::Allocator{});
    });
}

} // extern "C"
