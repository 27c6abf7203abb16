#pragma once

/// \file
/// Small scenes at random, as the text that a user might write, and ways to damage a text.

#include "tests/random_bodies.hpp"
#include "tests/simulation/files.hpp"

#include "layouts/messages.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

namespace hybmss::test {

/// Draws from one seed.
class Draw : public testing::Random {
public:
    using Random::Random;
    /// Each order of size as likely as another.
    double any_size(double low, double high) { return std::exp(between(std::log(low), std::log(high))); }
    int whole(int low, int high) { return low + static_cast<int>(below(static_cast<std::size_t>(high - low + 1))); }
    bool chance(double probability) { return between(0, 1) < probability; }
    template <class T>
    T one_of(std::initializer_list<T> all) {
        return all.begin()[below(all.size())];
    }
    const char* word(std::initializer_list<const char*> all) { return one_of(all); }
};

struct RandomScene {
    std::string text;    ///< all but [damping], [solver] and [output]
    std::string voxels;  ///< what voxels.npy holds; "" where the body is a box
    std::string options; ///< of `hybmss run`, for the plan
    double wave = 0;     ///< s in which sound passes along the longest edge
    double slowest = 0;  ///< rad/s, about: of the softest vibration
    double length = 0;   ///< m, of the longest edge

    std::string at_rest() const { return text + "[solver]\nmethod = \"static\"\n"; }
    /// Damped so that the softest vibration dies out soonest, led slowly; until it has settled.
    std::string damped(double tolerance) const {
        return text + printed("[damping]\nmass = %.6g\n[solver]\nduration = %.6g\ntolerance = %.6g\n", slowest,
                              400 / slowest + 40 * wave, tolerance);
    }
};

namespace random_scene {

inline std::string numbers(const std::array<double, 3>& v) {
    return printed("[%.9g, %.9g, %.9g]", v[0], v[1], v[2]);
}

/// Of the cells with a label, x fastest, the greatest part that hangs together by faces; all others become 0.
inline void keep_one_part(const Shape& n, std::vector<int>& labels) {
    std::vector<int> part(labels.size(), 0);
    std::vector<std::size_t> sizes = {0};
    const auto index = [&](int i, int j, int k) { return static_cast<std::size_t>(i + n[0] * (j + n[1] * k)); };
    for (std::size_t first = 0; first < labels.size(); ++first) {
        if (labels[first] == 0 || part[first] != 0) {
            continue;
        }
        const auto number = static_cast<int>(sizes.size());
        sizes.push_back(0);
        std::vector<std::size_t> reached = {first};
        part[first] = number;
        while (!reached.empty()) {
            const auto cell = static_cast<int>(reached.back());
            reached.pop_back();
            ++sizes.back();
            const Shape at = {cell % n[0], cell / n[0] % n[1], cell / n[0] / n[1]};
            for (std::size_t axis = 0; axis < 3; ++axis) {
                for (const int side : {-1, 1}) {
                    Shape next = at;
                    next[axis] += side;
                    if (next[axis] < 0 || next[axis] >= n[axis]) {
                        continue;
                    }
                    const std::size_t beside = index(next[0], next[1], next[2]);
                    if (labels[beside] != 0 && part[beside] == 0) {
                        part[beside] = number;
                        reached.push_back(beside);
                    }
                }
            }
        }
    }
    const auto largest = std::max_element(sizes.begin(), sizes.end()) - sizes.begin();
    for (std::size_t c = 0; c < labels.size(); ++c) {
        labels[c] = part[c] == largest ? labels[c] : 0;
    }
}

} // namespace random_scene

/// A body of 2 to 6 cells an edge that is clamped at one end, or on rollers that leave it no motion, and driven at
/// the other: moved, turned, loaded, by its weight, or by several of these.
inline RandomScene random_scene_of(Draw& draw) {
    using namespace random_scene;
    RandomScene scene;
    const double h = draw.any_size(0.01, 10), E = draw.any_size(1e2, 1e9), rho = draw.any_size(10, 1e4);
    const double nu = draw.between(-0.5, 0.49);
    Shape n = {draw.whole(2, 6), draw.whole(2, 6), draw.whole(2, 6)};
    const auto axis = static_cast<std::size_t>(draw.whole(0, 2)); // from the held end to the driven one
    const bool slender = draw.chance(0.1);
    if (slender) {
        n = {2, 2, 2};
        n[axis] = draw.whole(10, 20);
    }
    std::string& text = scene.text;

    // The body
    const bool has_voxels = !slender && draw.chance(0.35);
    std::string labels_text;
    if (has_voxels) {
        std::vector<int> labels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
        const bool two = draw.chance(0.5);
        for (int& label : labels) {
            label = draw.chance(0.15) ? 0 : two && draw.chance(0.3) ? 2 : 1;
        }
        keep_one_part(n, labels);
        if (two) {
            labels_text =
                printed("[[label]]\nvalue = 1\nyoung_modulus = %.9g\n[[label]]\nvalue = 2\nyoung_modulus = %.9g\n", E,
                        E * draw.any_size(0.1, 10));
        }
        scene.voxels =
            npy(n, [&](int i, int j, int k) { return labels[static_cast<std::size_t>(i + n[0] * (j + n[1] * k))]; });
    }
    text =
        has_voxels ? "[body]\nvoxels = \"voxels.npy\"\n" : printed("[body]\ncells = [%d, %d, %d]\n", n[0], n[1], n[2]);
    text += printed("cell_size = %.9g\n", h);

    // The material
    const double A = draw.chance(0.6) ? 1 : draw.chance(0.3) ? 0 : draw.any_size(0.1, 10);
    text +=
        printed("[material]\nyoung_modulus = %.9g\npoisson_ratio = %.9g\ndensity = %.9g\nface_diagonal_ratio = %.9g\n"
                "volume_energy = \"%s\"\n",
                E, nu, rho, A, draw.chance(0.7) ? "automatic" : draw.word({"quadratic", "mean_stretch", "none"}));
    if (draw.chance(0.2)) {
        const double cubic = draw.any_size(0.01, 10);
        text += printed("stiffening_cubic = %.9g\nstiffening_quadratic = %.9g\n", cubic,
                        draw.between(-0.9, 0.9) * std::sqrt(3 * cubic));
    }
    text += labels_text;

    // What holds it
    const std::array<double, 3> size = {n[0] * h, n[1] * h, n[2] * h};
    const double length = size[axis], width = std::min(size[(axis + 1) % 3], size[(axis + 2) % 3]);
    const std::string letter(1, "xyz"[axis]), high = letter + "-max", low = letter + "-min";
    const bool rollers = !has_voxels && draw.chance(0.2);
    if (rollers) {
        for (const char* each : {"x", "y", "z"}) {
            text += printed("[[fix]]\nwhere = \"%s-min\"\naxes = \"%s\"\n", each, each);
        }
    } else {
        text += printed("[[fix]]\nwhere = \"%s\"\n", low.c_str());
    }

    // What drives it. Loads and weight act at once, so what presses or bends stays well below what buckles.
    const double strength = draw.any_size(0.01, 1), thinness = std::min(width / length, 1.0);
    const auto pulled = [&](double most, bool sideways) {
        const double bend = sideways ? most * thinness * thinness : 0;
        std::array<double, 3> v = {draw.between(-bend, bend), draw.between(-bend, bend), draw.between(-bend, bend)};
        v[axis] = draw.between(-most * thinness * thinness, most);
        return v;
    };
    scene.length = *std::max_element(size.begin(), size.end());
    scene.wave = scene.length / std::sqrt(E / rho);
    scene.slowest = thinness / scene.wave;
    const int kind = draw.whole(0, 4);
    if (rollers ? kind <= 2 : kind == 0) {
        std::array<double, 3> way = {0, 0, 0};
        way[axis] = draw.between(-0.25 * thinness, 0.4) * strength * length;
        text += printed("[[move]]\nwhere = \"%s\"\naxes = \"%s\"\ntranslate = %s\nover = %.9g\n", high.c_str(),
                        letter.c_str(), numbers(way).c_str(), 20 * scene.wave);
    } else if (kind == 1) {
        std::array<double, 3> way;
        for (double& w : way) {
            w = draw.between(-0.3, 0.3) * strength * length;
        }
        way[axis] = draw.between(-0.25 * thinness, 0.4) * strength * length;
        text += printed("[[move]]\nwhere = \"%s\"\ntranslate = %s\nover = %.9g\n", high.c_str(), numbers(way).c_str(),
                        20 * scene.wave);
    } else if (kind == 2) {
        const double most = slender ? 400 : 60;
        text += printed("[[move]]\nwhere = \"%s\"\nrotate = {axis = \"%s\", degrees = %.9g}\nover = %.9g\n",
                        high.c_str(), letter.c_str(), draw.between(-most, most) * strength, 100 * scene.wave);
    }
    if (kind >= 3 || draw.chance(0.2)) {
        text += printed("[[load]]\nwhere = \"%s\"\nforce = %s\n", high.c_str(),
                        numbers(pulled(0.1 * strength * E * width * width, !rollers)).c_str());
    }
    if (draw.chance(0.4)) {
        // The weight of all pulls the driven end away from the held one, or the little that bends it.
        text += printed("[gravity]\nacceleration = %s\n",
                        numbers(pulled(0.1 * strength * E / (rho * length), !rollers)).c_str());
    }
    text += printed("[[probe]]\nname = \"held\"\nwhere = \"%s\"\n[[probe]]\nname = \"driven\"\nwhere = \"%s\"\n",
                    low.c_str(), high.c_str());
    scene.options = printed("--threads %d", draw.whole(1, 2));
    if (draw.chance(0.5)) {
        scene.options += std::string(" --layout ") + draw.word({"flat-rows", "active-rows", "network"});
    }
    scene.options += draw.chance(0.2) ? " --precision float" : "";
    return scene;
}

/// A scene with whatever else there is: obstacles, cuts, outputs, the other methods. It ends within some 200 steps.
inline RandomScene random_motion(Draw& draw) {
    using random_scene::numbers;
    RandomScene scene = random_scene_of(draw);
    std::string& text = scene.text;
    const int method = draw.whole(0, 5); // mostly explicit
    const double over = draw.between(2, 15) * scene.wave;
    const double L = scene.length;
    if (method >= 2 && draw.chance(0.5)) {
        const std::array<double, 3> below = {0, 0, -draw.between(0, 0.1) * L};
        text += draw.chance(0.5)
                    ? printed("[[obstacle]]\nplane = {point = %s, normal = [0, 0, 1]}\n", numbers(below).c_str())
                : draw.chance(0.5) ? printed("[[obstacle]]\nsphere = {center = %s, radius = %.9g}\n",
                                             numbers({0.3 * L, 0.3 * L, below[2] - L}).c_str(), L)
                                   : printed("[[obstacle]]\nbox = [[%.9g, %.9g, %.9g], [%.9g, %.9g, %.9g]]\n", -L, -L,
                                             -2 * L, L, L, below[2]);
        text += printed("friction = %.9g\nvelocity = %s\n", draw.chance(0.5) ? 0 : draw.between(0, 2),
                        numbers({0, 0, 0.1 * L / over}).c_str());
        text += draw.chance(0.3) ? printed("rotate = {axis = \"y\", degrees = 3}\nover = %.9g\n", over) : "";
    }
    const bool cut = method >= 2 && draw.chance(0.3);
    if (cut) {
        text += printed("[[cut]]\nsphere = {center = %s, radius = %.9g}\nat = %.9g\n",
                        numbers({0.2 * L, 0.2 * L, 0.2 * L}).c_str(), 0.3 * L, 0.5 * over);
    }
    text += printed("[damping]\nmass = %.9g\nstiffness = %.9g\n", draw.between(0, 3) / scene.wave,
                    draw.chance(0.3) ? 0.01 * scene.wave : 0);
    text += printed("[output]\nevery = %.9g\n", over / draw.whole(1, 3));
    text += !cut && method >= 2 && draw.chance(0.2) ? "energy_balance = true\n" : "";
    text += printed("[solver]\nmethod = \"%s\"\nduration = %.9g\n",
                    method == 0   ? "static"
                    : method == 1 ? "backward-euler"
                    : method == 2 ? "leapfrog"
                                  : "symplectic-euler",
                    over);
    text += draw.chance(0.3) ? "tolerance = 1e-3\n" : "";
    return scene;
}

/// A way to damage a scene's text.
struct Damage {
    const char* name;
    std::string (*of)(const std::string& text, Draw& draw);
};

namespace random_scene {

inline std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        lines.push_back(text.substr(at, end - at));
        at = end + 1;
    }
    return lines;
}

