#include "app/command_line.hpp"
#include "app/plan_arguments.hpp"
#include "layouts/read_file.hpp"
#include "reference/body.hpp"
#include "reference/forces.hpp"
#include "simulation/run/memory.hpp"
#include "simulation/scene/scene_body.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <charconv>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string_view>

namespace {

using namespace hybmss;
using Vector3 = std::array<double, 3>;

struct ForcesArguments {
    std::string scene, displacements, out, kernel;
    bool force = false;
    PlanArguments plan;
};

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlanks = " \t\r";
    const std::size_t first = text.find_first_not_of(kBlanks);
    return first == std::string_view::npos ? std::string_view{}
                                           : text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

/// from_chars knows no leading plus sign, which some programs write.
std::optional<double> number(std::string_view text) {
    text = trimmed(text);
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') {
        text.remove_prefix(1);
    }
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
        return std::nullopt;
    }
    return value;
}

std::vector<std::string_view> fields(std::string_view line) {
    std::vector<std::string_view> all;
    for (std::size_t comma = 0; comma != std::string_view::npos; line.remove_prefix(comma + 1)) {
        comma = line.find(',');
        all.push_back(line.substr(0, comma));
        if (comma == std::string_view::npos) {
            break;
        }
    }
    return all;
}

/// One 3-vector a row, x,y,z. Reads exactly `rows` rows of three finite numbers; a first line without numbers is a
/// header, and empty lines are passed over. Throws std::invalid_argument "FILE:LINE: what is wrong".
std::vector<Vector3> read_vector_csv(const std::string& path, std::size_t rows) {
    constexpr std::size_t kRowBytes = 400; // three numbers with all their digits are far shorter
    std::istringstream file;
    try {
        file.str(read_file(path, Readable::file_or_pipe, kRowBytes * (rows + 10)));
    } catch (const ReadError& error) {
        throw std::invalid_argument(path + ": cannot be read: " + error.reason);
    }
    std::vector<Vector3> values;
    std::string line;
    long line_number = 0;
    const auto fail = [&](const std::string& what) {
        throw std::invalid_argument(path + ":" + std::to_string(line_number) + ": " + what);
    };
    while (std::getline(file, line)) {
        ++line_number;
        if (trimmed(line).empty()) {
            continue;
        }
        const std::vector<std::string_view> texts = fields(line);
        if (line_number == 1 && !number(texts[0])) {
            continue;
        }
        if (texts.size() != 3) {
            fail(std::to_string(texts.size()) + " values; a row has three: x,y,z");
        }
        Vector3& row = values.emplace_back();
        for (std::size_t a = 0; a < 3; ++a) {
            const std::optional<double> value = number(texts[a]);
            if (!value || !std::isfinite(*value)) {
                fail(fmt::format("\"{}\" is not allowed; each value must be a finite number", trimmed(texts[a])));
            }
            row[a] = *value;
        }
        if (values.size() > rows) {
            fail("more rows than the body has nodes; it must be " + std::to_string(rows) + " rows, one a node");
        }
    }
    if (values.size() != rows) {
        fail(std::to_string(values.size()) + " rows; it must be " + std::to_string(rows) + ", one a node");
    }
    return values;
}

/// A header line and a row each, with so many significant digits.
void write_vector_csv(std::ostream& out, std::span<const Vector3> values, int digits) {
    out << "x,y,z\n";
    for (const auto& v : values) {
        out << fmt::format("{:.{}g},{:.{}g},{:.{}g}\n", v[0], digits, v[1], digits, v[2], digits);
    }
}

struct Evaluation {
    std::vector<Vector3> forces;
    double springs = 0, volume = 0;
    nlohmann::ordered_json plan; ///< which kernel it was
};

