// `hybmss verify --quick` by itself, where the program of all commands is not built (scripts/windows).

#include "app/verify/verify.hpp"

#include <exception>
#include <iostream>

int main() {
    try {
        hybmss::verify::MatrixOptions options;
        options.extent = hybmss::verify::Extent::quick;
        const hybmss::verify::RowTable table = hybmss::verify::run_matrix(options);
        hybmss::verify::print_summary(table, std::cout);
        return hybmss::verify::all_passed(table) ? 0 : 1;
    } catch (const std::exception& error) {
        std::cerr << "hybmss verify: error: " << error.what() << '\n';
        return 1;
    }
}
