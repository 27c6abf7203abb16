#include "bench/calculix.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace hybmss::bench {
namespace {

namespace fs = std::filesystem;

void write_input(const fs::path& path, int edge, double h, double poisson_ratio, double strain) {
    std::ofstream out(path);
    const int row = edge + 1;
    const auto node = [row](int i, int j, int k) { return 1 + i + row * (j + row * k); };
    out << "*NODE,NSET=ALL\n";
    for (int k = 0; k <= edge; ++k) {
        for (int j = 0; j <= edge; ++j) {
            for (int i = 0; i <= edge; ++i) {
                out << node(i, j, k) << ',' << i * h << ',' << j * h << ',' << k * h << '\n';
            }
        }
    }
    out << "*ELEMENT,TYPE=C3D8I,ELSET=SOLID\n";
    int element = 0;
    for (int k = 0; k < edge; ++k) {
        for (int j = 0; j < edge; ++j) {
            for (int i = 0; i < edge; ++i) {
                out << ++element << ',' << node(i, j, k) << ',' << node(i + 1, j, k) << ',' << node(i + 1, j + 1, k)
                    << ',' << node(i, j + 1, k) << ',' << node(i, j, k + 1) << ',' << node(i + 1, j, k + 1) << ','
                    << node(i + 1, j + 1, k + 1) << ',' << node(i, j + 1, k + 1) << '\n';
            }
        }
    }
    for (const auto& [name, j] : {std::pair{"LOW", 0}, std::pair{"HIGH", edge}}) {
        out << "*NSET,NSET=" << name << '\n';
        for (int k = 0; k <= edge; ++k) {
            for (int i = 0; i <= edge; ++i) {
                out << node(i, j, k) << '\n';
            }
        }
    }
    out << "*MATERIAL,NAME=M\n*ELASTIC\n10000.," << poisson_ratio
        << "\n*SOLID SECTION,ELSET=SOLID,MATERIAL=M\n*BOUNDARY\nLOW,1,3\n*STEP,NLGEOM\n*STATIC\n*BOUNDARY\n"
           "HIGH,1,1\nHIGH,3,3\nHIGH,2,2,"
        << -strain * edge * h << "\n*NODE PRINT,NSET=HIGH,TOTALS=ONLY\nRF\n*END STEP\n";
}

/// The last line of three numbers in the result file.
double read_force(const fs::path& path) {
    std::ifstream in(path);
    double force = 0;
    for (std::string line; std::getline(in, line);) {
        std::istringstream numbers(line);
        double x = 0, y = 0, z = 0;
        if (numbers >> x >> y >> z) {
            force = std::max({std::abs(x), std::abs(y), std::abs(z)});
        }
    }
    return force;
}

/// The fourth column of the status file, summed over increments.
int read_iterations(const fs::path& path) {
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

} // namespace

bool has_calculix() {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (!folder.empty() && ::access((folder + "/ccx").c_str(), X_OK) == 0) {
            return true;
        }
    }
    return false;
}

std::optional<CalculixRun> compress_with_calculix(int edge, double cell_size, double poisson_ratio, double strain) {
    std::string folder = (fs::temp_directory_path() / "hybmss-calculix-XXXXXX").string();
    if (::mkdtemp(folder.data()) == nullptr) {
        return std::nullopt;
    }
    write_input(fs::path(folder) / "cube.inp", edge, cell_size, poisson_ratio, strain);
    const std::string command =
        "cd '" + folder + "' && OMP_NUM_THREADS=1 CCX_NPROC_EQUATION_SOLVER=1 ccx cube >ccx.log 2>&1";
    const auto start = std::chrono::steady_clock::now();
    const int status = std::system(command.c_str());
    CalculixRun run;
    run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    run.force = read_force(fs::path(folder) / "cube.dat");
    run.iterations = read_iterations(fs::path(folder) / "cube.sta");
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    return status == 0 && run.force > 0 ? std::optional(run) : std::nullopt;
}

} // namespace hybmss::bench
