#include "studies/calculix/result_file.hpp"

#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

namespace hybmss::calculix {

std::vector<std::array<double, 3>> read_node_table(const std::filesystem::path& path, std::string_view heading,
                                                   std::size_t nodes) {
    std::ifstream in(path);
    std::vector<std::array<double, 3>> table;
    bool inside = false;
    for (std::string line; std::getline(in, line);) {
        std::istringstream numbers(line);
        if (line.find(" time ") != std::string::npos) {
            inside = line.find(heading) < 2;
            if (inside) {
                table.assign(nodes, {0, 0, 0}); // a later increment replaces an earlier one
            }
            continue;
        }
        long node = 0;
        std::array<double, 3> v{};
        if (inside && numbers >> node >> v[0] >> v[1] >> v[2]) {
            if (node < 1 || static_cast<std::size_t>(node) > nodes) {
                throw std::runtime_error("CalculiX: " + path.filename().string() + " speaks of node " +
                                         std::to_string(node) + " of " + std::to_string(nodes));
            }
            table[static_cast<std::size_t>(node) - 1] = v;
        }
    }
    if (table.empty()) {
        throw std::runtime_error("CalculiX: " + path.filename().string() + " holds no " + std::string(heading));
    }
    return table;
}

/// A line an increment: step, increment, attempt, iterations, times.
int read_iterations(const std::filesystem::path& path) {
    std::ifstream in(path);
    int sum = 0;
    for (std::string line; std::getline(in, line);) {
        std::istringstream numbers(line);
        int step = 0, increment = 0, attempt = 0, iterations = 0;
        if (numbers >> step >> increment >> attempt >> iterations) {
            sum += iterations;
        }
    }
    return sum;
}

std::string read_complaint(const std::filesystem::path& path) {
    std::ifstream in(path);
    for (std::string line; std::getline(in, line);) {
        if (const auto at = line.find("*ERROR"); at != std::string::npos) {
            return line.substr(at);
        }
    }
    return "";
}

} // namespace hybmss::calculix
