#include "app/view/shown.hpp"

#include "hybmss/simulation/solve_to_accuracy.hpp"
#include "layouts/messages.hpp"
#include "layouts/read_file.hpp"
#include "simulation/results/results.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace hybmss {
namespace {

/// A pull takes hold of what is within so many cells, as stiffly as so many cells beside each other.
constexpr double kReach = 1.5, kStiffness = 2;

std::array<float, 3> rounded(const Vector3& x) {
    return {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])};
}

std::string read_text(const std::filesystem::path& path) {
    constexpr std::uintmax_t kMost = std::uintmax_t{1} << 34;
    try {
        return read_file(path, Readable::regular_file, kMost);
    } catch (const ReadError& error) {
        throw std::invalid_argument(path.string() + ": " + error.what());
    }
}

} // namespace

LiveBodies::LiveBodies(const std::string& path, const SimulationOptions& options)
    : scene_(load_any_scene(path)), options_(options) {
    if (auto* const scene = std::get_if<Scene>(&scene_)) {
        scene->output.energy_balance = false; // which nobody reads here
    }
    make();
}

void LiveBodies::make() {
    world_.reset();
    alone_.reset();
    pull_.reset();
    if (const auto* const several = std::get_if<WorldScene>(&scene_)) {
        world_.emplace(*several, options_);
        return;
    }
    const Scene& scene = std::get<Scene>(scene_);
    if (scene.solver.accuracy) {
        alone_.emplace(solve_to_accuracy(scene, {options_, true, {}, {}}).simulation);
    } else if (explicit_in_time(scene.solver.method)) {
        WorldScene world;
        world.bodies.push_back({"body", scene});
        world.source = scene.source;
        world_.emplace(std::move(world), options_);
    } else {
        alone_.emplace(scene, options_);
        (void)alone_->lattice(); // cubes alone are drawn
    }
}

void LiveBodies::restart() {
    make();
    removed_.clear();
}

void LiveBodies::step(long count, const std::function<void()>& waiting) {
    if (world_) {
        constexpr long kStepsOfAPull = 8; // then it is aimed anew
        for (long left = count; left > 0;) {
            const long taken = pull_ ? std::min(left, kStepsOfAPull) : left;
            aim();
            world_->step(taken);
            left -= taken;
        }
    } else if (!is_static()) {
        alone_->step(count);
    } else {
        RunCallbacks callbacks;
        callbacks.progress = [&](const Progress&) { waiting(); };
        if (const Summary summary = alone_->run(callbacks); !summary.failure.empty()) {
            throw std::runtime_error(summary.failure);
        }
    }
}

bool LiveBodies::update_surfaces() {
    std::vector<std::size_t> removed;
    for (std::size_t b = 0; b < body_count(); ++b) {
        removed.push_back(body(b).removed_cell_count() + body(b).parted_face_count());
    }
    if (removed == removed_) {
        return false;
    }
    removed_ = std::move(removed);
    release(); // points are numbered anew
    surfaces_.clear();
    for (std::size_t b = 0; b < body_count(); ++b) {
        surfaces_.push_back(surface_of(body(b).cell_nodes()));
    }
    return true;
}

ViewFrame LiveBodies::frame() const {
    ViewFrame frame;
    frame.time = time();
    frame.steps = static_cast<double>(steps());
    for (std::size_t b = 0; b < body_count(); ++b) {
        const std::vector<Vector3> u = body(b).displacements();
        const auto rest = body(b).rest_positions();
        for (const std::uint32_t n : surfaces_[b].nodes) {
            frame.points.push_back(rounded({rest[n][0] + u[n][0], rest[n][1] + u[n][1], rest[n][2] + u[n][2]}));
        }
    }
    // All bodies of a world have the same ones, but for those that name a body.
    for (std::size_t b = 0; b < body_count(); ++b) {
        for (const VtuObstacle& obstacle : drawn_obstacles(body(b))) {
            const auto same = [&](const VtuObstacle& one) {
                return one.kind == obstacle.kind && one.size == obstacle.size && one.position == obstacle.position &&
                       one.rotation == obstacle.rotation;
            };
            if (std::none_of(frame.obstacles.begin(), frame.obstacles.end(), same)) {
                frame.obstacles.push_back(obstacle);
            }
        }
    }
    return frame;
}

