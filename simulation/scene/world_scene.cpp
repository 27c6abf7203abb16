// Scenes of several bodies: each is read as a scene of its own, of what names it and what all share.

#include "hybmss/simulation/world_scene.hpp"

#include "simulation/scene/other_cells.hpp"
#include "simulation/scene/scene_body.hpp"
#include "simulation/scene/scene_shapes.hpp"

#include <algorithm>
#include <set>
#include <utility>

namespace hybmss {
namespace scene_format {
namespace {

/// "a, b and c" of bodies' names.
std::string names_of(const std::vector<NamedScene>& bodies) {
    std::string list;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        list.append(b == 0 ? "" : b + 1 == bodies.size() ? " and " : ", ").append(bodies[b].name);
    }
    return list;
}

struct NamesFormat {
    static constexpr std::string_view kType = "strings";
    static std::vector<std::string> read(const Given& given) {
        std::vector<std::string> names;
        for (const SceneValue& item : given.as<SceneValue::Array>()) {
            const auto* name = item.as<std::string>();
            if (name == nullptr) {
                given.refuse();
            }
            names.push_back(*name);
        }
        return names;
    }
    static void check(const Check&, const std::vector<std::string>&) {}
    static SceneValue write(const std::vector<std::string>& names, const Range&) {
        SceneValue::Array items;
        for (const std::string& name : names) {
            items.push_back({name});
        }
        return {std::move(items)};
    }
};

// -- What a [[body]] has besides the keys of [body]

struct BodyTitle {
    std::string name;
};
constexpr Key<BodyTitle> kTitleKeys[] = {
    {"name", "", words("letters, digits, _ and -; different for each body"), "required",
     "its name in the results, and what `body = \"name\"` of other tables means",
     member_as<NameFormat, &BodyTitle::name>},
};
void relate_title(const TableCheck& table, const BodyTitle& title) {
    if (title.name.empty()) {
        table.not_allowed("name");
    }
}
constexpr KeyTable<BodyTitle> kTitle = {
    "body",
    "In place of [body] where there are several bodies, one for each. Besides the keys of [body], and a table "
    "[body.material] that stands for [material]:",
    kTitleKeys, nullptr, relate_title};

// -- [[contact]]

constexpr Key<SceneContact> kContactKeys[] = {
    {"between", "", words("a list of names of bodies, each once"), "required", "every one touches the others",
     member_as<NamesFormat, &SceneContact::between>},
    {"self", "", words("true or false"), "false", "each of them touches itself, but for the cells next to a node",
     member<&SceneContact::self>},
    {"friction", "", kFrom0To1e6, "0", "Coulomb's coefficient", member<&SceneContact::friction>},
    {"stiffness", "1/s^2", kFrom0, "0: 16 over the square of the smaller critical time step",
     "a node at the depth p is pushed by m stiffness p, m the mass that node and cell have against each other",
     member<&SceneContact::stiffness>},
};

void relate_contact(const TableCheck& table, const SceneContact& contact) {
    const std::set<std::string> different(contact.between.begin(), contact.between.end());
    if (different.size() != contact.between.size()) {
        table.not_allowed("between");
    }
    if (contact.between.size() < (contact.self ? 1 : 2)) {
        table.refuse("between", "a body alone touches nothing, unless self = true; two or more must be named");
    }
}

constexpr KeyTable<SceneContact> kContact = {"contact", "Bodies of [[body]] that touch each other or themselves.",
                                             kContactKeys, nullptr, relate_contact};

// -- [[attach]]

constexpr Key<SceneAttachment::Nodes> kFromKeys[] = {
    {"body", "", words("the name of a [[body]]"), "required", "whose nodes", member<&SceneAttachment::Nodes::body>},
    {"where", "", kRegion, "required", "the nodes, each with a tie of its own", member<&SceneAttachment::Nodes::where>},
};
constexpr KeyTable<SceneAttachment::Nodes> kFrom = {"attach.from", "The value of `from`.", kFromKeys};

constexpr Key<SceneAttachment::Target> kToKeys[] = {
    {"body", "", words("the name of a [[body]]"), "none: a place in space",
     "each node is tied to the point of this body where it begins",
     field<TextFormat, Unless0<&SceneAttachment::Target::body>>},
    {"point", "m", kBounded, "none: where each node begins", "in space: all nodes are tied to this point",
     member_as<VectorFormat<double>, &SceneAttachment::Target::point>},
};
void complete_target(const GivenTable& given, SceneAttachment::Target&) {
    if (given.count("body", "point") == 2) {
        given.refuse("point", "it is for ties to space; without point each node is tied where it is in the body");
    }
}
constexpr KeyTable<SceneAttachment::Target> kTo = {"attach.to", "The value of `to`; {} for ties to space.", kToKeys,
                                                   complete_target};

/// An infinite one is not written.
struct Stiffness : Member<&SceneAttachment::stiffness> {
    static std::optional<double> get(const SceneAttachment& attachment) {
        const double k = attachment.stiffness;
        return k == std::numeric_limits<double>::infinity() ? std::nullopt : std::optional(k);
    }
};
constexpr Key<SceneAttachment> kAttachKeys[] = {
    {"from", "", words("{body = name, where = region}"), "required", "which nodes",
     member_as<TableFormat<kFrom>, &SceneAttachment::from>},
    {"to", "", words("{body = name}, {point = [x, y, z]} or {}"), "required", "what they are tied to",
     member_as<TableFormat<kTo>, &SceneAttachment::to>},
    {"stiffness", "N/m", kAbove0, "none: welded", "of all ties together, which have equal parts of it",
     field<NumberFormat, Stiffness>},
};
constexpr KeyTable<SceneAttachment> kAttach = {
    "attach", "Nodes of a [[body]] that are tied to another one or to space, by springs without length.", kAttachKeys};

template <const auto& table>
constexpr SceneTable documented(bool repeated) {
    return {table.name, table.meaning, false, repeated, [] { return table.described(); }};
}

constexpr SceneTable kWorldTables[] = {
    documented<kTitle>(true), documented<kContact>(true), documented<kAttach>(true),
    documented<kFrom>(false), documented<kTo>(false),
};

/// Throws where the scene has no such body.
void require_body(const Scene& shared, const std::vector<NamedScene>& bodies, const std::string& name,
                  const std::string& path) {
    if (std::none_of(bodies.begin(), bodies.end(), [&](const NamedScene& body) { return body.name == name; })) {
        throw scene_error(shared, path, "no [[body]] has this name; there are " + names_of(bodies));
    }
}

/// A free obstacle of several bodies is the same one where it has the same name.
void require_one(const WorldScene& world) {
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
        const Scene& scene = world.bodies[b].scene;
        for (std::size_t o = 0; o < scene.obstacles.size(); ++o) {
            const SceneObstacle& obstacle = scene.obstacles[o];
            for (std::size_t other = 0; other < b && obstacle.mass > 0; ++other) {
                for (const SceneObstacle& before : world.bodies[other].scene.obstacles) {
                    if (before.mass == 0 || before.name != obstacle.name) {
                        continue;
                    }
                    const std::string path = "obstacle[" + std::to_string(o) + "].mass";
                    if (before.shape != obstacle.shape || before.position != obstacle.position ||
                        before.velocity != obstacle.velocity || before.mass != obstacle.mass ||
                        before.inertia != obstacle.inertia) {
                        throw scene_error(scene, path,
                                          "free obstacles of the same name are one: " + obstacle.name +
                                              " must have one shape, place, velocity, mass and inertia");
                    }
                    if (scene.solver.method == SolverMethod::leapfrog) {
                        throw scene_error(scene, path,
                                          "a free obstacle that several bodies touch moves with \"symplectic-euler\" "
                                          "only");
                    }
                }
            }
        }
    }
}

void require_bodies(const Scene& shared, const WorldScene& world) {
    for (std::size_t c = 0; c < world.contacts.size(); ++c) {
        for (const std::string& name : world.contacts[c].between) {
            const std::string path = "contact[" + std::to_string(c) + "].between";
            if (std::none_of(world.bodies.begin(), world.bodies.end(), [&](const auto& b) { return b.name == name; })) {
                throw scene_error(shared, path,
                                  "no [[body]] is named " + name + "; there are " + names_of(world.bodies));
            }
        }
    }
    for (std::size_t a = 0; a < world.attachments.size(); ++a) {
        const SceneAttachment& attachment = world.attachments[a];
        const std::string path = "attach[" + std::to_string(a) + "].";
        require_body(shared, world.bodies, attachment.from.body, path + "from.body");
        if (!attachment.to.body.empty()) {
            require_body(shared, world.bodies, attachment.to.body, path + "to.body");
            if (attachment.to.body == attachment.from.body) {
                throw scene_error(shared, path + "to.body", "it must be another body than that of from");
            }
        }
    }
    for (const NamedScene& body : world.bodies) { // alike in all of them
        const Scene& scene = body.scene;
        require_cubes(scene, "a scene of [[body]] tables");
        if (may_part(scene)) {
            throw scene_error(scene, scene.tear_strain ? "material.tear_strain" : "cut[0].mode",
                              "cells of [[body]] tables do not part: only those of one [body]");
        }
        if (!explicit_in_time(scene.solver.method)) {
            throw scene_error(scene, "solver.method", "scenes of [[body]] tables move by symplectic-euler or leapfrog");
        }
        if (scene.output.energy_balance) {
            throw scene_error(scene, "output.energy_balance",
                              "it is metered for one [body] alone: what bodies do to each other is not in it");
        }
    }
    require_one(world);
}

const SceneValue::Member* find(const SceneValue::Table& root, std::string_view name) {
    const auto found = std::find_if(root.begin(), root.end(), [&](const auto& member) { return member.name == name; });
    return found == root.end() ? nullptr : &*found;
}

template <class Owner>
std::vector<Owner> read_all(Scene& shared, const SceneValue::Table& root, const KeyTable<Owner>& table) {
    std::vector<Owner> all;
    const SceneValue::Member* const member = find(root, table.name);
    if (member == nullptr) {
        return all;
    }
    const std::string name(table.name);
    if (!is_array_of_tables(member->value)) {
        shared.source.entries[name] = {member->place.line, member->place.column, {}};
        throw scene_error(shared, name, "it must be given as [[" + name + "]], any number of times");
    }
    for (const SceneValue& item : *member->value.as<SceneValue::Array>()) {
        all.push_back(table.read(shared, item, name + "[" + std::to_string(all.size()) + "]"));
    }
    return all;
}

/// The tables of each body: those that name it, its own [body] and [material], and what all share.
class BodyRoots {
public:
    BodyRoots(Scene& shared, const SceneValue::Table& root) : shared_(shared) {
        for (const SceneValue& item : *find(root, "body")->value.as<SceneValue::Array>()) {
            add_body(item);
        }
        for (const SceneValue::Member& member : root) {
            if (member.name == "body" || member.name == kContact.name || member.name == kAttach.name) {
                continue;
            }
            require_known(shared_, member, kWorldTables);
            const std::span<const SceneTable> tables = scene_tables();
            const auto table = std::find_if(tables.begin(), tables.end(),
                                            [&](const SceneTable& one) { return one.name == member.name; });
            table->repeated ? share_out(member) : give_to_all(member);
        }
    }
    const std::vector<NamedScene>& bodies() const { return bodies_; }
    const SceneValue::Table& root(std::size_t body) const { return roots_[body]; }

private:
    void add_body(SceneValue item) {
        const std::string path = "body[" + std::to_string(bodies_.size()) + "]";
        auto& members = std::get<SceneValue::Table>(item.data);
        SceneValue title = {take(members, "name"), item.place};
        const std::string name = kTitle.read(shared_, title, path).name;
        if (std::any_of(bodies_.begin(), bodies_.end(), [&](const NamedScene& body) { return body.name == name; })) {
            throw scene_error(shared_, path + ".name", "another [[body]] has this name; each must have its own");
        }
        SceneValue::Table root = take(members, "material");
        const SceneSource::Entry at = item.place;
        root.push_back({"body", std::move(item), at});
        bodies_.push_back({name, {}});
        roots_.push_back(std::move(root));
    }
    /// The member of this name, if there is one, out of a table.
    static SceneValue::Table take(SceneValue::Table& members, std::string_view name) {
        SceneValue::Table taken;
        const auto found = std::find_if(members.begin(), members.end(), [&](const auto& m) { return m.name == name; });
        if (found != members.end()) {
            taken.push_back(std::move(*found));
            members.erase(found);
        }
        return taken;
    }
    void give_to_all(const SceneValue::Member& member) {
        for (SceneValue::Table& root : roots_) {
            if (find(root, member.name) == nullptr) { // a [body.material] stands for [material]
                root.push_back(member);
            }
        }
    }
    void share_out(const SceneValue::Member& member) {
        std::size_t number = 0;
        for (SceneValue item : *member.value.as<SceneValue::Array>()) {
            const std::string path = member.name + "[" + std::to_string(number++) + "].body";
            const SceneValue::Table named = take(std::get<SceneValue::Table>(item.data), "body");
            const std::string* name = nullptr;
            if (!named.empty()) {
                shared_.source.entries[path] = named[0].value.place;
                name = named[0].value.as<std::string>();
                require_body(shared_, bodies_, name ? *name : "", path);
            } else if (member.name == "obstacle") { // which all bodies touch; a free one is the same by its name
                const auto& table = std::get<SceneValue::Table>(item.data);
                if (bodies_.size() > 1 && find(table, "mass") != nullptr && find(table, "name") == nullptr) {
                    const std::string its_name = path.substr(0, path.size() - 4) + "name";
                    shared_.source.entries[its_name] = {item.place.line, item.place.column, {}};
                    throw scene_error(shared_, its_name, "missing; a free obstacle that several bodies touch has one");
                }
            } else if (bodies_.size() > 1) {
                shared_.source.entries[path] = {item.place.line, item.place.column, {}};
                throw scene_error(shared_, path, "missing; it must name one of " + names_of(bodies_));
            }
            for (std::size_t b = 0; b < bodies_.size(); ++b) {
                if (!name || bodies_[b].name == *name) {
                    add(roots_[b], member, item);
                }
            }
        }
    }
    static void add(SceneValue::Table& root, const SceneValue::Member& member, const SceneValue& item) {
        for (SceneValue::Member& own : root) {
            if (own.name == member.name) {
                std::get<SceneValue::Array>(own.value.data).push_back(item);
                return;
            }
        }
        root.push_back({member.name, {SceneValue::Array{item}, member.value.place}, member.place});
    }

