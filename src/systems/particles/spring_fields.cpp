#include "systems/particles/spring_fields.hpp"
#include <cmath>
#include <limits>
#include "base/options.hpp"
#include "base/vec_array.hpp"
#include "lattice/spring_laws.hpp"
#include "systems/particles/spring_exists.hpp"

namespace bs {

namespace {

constexpr double none = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t many = 1000000;  // springs: a frame of their strains is 8 MB

}  // namespace

PetscErrorCode SpringFields::create(const Network& net, const Lattice& lattice) {
  PetscFunctionBegin;
  net_ = &net;
  rows_ = lattice.springs;
  strain_ = net.springs_total <= many;
  PetscCall(read_section(net.comm, "Fields of a frame", [&](Section& o) {
    o.flag("-bs_output_springs",
           "write tension [N] and strain [1] of every spring to every frame, and the stress [Pa] where the lattice file has /springs/area", carried_);
    if (carried_) strain_ = false;  // it is among these
    o.flag("-bs_output_strain",
           "write the strain (l - L)/L of every spring to every frame; default: true up to a million springs and without -bs_output_springs [1]",
           strain_);
  }));
  strain_ = strain_ && net.springs_total > 0;
  carried_ = carried_ && net.springs_total > 0;
  stressed_ = carried_ && lattice.has_area();
  if (stressed_) area_ = lattice.area.value;
  PetscFunctionReturn(0);
}

// strain = (l - L)/L, l = |x_j - x_i|, of springs that there are
PetscErrorCode SpringFields::fields(const Terms& terms, const LocalState& state, std::vector<Field>* out) {
  PetscFunctionBegin;
  if (!active()) PetscFunctionReturn(0);
  if (!table_.created()) PetscCall(table_.create(*net_, rows_));
  const auto strain = [&](PetscInt i, PetscInt e) {
    const double *a = state.at(i), *b = state.at(net_->links.other[e]);
    const double rest = net_->links.rest_length[e];
    double square = 0;
    for (int c = 0; c < net_->dim; ++c) square += (b[c] - a[c]) * (b[c] - a[c]);
    return rest > 0 && exists(*net_, e) ? (std::sqrt(square) - rest) / rest : none;
  };
  if (carried_) {
    const auto both = [&](std::size_t count, const PetscInt* i, const PetscInt* e, double(*numbers)[SpringTable::BLOCK]) {
      terms.pairs().measure(state, count, i, e, numbers[0], numbers[1]);
      for (std::size_t s = 0; s < count; ++s) {
        const double rest = net_->links.rest_length[e[s]];
        const bool there = exists(*net_, e[s]);
        numbers[0][s] = there && rest > 0 ? (numbers[0][s] - rest) / rest : none;
        if (!there) numbers[1][s] = none;
      }
    };
    PetscCall(table_.gather<2>(both, {&strains_, &tensions_}));
  } else {
    PetscCall(table_.gather(strain, &strains_));
  }
  if (strain_) out->push_back({"/backspring/strain", strains_, true, {}, true});
  if (carried_) PetscCall(add_carried(out));
  PetscFunctionReturn(0);
}

// tension T of the spring's law, without its damper; stress T/A
PetscErrorCode SpringFields::add_carried(std::vector<Field>* out) {
  const std::string group = "/observables/springs/";
  PetscFunctionBegin;
  out->push_back({group + "tension", tensions_, true, {}, true, false, {1, 1, -2}});
  out->push_back({group + "strain", strains_, true, {}, true});
  if (!stressed_) PetscFunctionReturn(0);
  if (!stresses_) PetscCall(VecDuplicate(tensions_, stresses_.out()));
  const ReadArray T(tensions_);
  const WriteArray stress(stresses_);
  for (std::size_t k = 0; k < area_.size(); ++k) stress[static_cast<PetscInt>(k)] = T[static_cast<PetscInt>(k)] / area_[k];
  out->push_back({group + "stress", stresses_, true, {}, true, false, {1, -1, -2}});
  PetscFunctionReturn(0);
}

}  // namespace bs
