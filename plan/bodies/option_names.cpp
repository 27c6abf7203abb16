#include "hybmss/plan_options.hpp"

#include <stdexcept>
#include <string>
#include <utility>

namespace hybmss {
namespace {

constexpr std::pair<Effort, std::string_view> kEfforts[] = {
    {Effort::estimate, "estimate"}, {Effort::measure, "measure"}, {Effort::stored, "stored"}};
constexpr std::pair<Accuracy, std::string_view> kAccuracies[] = {
    {Accuracy::fast, "fast"}, {Accuracy::accurate, "accurate"}, {Accuracy::exact, "exact"}};

template <class Value, std::size_t count>
std::string_view name_in(const std::pair<Value, std::string_view> (&list)[count], Value value) {
    for (const auto& [known, text] : list) {
        if (known == value) {
            return text;
        }
    }
    return "unknown";
}

template <class Value, std::size_t count>
Value parse_in(const std::pair<Value, std::string_view> (&list)[count], const char* what, std::string_view text) {
    std::string allowed;
    for (const auto& [value, known] : list) {
        if (known == text) {
            return value;
        }
        allowed += (allowed.empty() ? "" : ", ") + std::string(known);
    }
    throw std::invalid_argument(std::string(what) + " \"" + std::string(text) + "\" is not known: it must be one of " +
                                allowed);
}

} // namespace

std::string_view name(Effort effort) {
    return name_in(kEfforts, effort);
}
Effort parse_effort(std::string_view text) {
    return parse_in(kEfforts, "effort", text);
}

std::string_view name(Accuracy accuracy) {
    return name_in(kAccuracies, accuracy);
}
Accuracy parse_accuracy(std::string_view text) {
    return parse_in(kAccuracies, "accuracy", text);
}

std::string_view name(Precision precision) {
    return precision == Precision::float32 ? "float" : "double";
}

Precision parse_precision(std::string_view text) {
    if (text == "float") {
        return Precision::float32;
    }
    if (text == "double") {
        return Precision::float64;
    }
    throw std::invalid_argument("precision = \"" + std::string(text) + "\" is not known: it must be float or double");
}

} // namespace hybmss
