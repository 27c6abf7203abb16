#include "plan/gather_body.hpp"

#include "plan/plan_description.hpp"

namespace hybmss {

template <class T>
GatherBody<T>::GatherBody(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : LatticeBody<T>(lattice, material, options, kGatherRows) {}

template <class T>
State<T> GatherBody<T>::make_state(bool moving) const {
    State<T> state = LatticeBody<T>::make_state(moving);
    if (moving) {
        this->allocate_forces(state);
    }
    return state;
}

template <class T>
kernels::LatticeLayer<T> GatherBody<T>::plane_at(State<T>& state, std::size_t k) const {
    kernels::LatticeLayer<T> plane = this->layer_at(state, k);
    for (std::size_t c = 0; c < 3; ++c) {
        plane.partial[c] = state.force[this->layout().axes[c]].data() + this->layout().begin[k];
    }
    return plane;
}

template <class T>
Stage GatherBody<T>::gathering(State<T>& state) const {
    const auto kernel = this->table().gather->plane[this->face_diagonals()][static_cast<int>(this->volume())]
                                                   [static_cast<int>(this->accuracy())];
    return {this->layout().planes, [this, &state, kernel](std::size_t k, std::size_t) { kernel(plane_at(state, k)); }};
}

template <class T>
void GatherBody<T>::compute_forces(State<T>& state) const {
    this->allocate_forces(state);
    const Stage stage = gathering(state);
    this->workers().run({&stage, 1}, 1);
}

template <class T>
std::vector<Stage> GatherBody<T>::step_stages(State<T>& state, const StepParameters& parameters) const {
    const kernels::StepConstants<T> constants = this->constants_along_axes(parameters);
    const auto integrate = this->table().gather->integrate[is_driven(parameters)];
    return {gathering(state), {this->layout().planes, [this, &state, constants, integrate](std::size_t k, std::size_t) {
                                   kernels::LatticeLayer<T> plane = plane_at(state, k);
                                   plane.step = constants;
                                   integrate(plane);
                               }}};
}

template <class T>
PlanDescription GatherBody<T>::describe() const {
    PlanDescription d = LatticeBody<T>::describe();
    d.kernel = "gather_plane" + kernel_variant(this->face_diagonals(), this->volume(), this->accuracy());
    d.tiles = this->layout().planes;
    return d;
}

template class GatherBody<float>;
template class GatherBody<double>;

} // namespace hybmss
