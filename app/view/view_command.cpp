// hybmss view: a scene, or what came of one, in the browser of this machine.

#include "app/command_line.hpp"
#include "app/plan_arguments.hpp"
#include "app/view/messages.hpp"
#include "app/view/server.hpp"
#include "app/view/shown.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <spawn.h>
#include <stdexcept>
#include <unistd.h>
#include <utility>

extern "C" char** environ;

namespace hybmss {
extern const char* const kViewPage; ///< page.html
}

namespace {

using namespace hybmss;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kFrame(16), kReplayedFrame(40), kLongWait(200);

struct ViewArguments {
    std::string path;
    int port = 0;
    bool no_open = false, paused = false;
    double speed = 1;
    PlanArguments plan;
};

volatile std::sig_atomic_t interrupted = 0;

void remember_interrupt(int) {
    interrupted = 1;
}

/// The first asks to end; a second one ends at once.
void catch_interrupt() {
    struct sigaction action {};
    action.sa_handler = remember_interrupt;
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    std::signal(SIGCHLD, SIG_IGN); // of the browser's opener
}

struct Interrupted : std::exception {};

/// Opens the address by way of a file that no other user can read: arguments of programs are seen by all.
class OpenedPage {
public:
    explicit OpenedPage(const std::string& address) {
        std::string folder = (std::filesystem::temp_directory_path() / "hybmss-XXXXXX").string();
        if (mkdtemp(folder.data()) == nullptr) {
            return;
        }
        folder_ = folder;
        const std::string file = folder_ / "view.html";
        std::ofstream(file) << "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url=" << address << "\">\n";
        const char* const arguments[] = {"xdg-open", file.c_str(), nullptr};
        pid_t child = 0;
        // Where there is none, the printed address is what there is.
        (void)posix_spawnp(&child, "xdg-open", nullptr, nullptr, const_cast<char* const*>(arguments), environ);
    }
    OpenedPage(const OpenedPage&) = delete;
    OpenedPage& operator=(const OpenedPage&) = delete;
    ~OpenedPage() {
        if (!folder_.empty()) {
            std::error_code ignored;
            std::filesystem::remove_all(folder_, ignored);
        }
    }

private:
    std::filesystem::path folder_;
};

/// What the page is told besides surfaces and frames.
struct Status {
    std::string title, note;
    bool live = true, pulls = false, running = false;
    double speed = 1, duration = 0;
    std::size_t frames = 0, frame = 0;

    std::string json() const {
        return nlohmann::json{{"title", title},       {"note", note},       {"live", live},
                              {"pulls", pulls},       {"running", running}, {"speed", speed},
                              {"duration", duration}, {"frames", frames},   {"frame", frame}}
            .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    }
};

/// What live scenes and finished runs have in common: the server, and what it says of them.
template <class Shown>
class View {
public:
    View(const ViewArguments& arguments, Shown& shown, Status status)
        : shown_(shown), status_(std::move(status)),
          server_(arguments.port, kViewPage,
                  {[this] { return everything(); }, [this] { left_ = true; },
                   [this](std::string_view text) { return received(text); }}) {
        shown_.update_surfaces();
        status_.running = !arguments.paused;
        status_.speed = arguments.speed;
        fmt::print("{}\nCtrl-C ends it\n", server_.address());
        std::fflush(stdout);
        if (!arguments.no_open) {
            opened_.emplace(server_.address());
        }
    }

protected:
    using Message = ViewServer::Message;

    std::vector<Message> everything() {
        return {{status_.json()}, {surfaces_message(shown_.surfaces()), true}, {frame_message(frame()), true}};
    }
    ViewFrame frame() const {
        ViewFrame frame = shown_.frame();
        frame.steps_a_second = steps_a_second_;
        return frame;
    }
    void tell_status() { server_.send({status_.json()}); }
    void tell_frame(bool replaceable) {
        if (shown_.update_surfaces()) {
            server_.send({surfaces_message(shown_.surfaces()), true});
        }
        server_.send({frame_message(frame()), true, replaceable});
    }
    /// Messages are done with between steps: what the server calls within a step of its own only keeps them.
    bool received(std::string_view text) {
        const std::optional<ViewMessage> message = parse_view_message(text);
        constexpr std::size_t kMostWaiting = 1000;
        if (!message || waiting_.size() >= kMostWaiting) {
            return false;
        }
        waiting_.push_back(*message);
        return true;
    }
    std::vector<ViewMessage> take_messages() { return std::exchange(waiting_, {}); }

    Shown& shown_;
    Status status_;
    double steps_a_second_ = 0;
    bool left_ = false; ///< a viewer has
    std::vector<ViewMessage> waiting_;
    ViewServer server_;
    std::optional<OpenedPage> opened_;
};

class LiveView : View<LiveBodies> {
public:
    using View::View;