inline std::string joined_lines(const std::vector<std::string>& lines) {
    return joined(lines, "\n") + "\n";
}

/// One number of the text is another one.
template <class Other>
std::string with_number(const std::string& text, Draw& draw, const Other& other) {
    std::vector<std::pair<std::size_t, std::size_t>> found; // begin, end
    for (std::size_t at = 0; at < text.size(); ++at) {
        const auto is_in_number = [](char c) {
            return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+' || c == 'e';
        };
        if (std::string(" [,").find(at == 0 ? 'a' : text[at - 1]) == std::string::npos || !is_in_number(text[at]) ||
            text[at] == 'e') {
            continue;
        }
        std::size_t end = at;
        while (end < text.size() && is_in_number(text[end])) {
            ++end;
        }
        found.push_back({at, end});
        at = end;
    }
    const auto [begin, end] = found.at(draw.below(found.size()));
    return text.substr(0, begin) + other(text.substr(begin, end - begin)) + text.substr(end);
}

/// The value of one key is another one.
inline std::string with_value(const std::string& text, Draw& draw, const std::string& value) {
    std::vector<std::string> lines = lines_of(text);
    std::vector<std::size_t> keys;
    for (std::size_t l = 0; l < lines.size(); ++l) {
        if (lines[l].find(" = ") != std::string::npos) {
            keys.push_back(l);
        }
    }
    std::string& line = lines[keys.at(draw.below(keys.size()))];
    line = line.substr(0, line.find(" = ") + 3) + value;
    return joined_lines(lines);
}

} // namespace random_scene

