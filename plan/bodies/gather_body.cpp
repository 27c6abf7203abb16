#include "plan/bodies/gather_body.hpp"

#include "plan/bodies/plan_description.hpp"

namespace hybmss {

template <class T>
GatherBody<T>::GatherBody(const Lattice& lattice, const Material& material, const PlanOptions& options)
    : LatticeBody<T>(lattice, material, options, kGatherRows) {}

template <class T>
Stage GatherBody<T>::gathering(State<T>& state) const {
    const auto kernel = this->table().gather->plane[this->face_diagonals()][static_cast<int>(this->volume())]
                                                   [static_cast<int>(this->accuracy())];
    return {this->layout().planes,
            [this, &state, kernel](std::size_t k, std::size_t) { kernel(this->plane_at(state, k)); }};
}

template <class T>
std::vector<Stage> GatherBody<T>::force_stages(State<T>& state) const {
    this->allocate_forces(state);
    return {gathering(state)};
}

template <class T>
std::vector<Stage> GatherBody<T>::step_stages(State<T>& state, const StepParameters& parameters) const {
    return {gathering(state), this->integration(state, parameters)};
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
