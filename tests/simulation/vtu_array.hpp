#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace hybmss::test {

/// The appended array `name` of a .vtu file.
template <class T>
std::vector<T> vtu_array(const std::string& vtu, const std::string& name) {
    const std::size_t declared = vtu.find("Name=\"" + name + "\"");
    EXPECT_NE(declared, std::string::npos) << name;
    const std::size_t offset_at = vtu.find("offset=\"", declared) + 8;
    const std::size_t offset = std::stoul(vtu.substr(offset_at));
    const char* const kStart = "<AppendedData encoding=\"raw\">\n_";
    const char* data = vtu.data() + vtu.find(kStart) + std::strlen(kStart) + offset;
    std::uint64_t bytes = 0;
    std::memcpy(&bytes, data, sizeof bytes);
    std::vector<T> values(bytes / sizeof(T));
    std::memcpy(values.data(), data + sizeof bytes, bytes);
    return values;
}

} // namespace hybmss::test
