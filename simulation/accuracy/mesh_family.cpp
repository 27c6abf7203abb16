#include "simulation/accuracy/mesh_family.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace hybmss {

std::array<std::int64_t, 3> whole_ratio(const std::array<double, 3>& size) {
    constexpr std::int64_t kMost = 1000;
    constexpr double kRounding = 1e-9;
    const double shortest = *std::min_element(size.begin(), size.end());
    for (std::int64_t across = 1; across <= kMost; ++across) {
        std::array<std::int64_t, 3> whole = {0, 0, 0};
        bool fits = true;
        for (std::size_t a = 0; a < 3; ++a) {
            const double cells = size[a] / shortest * static_cast<double>(across);
            fits = fits && cells < 0.5 + kMost && std::abs(cells - std::round(cells)) <= kRounding * cells;
            whole[a] = fits ? std::llround(cells) : 0;
        }
        if (fits) {
            return whole;
        }
    }
    return {0, 0, 0};
}

MeshFamily::MeshFamily(const Scene& scene) : body_(scene.body) {
    const auto& size = body_.size;
    free_ = size[0] > 0 && body_.cell_size == 0;
    if (free_) {
        unit_ = whole_ratio(size);
        if (unit_[0] == 0) {
            throw scene_error(scene, "body.size",
                              "no cubes of one size fill it: its edges must be in a ratio of whole numbers up to 1000");
        }
        unit_edge_ = size[0] / static_cast<double>(unit_[0]);
        return;
    }
    unit_ = body_.cells;
    unit_edge_ = body_.cell_size;
    if (body_.labels.empty()) {
        own_ = std::gcd(std::gcd(unit_[0], unit_[1]), unit_[2]);
        for (std::int64_t& n : unit_) {
            n /= own_;
        }
        unit_edge_ *= static_cast<double>(own_);
    }
}

std::int64_t MeshFamily::multiple_of(std::int64_t cells_across) const {
    const std::int64_t across = *std::min_element(unit_.begin(), unit_.end());
    return std::max<std::int64_t>(1, (cells_across + across - 1) / across);
}

std::array<std::int64_t, 3> MeshFamily::cells(std::int64_t multiple) const {
    return {unit_[0] * multiple, unit_[1] * multiple, unit_[2] * multiple};
}

SceneBody MeshFamily::body(std::int64_t multiple) const {
    SceneBody body = body_;
    body.cells = cells(multiple);
    body.cell_size = cell_size(multiple);
    if (!body_.labels.empty() && multiple != 1) {
        const auto [nx, ny, nz] = body.cells;
        body.labels.clear();
        body.labels.reserve(static_cast<std::size_t>(nx * ny * nz));
        for (std::int64_t k = 0; k < nz; ++k) {
            for (std::int64_t j = 0; j < ny; ++j) {
                for (std::int64_t i = 0; i < nx; ++i) {
                    const std::int64_t own = i / multiple + unit_[0] * (j / multiple + unit_[1] * (k / multiple));
                    body.labels.push_back(body_.labels[static_cast<std::size_t>(own)]);
                }
            }
        }
    }
    return body;
}

} // namespace hybmss