    /// Returns why it failed at last, or "".
    std::string run() {
        auto before = Clock::now();
        while (interrupted == 0) {
            const bool moving = status_.running && server_.viewers() > 0;
            const auto due = before + (moving ? kFrame : kLongWait);
            server_.poll(std::max(milliseconds(0), std::chrono::duration_cast<milliseconds>(due - Clock::now())));
            try {
                if (std::exchange(left_, false)) {
                    shown_.release();
                }
                for (const ViewMessage& message : take_messages()) {
                    act(message);
                }
                const auto now = Clock::now();
                if (moving && status_.running && now >= due) {
                    advance(std::chrono::duration<double>(now - before).count());
                    before = now;
                } else if (!moving) {
                    before = now;
                }
            } catch (const Interrupted&) {
                break;
            } catch (const std::runtime_error& error) {
                status_.note = error.what();
                status_.running = false;
                fmt::print(stderr, "hybmss: error: {}: {}\n", status_.title, status_.note);
                tell_frame(false);
                tell_status();
            }
        }
        return status_.note;
    }

private:
    /// The steps of so much time on the clock, as far as the machine takes them in it.
    void advance(double seconds) {
        if (!server_.idle()) {
            return;
        }
        constexpr double kMostOfAFrame = 0.8, kLongest = 0.1;
        long count = 1;
        if (!shown_.is_static()) {
            owed_ += status_.speed * std::min(seconds, kLongest) / shown_.time_step();
            count = static_cast<long>(std::min(owed_, 1e6));
        }
        if (count < 1) {
            return;
        }
        const double room = kMostOfAFrame * std::chrono::duration<double>(kFrame).count();
        const long affordable = step_seconds_ > 0 ? std::max(1L, static_cast<long>(room / step_seconds_)) : 1;
        owed_ = count > affordable ? 0 : owed_ - static_cast<double>(count);
        take(std::min(count, affordable));
        tell_frame(true);
    }
    void take(long count) {
        const auto begin = Clock::now();
        if (shown_.is_static()) {
            status_.note = "looking for the equilibrium";
            tell_status();
        }
        shown_.step(count, [this] {
            server_.poll(milliseconds(0));
            if (interrupted != 0) {
                throw Interrupted();
            }
        });
        const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
        step_seconds_ = seconds / static_cast<double>(count);
        steps_a_second_ = 1 / std::max(step_seconds_, 1e-9);
        if (shown_.is_static()) {
            status_.note.clear();
            status_.running = false;
            tell_status();
        }
    }
    void act(const ViewMessage& message) {
        using Kind = ViewMessage::Kind;
        const bool failed = !status_.note.empty();
        switch (message.kind) {
        case Kind::run:
            status_.running = !failed;
            break;
        case Kind::pause:
            status_.running = false;
            break;
        case Kind::speed:
            status_.speed = message.speed;
            break;
        case Kind::step:
            if (!failed) {
                take(static_cast<long>(message.number));
                tell_frame(false);
            }
            return;
        case Kind::restart:
            shown_.restart();
            status_.note.clear();
            owed_ = 0;
            tell_frame(false);
            break;
        case Kind::pull:
            shown_.pull(message.number, message.place);
            return;
        case Kind::release:
            shown_.release();
            return;
        case Kind::show:
            return; // of finished runs
        }
        tell_status();
    }

    double owed_ = 0, step_seconds_ = 0;
};

class RunView : View<RecordedRun> {
public:
    using View::View;

    std::string run() {
        while (interrupted == 0) {
            const bool moving = status_.running && server_.viewers() > 0;
            server_.poll(moving ? kReplayedFrame : kLongWait);
            for (const ViewMessage& message : take_messages()) {
                act(message);
            }
            if (const auto due = last_ + kReplayedFrame; moving && status_.running && Clock::now() >= due) {
                if (shown_.shown() + 1 < shown_.frame_count()) {
                    show(shown_.shown() + 1);
                }
                status_.running = shown_.shown() + 1 < shown_.frame_count();
                last_ = Clock::now();
                tell_status();
            }
        }
        return "";
    }

private:
    void show(std::size_t frame) {
        shown_.show(std::min(frame, shown_.frame_count() - 1));
        status_.frame = shown_.shown();
        tell_frame(false);
    }
    void act(const ViewMessage& message) {
        using Kind = ViewMessage::Kind;
        switch (message.kind) {
        case Kind::run:
            status_.running = true;
            if (shown_.shown() + 1 == shown_.frame_count()) {
                show(0);
            }
            break;
        case Kind::pause:
            status_.running = false;
            break;
        case Kind::step:
            show(shown_.shown() + message.number);
            break;
        case Kind::show:
            show(message.number);
            break;
        case Kind::restart:
            show(0);
            break;
        default:
            return; // of live scenes
        }
        tell_status();
    }

    Clock::time_point last_ = Clock::now();
};

void view(const ViewArguments& arguments) {
    Status status;
    const std::filesystem::path path = std::filesystem::absolute(arguments.path).lexically_normal();
    status.title = (path.has_filename() ? path : path.parent_path()).filename().string();
    std::string failure;
    if (std::filesystem::is_directory(arguments.path)) {
        RecordedRun run(arguments.path);
        status.live = false;
        status.frames = run.frame_count();
        catch_interrupt();
        failure = RunView(arguments, run, status).run();
    } else {
        LiveBodies bodies(arguments.path, arguments.plan.options());
        status.pulls = bodies.can_be_pulled();
        status.duration = bodies.body(0).scene().solver.duration;
        catch_interrupt();
        failure = LiveView(arguments, bodies, status).run();
    }
    if (!failure.empty()) {
        throw CLI::RuntimeError(1);
    }
}

} // namespace

void add_view_command(CLI::App& app) {
    const auto arguments = std::make_shared<ViewArguments>();
    CLI::App* command = app.add_subcommand("view", "show a scene as it moves, or a finished run, in a browser");
    command->add_option("SCENE", arguments->path, "scene file (TOML), or the --out directory of a run")->required();
    command->add_option("--port", arguments->port, "of 127.0.0.1; 0: any that is free")
        ->check(whole_number(0, 65535))
        ->capture_default_str();
    command->add_flag("--no-open", arguments->no_open, "print the address alone, and open no browser");
    command->add_flag("--paused", arguments->paused, "wait for the page to run or step");
    command->add_option("--speed", arguments->speed, "seconds of the scene in one of the clock")
        ->check(number(1e-6, 1e3))
        ->capture_default_str();
    arguments->plan.add_to(*command, true);
    command->callback([arguments] { view(*arguments); });
}
