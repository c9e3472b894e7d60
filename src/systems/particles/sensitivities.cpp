#include "systems/particles/sensitivities.hpp"
#include "lattice/spring_laws.hpp"
#include "systems/frame_rows.hpp"

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

// the spring between i and j exerts -T u on i and T u on j, u from j to i
PetscErrorCode Sensitivities::find(const Network& net, const Rows& springs, const Terms& terms, const std::string& name, const LocalState& state,
                                   const LocalState& lambda, std::vector<double>* out) {
  const Links& links = net.links;
  const std::vector<int> place = places(name);
  PetscFunctionBegin;
  if (!table_.created()) PetscCall(table_.create(net, springs));
  const auto value = [&](PetscInt i, PetscInt e) {
    double pull[3] = {0, 0, 0}, sum = 0;
    const int of = place[links.law.empty() ? static_cast<std::size_t>(net.spring_law) : links.law[static_cast<std::size_t>(e)]];
    if (of < 0 || links.is_broken(e)) return 0.0;
    terms.pairs().pull_change(state, i, e, of, pull);
    const double *a = lambda.at(i), *b = lambda.at(links.other[e]);
    for (int c = 0; c < net.dim; ++c) sum -= (a[c] - b[c]) * pull[c];
    return sum;
  };
  PetscCall(table_.gather(value, &rows_));
  PetscCall(own_numbers(rows_, out));
  PetscFunctionReturn(0);
}

}  // namespace bs
