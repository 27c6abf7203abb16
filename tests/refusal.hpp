#pragma once

/// \file
/// What a refused argument says.

#include <gtest/gtest.h>

#include <initializer_list>
#include <stdexcept>
#include <string>

namespace hybmss::testing {

/// The call throws std::invalid_argument with a single-line message that holds all of `parts`.
template <class Call>
void expect_refusal(Call call, std::initializer_list<const char*> parts) {
    try {
        call();
    } catch (const std::invalid_argument& error) {
        const std::string message = error.what();
        for (const char* part : parts) {
            EXPECT_NE(message.find(part), std::string::npos) << '"' << message << "\" lacks \"" << part << '"';
        }
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        return;
    }
    ADD_FAILURE() << "nothing was refused";
}

} // namespace hybmss::testing