inline const std::array<Damage, 8> kDamages = {{
    {"a line is missing",
     [](const std::string& text, Draw& draw) {
         std::vector<std::string> lines = random_scene::lines_of(text);
         lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(draw.below(lines.size())));
         return random_scene::joined_lines(lines);
     }},
    {"a line stands twice, or elsewhere",
     [](const std::string& text, Draw& draw) {
         std::vector<std::string> lines = random_scene::lines_of(text);
         const std::string line = lines[draw.below(lines.size())];
         lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(draw.below(lines.size())), line);
         return random_scene::joined_lines(lines);
     }},
    {"a number has the other sign",
     [](const std::string& text, Draw& draw) {
         return random_scene::with_number(
             text, draw, [](const std::string& number) { return number[0] == '-' ? number.substr(1) : "-" + number; });
     }},
    {"a number is huge, tiny or none",
     [](const std::string& text, Draw& draw) {
         return random_scene::with_number(text, draw, [&](const std::string&) {
             return std::string(draw.word({"0", "0.0", "-0.0", "1e-300", "5e-324", "1e300", "-1e300", "1e18", "1e-18",
                                           "1.7e308", "nan", "inf", "-inf", "1e400", "9223372036854775807",
                                           "-9223372036854775808", "18446744073709551616", "4294967296", "300"}));
         });
     }},
    {"a number is a thousand times larger or smaller",
     [](const std::string& text, Draw& draw) {
         const double by = draw.one_of({1e-6, 1e-3, 0.1, 10.0, 1e3, 1e6});
         return random_scene::with_number(text, draw, [&](const std::string& number) {
             return printed("%.9g", by * std::strtod(number.c_str(), nullptr));
         });
     }},
    {"a value is of another type",
     [](const std::string& text, Draw& draw) {
         return random_scene::with_value(
             text, draw,
             draw.word({"true", "\"x-max\"", "\"\"", "[]", "[1]", "[1, 2, 3]", "{}", "3", "0.5", "1979-05-27",
                        "[[0, 0, 0], [1, 1, 1]]", "{node = 0}", "{sphere = {center = [0, 0, 0], radius = 1e9}}"}));
     }},
    {"the text ends early",
     [](const std::string& text, Draw& draw) { return text.substr(0, draw.below(text.size())); }},
    {"a few bytes are others",
     [](const std::string& text, Draw& draw) {
         std::string damaged = text;
         for (int b = draw.whole(1, 3); b > 0; --b) {
             damaged[draw.below(damaged.size())] = static_cast<char>(draw.whole(0, 255));
         }
         return damaged;
     }},
}};

} // namespace hybmss::test
