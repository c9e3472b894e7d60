// What springs remember, how they break, and what their forces change by with their numbers, in any number of dimensions.
#include <algorithm>
#include "base/handle.hpp"
#include "lattice/spring_laws.hpp"
#include "systems/frame_rows.hpp"
#include "systems/particles/physics.hpp"

namespace bs {
namespace {

/// Which number of each law that is (physics/pair/springs/law.hpp); -1: it has none of that name.
std::vector<int> places(const std::string& name) {
  std::vector<int> all;
  for (const SpringLawInfo& law : spring_laws()) {
    int at = name == "stiffness" ? 0 : name == "rest_length" ? 1 : -1;
    for (std::size_t k = 0; k < law.parameters.size(); ++k)
      if (name == law.parameters[k].name) at = 2 + static_cast<int>(k);
    all.push_back(at);
  }
  return all;
}

}  // namespace

PetscErrorCode PairForces::remember(Network& net, const Lattice& lattice, const BreakRules& rules) {
  PetscFunctionBegin;
  springs_ = lattice.springs;
  PetscCall(memory_.create(net, springs_));
  if (!rules.active(lattice)) PetscFunctionReturn(0);
  breaks_ = std::make_unique<SpringBreaks>();
  PetscCall(breaks_->create(net, lattice, rules, *this));
  choose_loops();
  PetscFunctionReturn(0);
}

PetscErrorCode PairForces::accept(const Step& step, const LocalState& state) {
  PetscFunctionBegin;
  if (!memory_.active()) PetscFunctionReturn(0);
  commit(state, step.h, &memory_.net().links);
  PetscCall(memory_.accept(step.t));
  PetscFunctionReturn(0);
}

// the spring between i and j exerts -T u on i and T u on j, u from j to i
PetscErrorCode PairForces::force_changes(const std::string& name, const LocalState& state, const LocalState& lambda, std::vector<double>* rows) {
  const Network& net = memory_.net();
  const Links& links = net.links;
  const std::vector<int> place = places(name);
  VecHandle found;
  PetscFunctionBegin;
  if (std::all_of(place.begin(), place.end(), [](int at) { return at < 0; })) PetscFunctionReturn(0);
  if (!numbers_.created()) PetscCall(numbers_.create(net, springs_));
  const auto value = [&](PetscInt i, PetscInt e) {
    double change[3] = {0, 0, 0}, sum = 0;
    const int of = place[links.law.empty() ? static_cast<std::size_t>(net.spring_law) : links.law[static_cast<std::size_t>(e)]];
    if (of < 0 || links.is_broken(e)) return 0.0;
    pull_change(state, i, e, of, change);
    const double *a = lambda.at(i), *b = lambda.at(links.other[e]);
    for (int c = 0; c < net.dim; ++c) sum -= (a[c] - b[c]) * change[c];
    return sum;
  };
  PetscCall(numbers_.gather(value, &found));
  PetscCall(own_numbers(found, rows));
  PetscFunctionReturn(0);
}

}  // namespace bs
