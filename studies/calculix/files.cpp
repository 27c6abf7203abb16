#include "studies/calculix/program.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

namespace hybmss::calculix {
namespace {

/// CalculiX reads at most 20 characters of a number: 13 digits always fit.
std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.12e", value);
    return text;
}

void write_mesh(const BrickMesh& mesh, std::ostream& out) {
    out << "*NODE,NSET=ALL\n";
    for (std::size_t n = 0; n < mesh.rest.size(); ++n) {
        const auto& x = mesh.rest[n];
        out << n + 1 << ',' << number(x[0]) << ',' << number(x[1]) << ',' << number(x[2]) << '\n';
    }
    std::map<float, std::vector<std::size_t>> by_scale;
    for (std::size_t e = 0; e < mesh.element_count(); ++e) {
        by_scale[mesh.scales[e]].push_back(e);
    }
    const std::size_t width = mesh.nodes_per_element();
    int part = 0;
    for (const auto& [scale, elements] : by_scale) {
        out << "*ELEMENT,TYPE=" << name(mesh.type) << ",ELSET=PART" << ++part << '\n';
        for (const std::size_t e : elements) {
            out << e + 1;
            for (std::size_t i = 0; i < width; ++i) {
                // A line holds at most 16 entries; the comma at its end says that the next one goes on.
                out << (i == 15 ? ",\n" : ",") << mesh.elements[e * width + i] + 1;
            }
            out << '\n';
        }
    }
}

/// E and nu; or C10 = G/2 and D1 = 2/K.
void write_law(const Problem& problem, double young_modulus, std::ostream& out) {
    const double nu = problem.material.poisson_ratio;
    if (problem.law == Law::linear) {
        out << "*ELASTIC\n" << number(young_modulus) << ',' << number(nu) << '\n';
    } else {
        out << "*HYPERELASTIC,NEO HOOKE\n"
            << number(young_modulus / (4 * (1 + nu))) << ',' << number(6 * (1 - 2 * nu) / young_modulus) << '\n';
    }
}

void write_materials(const Problem& problem, std::ostream& out) {
    const std::set<float> scales(problem.mesh.scales.begin(), problem.mesh.scales.end());
    int part = 0;
    for (const float scale : scales) {
        ++part;
        out << "*MATERIAL,NAME=MATERIAL" << part << '\n';
        write_law(problem, problem.material.young_modulus * static_cast<double>(scale), out);
        out << "*DENSITY\n"
            << number(problem.material.density) << "\n*SOLID SECTION,ELSET=PART" << part << ",MATERIAL=MATERIAL" << part
            << '\n';
    }
}

void write_supports(const Loading& loading, std::ostream& out) {
    if (loading.supports.empty()) {
        return;
    }
    out << "*BOUNDARY\n";
    for (const PrescribedNode& held : loading.supports) {
        for (std::size_t a = 0; a < 3; ++a) {
            if (held.axes >> a & 1) {
                out << held.node + 1 << ',' << a + 1 << ',' << a + 1 << ',' << number(held.displacement[a]) << '\n';
            }
        }
    }
}

void write_loads(const Problem& problem, std::ostream& out) {
    const Loading& loading = problem.loading;
    bool open = false;
    for (std::size_t n = 0; n < loading.forces.size(); ++n) {
        for (std::size_t a = 0; a < 3; ++a) {
            if (loading.forces[n][a] != 0) {
                out << (open ? "" : "*CLOAD\n") << n + 1 << ',' << a + 1 << ',' << number(loading.forces[n][a]) << '\n';
                open = true;
            }
        }
    }
    const auto& g = loading.acceleration;
    const double size = std::hypot(g[0], g[1], g[2]);
    if (size > 0) {
        out << "*DLOAD\nSOLID,GRAV," << number(size) << ',' << number(g[0] / size) << ',' << number(g[1] / size) << ','
            << number(g[2] / size) << '\n';
    }
}

} // namespace

