#include "solvers/multigrid/float_multigrid.hpp"

#include "plan/bodies/layout_table.hpp"

#include <algorithm>
#include <cmath>

namespace hybmss {
namespace {

/// Its Young's modulus, Pa.
constexpr double kModulus = 1e4;

Material scaled(Material material, double scale) {
    material.young_modulus *= scale;
    return material;
}

/// Whether the nodes of two bodies have the same places, and the fields as many arrays.
template <class From, class To>
bool same_places(const Body<From>& a, const NodeField<From>& of_a, const Body<To>& b, const NodeField<To>& of_b) {
    bool same = a.node_count() == b.node_count();
    for (std::size_t c = 0; c < 3; ++c) {
        same = same && of_a[c].size() == of_b[c].size();
    }
    for (std::size_t n = 0; same && n < a.node_count(); ++n) {
        same = a.index_of(n) == b.index_of(n);
    }
    return same;
}

/// to = factor from
template <class From, class To>
void convert(const NodeField<From>& from, double factor, NodeField<To>& to, const Workers& workers) {
    constexpr std::size_t kPiece = 4096;
    for (std::size_t c = 0; c < 3; ++c) {
        const From* in = from[c].data();
        To* out = to[c].data();
        const std::size_t size = from[c].size();
        workers.run((size + kPiece - 1) / kPiece, [&](std::size_t piece, std::size_t) {
            for (std::size_t n = piece * kPiece; n < std::min((piece + 1) * kPiece, size); ++n) {
                out[n] = static_cast<To>(factor * static_cast<double>(in[n]));
            }
        });
    }
}

} // namespace

FloatMultigrid::FloatMultigrid(const Body<double>& body, const Lattice& lattice, const Material& material,
                               const PlanOptions& choice, const Ranks* ranks)
    : given_(&body), scale_(kModulus / material.young_modulus),
      body_(make_body<float>(lattice, scaled(material, scale_), choice)), state_(body_->make_state(false)),
      potential_(*body_, BodyScales::of(lattice, scaled(material, scale_)), {}, {}),
      multigrid_(*body_, lattice, scaled(material, scale_), ranks), in_(potential_.space().make()),
      out_(potential_.space().make()),
      same_places_(same_places(body, body.make_state(false).displacement, *body_, state_.displacement)) {
    if (!same_places_) {
        floats_.resize(3 * body.node_count());
        doubles_.resize(floats_.size());
    }
    if (ranks) {
        potential_.share(lattice, *ranks);
    }
}

void FloatMultigrid::to_float(const NodeField<double>& from, double factor, NodeField<float>& to) {
    if (same_places_) {
        return convert(from, factor, to, body_->workers());
    }
    const std::size_t nodes = given_->node_count();
    given_->read(from, factor, VectorField<double>::aos(doubles_.data(), nodes));
    std::transform(doubles_.begin(), doubles_.end(), floats_.begin(), [](double x) { return static_cast<float>(x); });
    body_->write(VectorField<const float>::aos(floats_.data(), nodes), 1, to);
}

void FloatMultigrid::update(const Potential<double>& potential) {
    space_ = &potential.space();
    const auto& held = potential.held();
    if (!std::equal(held.begin(), held.end(), held_.begin(), held_.end())) {
        held_.assign(held.begin(), held.end());
        std::vector<PrescribedNode> supports;
        for (std::size_t n = 0; n < held_.size(); ++n) {
            if (held_[n] != 0) {
                supports.push_back({static_cast<std::uint32_t>(n), held_[n], {}, {}});
            }
        }
        potential_.prescribe(supports);
    }
    if (potential.pull_strength() > 0) {
        floats_.resize(3 * held_.size()); // where to does not matter
        potential_.pull(scale_ * potential.pull_strength(),
                        VectorField<const float>::aos(floats_.data(), held_.size()));
    } else {
        potential_.release();
    }
    to_float(potential.displacement(), 1, state_.displacement);
    potential_.touch(potential.touched(), scale_ * body_->length_unit() / given_->length_unit());
    potential_.linearise(state_);
    multigrid_.update(potential_);
}

void FloatMultigrid::apply(const NodeVector<double>& r, NodeVector<double>& z) {
    const double largest = space_->largest_component(r);
    const double size = largest > 0 && std::isfinite(largest) ? largest : 1;
    to_float(r.field, 1 / size, in_.field);
    multigrid_.apply(in_, out_);
    if (same_places_) {
        return convert(out_.field, scale_ * size, z.field, body_->workers());
    }
    const std::size_t nodes = given_->node_count();
    body_->read(out_.field, 1, VectorField<float>::aos(floats_.data(), nodes));
    std::transform(floats_.begin(), floats_.end(), doubles_.begin(),
                   [by = scale_ * size](float x) { return by * static_cast<double>(x); });
    given_->write(VectorField<const double>::aos(doubles_.data(), nodes), 1, z.field);
}

std::vector<double> FloatMultigrid::memory() const {
    const std::vector<float> values = multigrid_.memory();
    return {values.begin(), values.end()};
}

void FloatMultigrid::set_memory(const VectorSpace<double>&, std::span<const double> values) {
    multigrid_.set_memory(potential_.space(), std::vector<float>(values.begin(), values.end()));
}

} // namespace hybmss
