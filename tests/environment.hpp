#pragma once

/// \file
/// The environment that a test runs in.

#include <cstdlib>
#include <optional>
#include <string>

namespace hybmss::testing {

/// A variable set for as long as this lives; null: not set. Then it is again what it was.
class Variable {
public:
    Variable(const char* name, const char* value) : name_(name) {
        if (const char* before = std::getenv(name)) {
            before_ = before;
        }
        put(value);
    }
    Variable(const Variable&) = delete;
    Variable& operator=(const Variable&) = delete;
    ~Variable() { put(before_ ? before_->c_str() : nullptr); }

private:
    void put(const char* value) const { value ? ::setenv(name_, value, 1) : ::unsetenv(name_); }

    const char* name_;
    std::optional<std::string> before_;
};

} // namespace hybmss::testing
