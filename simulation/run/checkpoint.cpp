#include "simulation/run/checkpoint.hpp"

#include "hybmss/version.hpp"
#include "layouts/read_file.hpp"
#include "plan/tuning/digest.hpp"
#include "simulation/results/atomic_file.hpp"
#include "simulation/run/simulation_implementation.hpp"

#include <algorithm>
#include <ostream>
#include <stdexcept>
#include <string_view>

namespace hybmss {
namespace {

// magic | number of sections | for each: length of name, name, length, bytes | digest of all that
// Integers are 64 bits in the machine's order: on one of the other order the number of sections is absurd.
constexpr std::string_view kMagic = "hybmss checkpoint 1\n";

class Writer {
public:
    explicit Writer(std::ostream& out) : out_(out) {}
    void write(std::string_view bytes) {
        digest_.add(bytes);
        out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }
    void write(std::uint64_t number) { write({reinterpret_cast<const char*>(&number), sizeof number}); }
    std::uint64_t digest() const { return digest_.value(); }

private:
    std::ostream& out_;
    Digest digest_;
};

class Reader {
public:
    explicit Reader(std::string_view rest) : rest_(rest) {}
    std::string_view bytes(std::uint64_t count) {
        if (count > rest_.size()) {
            throw std::runtime_error("it is cut short or damaged");
        }
        const std::string_view taken = rest_.substr(0, static_cast<std::size_t>(count));
        rest_.remove_prefix(taken.size());
        return taken;
    }
    std::uint64_t number() {
        std::uint64_t value = 0;
        std::memcpy(&value, bytes(sizeof value).data(), sizeof value);
        return value;
    }

private:
    std::string_view rest_;
};

void require_version(const CheckpointSections& sections) {
    if (const std::string& version = sections.text("version"); version != kVersion) {
        throw std::runtime_error("it was written by hybmss " + version + ", this is " + std::string(kVersion) +
                                 ": only the same version goes on with the same bits");
    }
}

bool one_tile_in(const CheckpointSections& sections) {
    if (sections.has("one_tile")) {
        return sections.values<std::uint64_t>("one_tile", 1)[0] != 0;
    }
    // An older one may tell of a size of tiles or of an integration that were asked for.
    if (sections.values<std::uint64_t>("tile_nodes", 1)[0] != 0 || sections.text("integration") == "split") {
        throw std::runtime_error("it goes on in tiles of another size, or with split integration, which are no more");
    }
    return false;
}

/// A surface file may be moved in space, and the cells made from it are the same.
void require_origin(const CheckpointSections& sections, const SceneBody& body) {
    if (!sections.has("origin")) {
        if (body.origin != std::array<double, 3>{0, 0, 0}) {
            throw std::runtime_error("it is an older one, which does not tell where the body lies");
        }
        return;
    }
    const std::vector<double> origin = sections.values<double>("origin", 3);
    if (!std::equal(origin.begin(), origin.end(), body.origin.begin())) {
        throw std::runtime_error("it belongs to a body that lies elsewhere: " + body.surface +
                                 " was moved since it was written");
    }
}

// A digest guards against damage, not against a file that was made wrong: no number may lead out of an array.

std::vector<std::uint32_t> removed_cells(const CheckpointSections& sections, std::size_t cells) {
    std::vector<std::uint32_t> removed = sections.values<std::uint32_t>("removed");
    for (const std::uint32_t cell : removed) {
        if (cell >= cells) {
            throw std::runtime_error("its removed cell " + std::to_string(cell) + " is none of the body's " +
                                     std::to_string(cells));
        }
    }
    return removed;
}

/// Of each cut; a scene has at most 1e9.
std::vector<double> bites_done(const CheckpointSections& sections, std::size_t cuts) {
    std::vector<double> done = sections.values<double>("bites", cuts);
    for (const double bites : done) {
        if (!(bites >= 0 && bites <= 2e9)) {
            throw std::runtime_error("its section \"bites\" counts " + std::to_string(bites));
        }
    }
    return done;
}

/// Steps, outputs, files, Newton and conjugate gradient iterations: counted on, so far from what a number can hold.
/// -1: no file yet.
std::vector<std::int64_t> counts_of_run(const CheckpointSections& sections) {
    constexpr std::int64_t kMost = std::int64_t{1} << 53;
    std::vector<std::int64_t> counts = sections.values<std::int64_t>("run", 5);
    for (const std::int64_t count : counts) {
        if (count < -1 || count > kMost) {
            throw std::runtime_error("its section \"run\" counts " + std::to_string(count));
        }
    }
    return counts;
}

} // namespace

const std::string& CheckpointSections::text(const std::string& name) const {
    const auto found = sections_.find(name);
    if (found == sections_.end()) {
        throw std::runtime_error("it has no section \"" + name + "\"");
    }
    return found->second;
}

void write_checkpoint_file(const std::filesystem::path& path, const CheckpointSections& sections) {
    AtomicFile file(path);
    Writer writer(file.stream());
    writer.write(kMagic);
    writer.write(sections.all().size());
    for (const auto& [name, bytes] : sections.all()) {
        writer.write(name.size());
        writer.write(name);
        writer.write(bytes.size());
        writer.write(bytes);
    }
    writer.write(writer.digest());
    file.commit();
}

CheckpointSections read_checkpoint_file(const std::filesystem::path& path) {
    constexpr std::uintmax_t kMostBytes = 200'000'000'000; // 1e9 nodes take less
    const std::string content = read_file(path, Readable::regular_file, kMostBytes);
    if (!content.starts_with(kMagic.substr(0, content.size()))) {
        throw std::runtime_error("it is no checkpoint of hybmss, or one of another format");
    }
    std::uint64_t digest = 0;
    if (content.size() < kMagic.size() + sizeof digest) {
        throw std::runtime_error("it is cut short or damaged");
    }
    const std::string_view body(content.data(), content.size() - sizeof digest);
    std::memcpy(&digest, content.data() + body.size(), sizeof digest);
    Digest found;
    found.add(body);
    if (found.value() != digest) {
        throw std::runtime_error("it is cut short or damaged: its bytes do not match its digest");
    }
    Reader reader(body.substr(kMagic.size()));
    CheckpointSections sections;
    for (std::uint64_t left = reader.number(); left > 0; --left) {
        std::string name(reader.bytes(reader.number()));
        sections.put(name, std::string(reader.bytes(reader.number())));
    }
    return sections;
}

/// Of what the scene says and of the body made from it: files that it names may have changed.
std::uint64_t Simulation::Implementation::scene_digest() const {
    std::vector<float> scales(lattice.cell_scales().begin(), lattice.cell_scales().end());
    for (const RemovedCell& cell : removed) {
        scales[cell.cell] = cell.scale;
    }
    Digest digest;
    digest.add(scene.source.canonical);
    digest.add(std::span<const int>(lattice.cells()));
    digest.add(std::span<const float>(scales));
    const double numbers[] = {lattice.cell_size(), time_step, scene.solver.duration};
    digest.add(std::span<const double>(numbers));
    if (other) {
        for (const Vector3& x : other->network.rest_positions) {
            digest.add(std::span<const double>(x));
        }
        for (const Network::Spring& spring : other->network.springs) {
            digest.add(std::span(&spring.stiffness, 1));
        }
    }
    return digest.value();
}

void Simulation::write_checkpoint(const std::string& path, const std::string& attached) const {
    const Implementation& body = *implementation_;
    if (body.is_static()) {
        throw std::logic_error("a static scene has no time to go on from: no checkpoint");
    }
    CheckpointSections sections;
    sections.put("version", std::string(kVersion));
    const std::uint64_t digest = body.scene_digest();
    sections.put("scene", std::span(&digest, 1));
    const PlanDescription plan = describe();
    // Not in the digest: so those of bodies that begin at the origin are the same as before.
    sections.put("origin", std::span<const double>(body.scene.body.origin));
    sections.put("precision", plan.precision);
    sections.put("instruction_set", std::string(name(plan.choice.instruction_set)));
    sections.put("layout", plan.layout);
    sections.put("accuracy", std::string(name(plan.choice.accuracy)));
    sections.put("one_tile", std::vector<std::uint64_t>{plan.choice.one_tile});
    sections.put("run", std::vector<std::int64_t>{body.steps, body.outputs, body.written, body.work.newton_iterations,
                                                  body.work.cg_iterations});
    sections.put("preconditioner", body.work.preconditioner);
    std::vector<std::uint32_t> removed;
    for (const auto& cell : body.removed) {
        removed.push_back(cell.cell);
    }
    sections.put("removed", removed);
    sections.put("removed_energy", std::span(&body.removed_energy, 1));
    sections.put("bites", body.schedule.done());
    std::visit([&](const auto& d) { sections.put("state", d.exact_state()); }, body.dynamics);
    sections.put("effects", effect_memory_of(body.dynamics));
    sections.put("meter", body.meter ? body.meter->memory() : std::vector<double>());
    if (body.parted) {
        std::vector<std::uint32_t> faces;
        for (const auto& face : body.parted->faces) {
            faces.insert(faces.end(), face.begin(), face.end());
        }
        sections.put("parted", faces);
        sections.put("parting_energy", std::span(&body.parted->energy, 1));
    }
    sections.put("attached", attached);
    write_checkpoint_file(path, sections);
}

Simulation Simulation::restarted(Scene scene, const SimulationOptions& options, const std::string& path,
                                 std::string* attached) {
    const auto refused = [&](const std::exception& error) {
        return std::invalid_argument("checkpoint " + path + ": " + one_line(error.what()));
    };
    try {
        if (timeless(scene.solver.method)) {
            throw std::runtime_error("a static scene has no time to go on from");
        }
        const CheckpointSections sections = read_checkpoint_file(path);
        require_version(sections);
        SimulationOptions same = options;
        same.precision = parse_precision(sections.text("precision"));
        same.plan.instruction_set = parse_instruction_set(sections.text("instruction_set"));
        same.plan.layout = sections.text("layout");
        same.plan.accuracy = parse_accuracy(sections.text("accuracy"));
        same.plan.one_tile = one_tile_in(sections);
        same.plan.effort = Effort::estimate;
        same.plan.wisdom = nullptr;

        Simulation simulation(std::move(scene), same);
        Implementation& body = *simulation.implementation_;
        if (sections.values<std::uint64_t>("scene", 1)[0] != body.scene_digest()) {
            throw std::runtime_error("it belongs to another scene, or to this one before it was changed");
        }
        require_origin(sections, body.scene.body);
        const std::vector<std::int64_t> run = counts_of_run(sections);
        body.steps = run[0];
        body.outputs = run[1];
        body.written = run[2];
        body.work.newton_iterations = run[3];
        body.work.cg_iterations = run[4];
        body.work.preconditioner = sections.text("preconditioner");
        body.cut_again(removed_cells(sections, body.lattice.cell_scales().size()));
        if (body.parted) {
            const auto cells = sections.values<std::uint32_t>("parted");
            std::vector<std::array<std::uint32_t, 2>> faces(cells.size() / 2);
            for (std::size_t f = 0; f < faces.size(); ++f) {
                faces[f] = {cells[2 * f], cells[2 * f + 1]};
            }
            if (!faces.empty()) {
                body.part(std::move(faces), same);
            }
            body.parted->energy = sections.values<double>("parting_energy", 1)[0];
        }
        body.removed_energy = sections.values<double>("removed_energy", 1)[0];
        body.schedule.set_done(bites_done(sections, body.schedule.done().size()));
        body.prescribe();
        std::visit([&]<class Dynamics>(
                       Dynamics& d) { d.set_exact_state(sections.values<typename Dynamics::Scalar>("state")); },
                   body.dynamics);
        set_effect_memory(body.dynamics, sections.values<double>("effects"));
        if (body.meter) {
            body.meter->set_memory(sections.values<double>("meter"), body.metered_state());
        }
        body.continued = true;
        if (attached) {
            *attached = sections.text("attached");
        }
        return simulation;
    } catch (const SceneError&) {
        throw;
    } catch (const std::invalid_argument& error) { // a word that names no layout, no instruction set
        throw refused(error);
    } catch (const std::runtime_error& error) {
        throw refused(error);
    }
}

} // namespace hybmss
