#pragma once

/// \file
/// What a refused argument says.

#include <gtest/gtest.h>

#include <initializer_list>
#include <stdexcept>
#include <string>

namespace hybmss::testing {

/// The message of the std::invalid_argument that the call throws; "" where it throws none.
template <class Call>
std::string refusal(Call call) {
    try {
        call();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

/// The call throws std::invalid_argument with a single-line message that holds all of `parts`.
template <class Call>
void expect_refusal(Call call, std::initializer_list<const char*> parts) {
    const std::string message = refusal(call);
    EXPECT_NE(message, "") << "nothing was refused";
    for (const char* part : parts) {
        EXPECT_NE(message.find(part), std::string::npos) << '"' << message << "\" lacks \"" << part << '"';
    }
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
}

} // namespace hybmss::testing
