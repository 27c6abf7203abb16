#include "studies/calculix/program.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace hybmss::calculix {
namespace {

namespace fs = std::filesystem;

/// Made when it begins to live, removed with all that is in it when it ends.
class ScratchDirectory {
public:
    ScratchDirectory() {
        std::string name = (fs::temp_directory_path() / "hybmss-calculix-XXXXXX").string();
        if (::mkdtemp(name.data()) == nullptr) {
            throw std::runtime_error("CalculiX: cannot make a directory under " + fs::temp_directory_path().string());
        }
        path_ = name;
    }
    ScratchDirectory(const ScratchDirectory&) = delete;
    ScratchDirectory& operator=(const ScratchDirectory&) = delete;
    ~ScratchDirectory() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    const fs::path& path() const { return path_; }

private:
    fs::path path_;
};

/// CalculiX counts the loads on a supported node into its force; here only the support's part is wanted.
void take_loads_off(const Problem& problem, std::vector<std::array<double, 3>>& forces) {
    const BrickMesh& mesh = problem.mesh;
    const double mass = problem.material.density * mesh.cell_size * mesh.cell_size * mesh.cell_size;
    const std::size_t width = mesh.nodes_per_element();
    for (std::size_t n = 0; n < mesh.elements.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            forces[mesh.elements[n]][a] -= mass * mesh.weight_share(n % width) * problem.loading.acceleration[a];
        }
    }
    for (std::size_t n = 0; n < problem.loading.forces.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            forces[n][a] -= problem.loading.forces[n][a];
        }
    }
}

/// Zero wherever nothing is held.
std::vector<std::array<double, 3>> support_part(const Problem& problem,
                                                const std::vector<std::array<double, 3>>& forces) {
    std::vector<std::array<double, 3>> support(forces.size(), {0, 0, 0});
    for (const PrescribedNode& held : problem.loading.supports) {
        for (std::size_t a = 0; a < 3; ++a) {
            if (held.axes >> a & 1) {
                support[held.node][a] = forces[held.node][a];
            }
        }
    }
    return support;
}

} // namespace

bool is_installed() {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (!folder.empty() && ::access((folder + "/ccx").c_str(), X_OK) == 0) {
            return true;
        }
    }
    return false;
}

std::string version() {
    if (!is_installed()) {
        return "";
    }
    std::string text;
    if (std::FILE* pipe = ::popen("ccx -v 2>/dev/null", "r")) {
        char buffer[256];
        while (std::fgets(buffer, sizeof buffer, pipe) != nullptr) {
            text += buffer;
        }
        ::pclose(pipe);
    }
    const auto at = text.find("ersion ");
    std::string found;
    std::istringstream(at == std::string::npos ? "" : text.substr(at + 7)) >> found;
    return found;
}

namespace {

/// Runs the program on a deck in the directory; its seconds.
double run(const Problem& problem, int frequencies, const fs::path& path) {
    if (!is_installed()) {
        throw std::runtime_error(kNotInstalled);
    }
    {
        std::ofstream deck(path / "body.inp");
        write_deck(problem, deck, frequencies);
        if (!deck.flush()) {
            throw std::runtime_error("CalculiX: cannot write its input under " + path.parent_path().string());
        }
    }
    const std::string command =
        "cd '" + path.string() + "' && OMP_NUM_THREADS=1 CCX_NPROC_EQUATION_SOLVER=1 ccx body >ccx.log 2>&1";
    const auto start = std::chrono::steady_clock::now();
    const int status = std::system(command.c_str());
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    // It may complain and still end with 0.
    const std::string complaint = read_complaint(path / "ccx.log");
    if (status != 0 || !complaint.empty()) {
        throw std::runtime_error(complaint.empty() ? "CalculiX failed"
                                                   : std::string("CalculiX failed: ").append(complaint));
    }
    return taken.count();
}

} // namespace

std::vector<double> frequencies(const Problem& problem, int count) {
    const ScratchDirectory directory;
    run(problem, count, directory.path());
    return read_frequencies(directory.path() / "body.dat");
}

Solution solve(const Problem& problem) {
    const ScratchDirectory directory;
    const fs::path& path = directory.path();
    Solution solution;
    solution.seconds = run(problem, 0, path);
    solution.iterations = read_iterations(path / "body.sta");
    solution.displacements = read_node_table(path / "body.dat", "displacements", problem.mesh.rest.size());
    if (!problem.loading.supports.empty()) {
        auto forces = read_node_table(path / "body.dat", "forces", problem.mesh.rest.size());
        take_loads_off(problem, forces);
        solution.support = support_part(problem, forces);
    } else {
        solution.support.assign(problem.mesh.rest.size(), {0, 0, 0});
    }
    if (problem.stresses) {
        solution.stresses = read_stresses(path / "body.dat", problem.mesh.element_count());
    }
    return solution;
}

} // namespace hybmss::calculix