template <class T>
Evaluation evaluate(const Lattice& lattice, const Material& material, const PlanOptions& options,
                    const std::vector<Vector3>& displacements) {
    const ForcePlan<T> plan(lattice, material, options);
    std::vector<T> u, f(3 * displacements.size(), T(0));
    for (const Vector3& v : displacements) {
        u.insert(u.end(), {static_cast<T>(v[0]), static_cast<T>(v[1]), static_cast<T>(v[2])});
    }
    const auto displacement = VectorField<const T>::aos(u.data(), displacements.size());
    plan.add_forces(displacement, VectorField<T>::aos(f.data(), displacements.size()));
    const PotentialEnergy energy = plan.energy(displacement);
    Evaluation result{{}, energy.springs, energy.volume, {}};
    for (std::size_t n = 0; n < displacements.size(); ++n) {
        result.forces.push_back(
            {static_cast<double>(f[3 * n]), static_cast<double>(f[3 * n + 1]), static_cast<double>(f[3 * n + 2])});
    }
    const PlanDescription description = plan.describe();
    result.plan = {{"kernel", description.kernel},
                   {"layout", description.layout},
                   {"instruction_set", name(description.instruction_set)},
                   {"precision", description.precision},
                   {"threads", description.threads}};
    return result;
}

Evaluation evaluate_reference(const Lattice& lattice, const Material& material,
                              const std::vector<Vector3>& displacements) {
    const reference::Body body = reference::assemble(lattice, material);
    std::vector<reference::Vector3d> u;
    for (const Vector3& v : displacements) {
        u.emplace_back(v[0], v[1], v[2]);
    }
    const reference::Energy energy = reference::energy(body, u);
    Evaluation result{{}, energy.springs, energy.volume, {{"kernel", "reference"}, {"precision", "double"}}};
    for (const reference::Vector3d& f : reference::forces(body, u)) {
        result.forces.push_back({f[0], f[1], f[2]});
    }
    return result;
}

void forces(const ForcesArguments& arguments) {
    SimulationOptions options = arguments.plan.options();
    require_lattice_layout("--kernel", arguments.kernel == "reference" ? "" : arguments.kernel, ", reference");
    options.plan.layout = arguments.kernel == "reference" ? "" : arguments.kernel;
    if (arguments.kernel == "reference" && options.precision == Precision::float32) {
        throw std::invalid_argument("--precision float: the reference kernel computes in double only");
    }
    const auto out =
        open_output("--out", arguments.out, {"x,y,z", {arguments.scene, arguments.displacements}, arguments.force});
    const Scene scene = load_scene(arguments.scene);
    check_size(scene, options, available_bytes());
    const Lattice lattice = scene_lattice(scene);
    const std::size_t nodes = lattice.nodes().size();
    const std::vector<Vector3> displacements = read_vector_csv(arguments.displacements, nodes);

    const Evaluation result = arguments.kernel == "reference"
                                  ? evaluate_reference(lattice, scene.material, displacements)
                              : options.precision == Precision::float32
                                  ? evaluate<float>(lattice, scene.material, options.plan, displacements)
                                  : evaluate<double>(lattice, scene.material, options.plan, displacements);
    double sum = result.springs + result.volume;
    for (const Vector3& f : result.forces) {
        sum += f[0] + f[1] + f[2];
    }
    if (!std::isfinite(sum)) {
        throw std::runtime_error(arguments.displacements + ": the forces at these displacements are not finite in " +
                                 std::string(name(options.precision)));
    }
    if (out) {
        write_vector_csv(out->stream(), result.forces, options.precision == Precision::float32 ? 9 : 17);
        out->commit();
    }
    nlohmann::ordered_json json = {{"energy", {{"springs", result.springs}, {"volume", result.volume}}}};
    json.update(result.plan);
    json["nodes"] = nodes;
    json["springs"] = springs_of(lattice, scene.material).total();
    json["cells"] = lattice.cell_count();
    fmt::print("{}\n", json.dump(2));
}

} // namespace

void add_forces_command(CLI::App& app) {
    const auto arguments = std::make_shared<ForcesArguments>();
    CLI::App* command = app.add_subcommand("forces", "forces and energy of one given state");
    command->add_option("SCENE", arguments->scene, "scene file (TOML); its body and material are used")->required();
    command->add_option("--displacements", arguments->displacements, "CSV file, one row x,y,z a node, m")->required();
    command->add_option("--out", arguments->out, "CSV file for the forces, one row x,y,z a node, N")->check(a_path());
    add_force_option(*command, arguments->force);
    command->add_option("--kernel", arguments->kernel, "a layout's name, or \"reference\" for the scalar one");
    arguments->plan.add_to(*command, false);
    command->callback([arguments] { forces(*arguments); });
}