std::string_view name(Geometry geometry) {
    return geometry == Geometry::linear ? "linear" : "NLGEOM";
}

void write_deck(const Problem& problem, std::ostream& out, int frequencies) {
    write_mesh(problem.mesh, out);
    out << "*ELSET,ELSET=SOLID,GENERATE\n1," << problem.mesh.element_count() << '\n';
    out << "*NSET,NSET=HELD\n";
    for (const PrescribedNode& held : problem.loading.supports) {
        out << held.node + 1 << '\n';
    }
    write_materials(problem, out);
    if (frequencies > 0) {
        write_supports(problem.loading, out);
        out << "*STEP\n*FREQUENCY\n" << frequencies << "\n*END STEP\n";
        return;
    }
    out << (problem.geometry == Geometry::nonlinear ? "*STEP,NLGEOM,INC=1000\n" : "*STEP\n") << "*STATIC\n";
    write_supports(problem.loading, out);
    write_loads(problem, out);
    out << "*NODE PRINT,NSET=ALL,FREQUENCY=100000\nU\n*NODE PRINT,NSET=HELD,FREQUENCY=100000\nRF\n"
        << (problem.stresses ? "*EL PRINT,ELSET=SOLID,FREQUENCY=100000\nS\n" : "") << "*END STEP\n";
}

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

/// A line a point of integration: element, point, and the stress as xx, yy, zz, xy, xz, yz.
std::vector<std::array<double, 6>> read_stresses(const std::filesystem::path& path, std::size_t elements) {
    constexpr std::size_t kPlace[6] = {0, 1, 2, 3, 5, 4};
    std::ifstream in(path);
    std::vector<std::array<double, 6>> sums;
    std::vector<int> points;
    bool inside = false;
    for (std::string line; std::getline(in, line);) {
        if (line.find(" time ") != std::string::npos) {
            inside = line.find("stresses") < 2;
            if (inside) {
                sums.assign(elements, {});
                points.assign(elements, 0);
            }
            continue;
        }
        std::istringstream numbers(line);
        long element = 0, point = 0;
        std::array<double, 6> s{};
        if (inside && numbers >> element >> point >> s[0] >> s[1] >> s[2] >> s[3] >> s[4] >> s[5]) {
            if (element < 1 || static_cast<std::size_t>(element) > elements) {
                throw std::runtime_error("CalculiX: " + path.filename().string() + " speaks of element " +
                                         std::to_string(element) + " of " + std::to_string(elements));
            }
            const auto e = static_cast<std::size_t>(element) - 1;
            ++points[e];
            for (std::size_t c = 0; c < 6; ++c) {
                sums[e][kPlace[c]] += s[c];
            }
        }
    }
    for (std::size_t e = 0; e < elements; ++e) {
        if (points.empty() || points[e] == 0) {
            throw std::runtime_error("CalculiX: " + path.filename().string() + " holds no stresses of element " +
                                     std::to_string(e + 1));
        }
        for (double& s : sums[e]) {
            s /= points[e];
        }
    }
    return sums;
}

/// A line a mode: its number, omega^2, omega, omega / 2 pi, and what is imaginary of omega.
std::vector<double> read_frequencies(const std::filesystem::path& path) {
    std::ifstream in(path);
    std::vector<double> all;
    for (std::string line; std::getline(in, line) && line.find("P A R T I C") == std::string::npos;) {
        std::istringstream numbers(line);
        int mode = 0;
        double eigenvalue = 0, omega = 0, frequency = 0, imaginary = 0;
        if (numbers >> mode >> eigenvalue >> omega >> frequency >> imaginary) {
            all.push_back(frequency);
        }
    }
    if (all.empty()) {
        throw std::runtime_error("CalculiX: " + path.filename().string() + " holds no frequencies");
    }
    std::erase_if(all, [greatest = all.back()](double frequency) { return frequency < 1e-3 * greatest; });
    return all;
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