void LiveBodies::pull(std::size_t point, const Vector3& place) {
    std::size_t b = 0, local = point;
    while (b < surfaces_.size() && local >= surfaces_[b].nodes.size()) {
        local -= surfaces_[b++].nodes.size();
    }
    if (!world_ || b == surfaces_.size()) {
        return;
    }
    if (!pull_ || pull_->point != point) {
        release();
        pull_ = {point, b, surfaces_[b].nodes[local], place, {}};
        const Simulation& body = world_->body(b);
        const auto rest = body.rest_positions();
        const std::vector<Vector3> u = body.displacements();
        const Vector3& middle = rest[pull_->node];
        const double h = body.scene().body.cell_size;
        // One node alone would be pulled out of its cells.
        std::vector<std::uint32_t> nodes;
        for (const std::uint32_t n : surfaces_[b].nodes) {
            if (std::hypot(rest[n][0] - middle[0], rest[n][1] - middle[1], rest[n][2] - middle[2]) < kReach * h) {
                nodes.push_back(n);
            }
        }
        for (const std::uint32_t n : nodes) {
            Vector3 beside{};
            Attachment tie;
            tie.from = {b, rest[n]};
            for (std::size_t a = 0; a < 3; ++a) {
                beside[a] = rest[n][a] + u[n][a] - middle[a] - u[pull_->node][a];
            }
            tie.stiffness = kStiffness * body.scene().material.young_modulus * h / static_cast<double>(nodes.size());
            pull_->ties.emplace_back(world_->attach(tie), beside);
        }
    }
    pull_->place = place;
}

/// Ends of ties stay within kReach cells of the nodes: the pull has a greatest force, whatever the pointer does.
void LiveBodies::aim() {
    if (!pull_) {
        return;
    }
    const Simulation& body = world_->body(pull_->body);
    const Vector3 rest = body.rest_positions()[pull_->node], u = body.displacements()[pull_->node];
    Vector3 way{};
    for (std::size_t a = 0; a < 3; ++a) {
        way[a] = pull_->place[a] - rest[a] - u[a];
    }
    const double longest = kReach * body.scene().body.cell_size, length = std::hypot(way[0], way[1], way[2]);
    const double part = length > longest ? longest / length : 1;
    for (const auto& [tie, beside] : pull_->ties) {
        Vector3 end{};
        for (std::size_t a = 0; a < 3; ++a) {
            end[a] = rest[a] + u[a] + part * way[a] + beside[a];
        }
        world_->move_anchor(tie, end);
    }
}

void LiveBodies::release() {
    if (pull_) {
        for (const auto& [tie, beside] : pull_->ties) {
            world_->detach(tie);
        }
        pull_.reset();
    }
}

RecordedRun::RecordedRun(std::filesystem::path directory) : directory_(std::move(directory)) {
    const bool several = std::filesystem::exists(directory_ / "bodies.pvd");
    const std::filesystem::path list = directory_ / (several ? "bodies.pvd" : "body.pvd");
    if (!std::filesystem::exists(list)) {
        throw std::invalid_argument(directory_.string() +
                                    ": it holds neither body.pvd nor bodies.pvd, which a run writes "
                                    "at its end");
    }
    try {
        files_ = parse_pvd(read_text(list));
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(list.string() + ": " + error.what());
    }
    if (files_.empty()) {
        throw std::invalid_argument(list.string() + ": it names no frames");
    }
    std::stable_sort(files_.begin(), files_.end(), [](const PvdFrame& a, const PvdFrame& b) {
        return a.time != b.time ? a.time < b.time : a.part < b.part;
    });
    for (std::size_t f = 0; f < files_.size(); ++f) {
        if (f == 0 || files_[f].time != files_[f - 1].time) {
            times_.emplace_back(f, f);
        }
        times_.back().second = f + 1;
    }
    show(0);
}

void RecordedRun::show(std::size_t frame) {
    const auto [first, end] = times_.at(frame);
    std::vector<VtuShape> shapes;
    for (std::size_t f = first; f < end; ++f) {
        const std::filesystem::path path = directory_ / files_[f].file;
        try {
            shapes.push_back(parse_vtu(read_text(path)));
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(path.string() + ": " + error.what());
        }
    }
    const bool same = std::equal(shapes.begin(), shapes.end(), cells_.begin(), cells_.end(),
                                 [](const VtuShape& shape, const auto& cells) { return shape.cells == cells; });
    if (!same) {
        cells_.clear();
        surfaces_.clear();
        for (VtuShape& shape : shapes) {
            surfaces_.push_back(surface_of(shape.cells));
            cells_.push_back(std::move(shape.cells));
        }
        new_surfaces_ = true;
    }
    shown_ = frame;
    frame_ = {};
    frame_.time = files_[first].time;
    frame_.steps = static_cast<double>(frame);
    for (std::size_t b = 0; b < shapes.size(); ++b) {
        for (const std::uint32_t n : surfaces_[b].nodes) {
            frame_.points.push_back(rounded(shapes[b].points[n]));
        }
        if (b == 0) {
            frame_.obstacles = shapes[b].obstacles;
        }
    }
}

} // namespace hybmss