    Scene& shared_; ///< for messages
    std::vector<NamedScene> bodies_;
    std::vector<SceneValue::Table> roots_;
};

} // namespace

std::span<const SceneTable> world_tables() {
    return kWorldTables;
}

std::vector<std::pair<std::string, SceneValue>> world_values(const WorldScene& world) {
    std::vector<std::pair<std::string, SceneValue>> values;
    for (const SceneContact& contact : world.contacts) {
        values.emplace_back(kContact.name, kContact.write(contact));
    }
    for (const SceneAttachment& attachment : world.attachments) {
        values.emplace_back(kAttach.name, kAttach.write(attachment));
    }
    return values;
}

WorldScene read_world(const SceneText& text, const std::string& filename) {
    Scene shared;
    shared.source.file = filename;
    const BodyRoots roots(shared, text.root);
    WorldScene world;
    world.bodies = roots.bodies();
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
        Scene& scene = world.bodies[b].scene;
        scene.source = {filename, {}, text.canonical};
        read_scene(scene, roots.root(b));
    }
    world.contacts = read_all(shared, text.root, kContact);
    world.attachments = read_all(shared, text.root, kAttach);
    shared.source.canonical = text.canonical;
    world.source = shared.source;
    require_bodies(shared, world);
    return world;
}

} // namespace scene_format

WorldScene within_ranges(WorldScene world) {
    using namespace scene_format;
    Scene shared;
    shared.source = world.source;
    std::set<std::string> names;
    for (std::size_t b = 0; b < world.bodies.size(); ++b) {
        NamedScene& body = world.bodies[b];
        if (body.name.empty() || !names.insert(body.name).second) {
            throw scene_error(shared, "body[" + std::to_string(b) + "].name",
                              "it must be there, and different for each body");
        }
        body.scene = within_ranges(std::move(body.scene));
    }
    if (world.bodies.empty()) {
        throw scene_error(shared, "body", "missing; a world needs at least one");
    }
    const auto check = [&](const auto& table, const auto& all) {
        for (std::size_t i = 0; i < all.size(); ++i) {
            table.check({shared, std::string(table.name) + "[" + std::to_string(i) + "]", table.described(), false},
                        all[i]);
        }
    };
    check(kContact, world.contacts);
    check(kAttach, world.attachments);
    require_bodies(shared, world);
    return world;
}

} // namespace hybmss
