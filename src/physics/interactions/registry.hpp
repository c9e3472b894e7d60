// The laws of several ends. A new one is one header and one line here; its kind is its place in the list.
//
// The data that a law of several ends (2, 3, 4, ...) provides. Its numbers come from a table of named parameters; its functions see
// the places of all its ends at once.
//
//   ends, parameters                how many; schema(): names, units, what is impossible (lattice/spring_laws.hpp)
//   fault<d>(x, p)                  null, or why there is no force with the ends at x[0], ..., x[ends - 1]
//   energy<d>(x, p)                 [J]
//   force<d>(x, p, f)               on every end, (ends, d)
//   tangent<d, positive>(x, p, K)   df_a/dx_b for all pairs of ends, (ends d, ends d); positive: such that -K is semidefinite
//   energy_beyond_slope<d>(x, dx, p)  E(x + dx) - E(x) + f.dx, free of cancellation
//   force_change<d>(x, p, of, f)    df/dp[of] on every end, (ends, d); may be absent: equilibria then have no sensitivities to its numbers
//   change<d>(x, p, &moment)        theta - theta_0 [rad] and dE/dtheta [N m], where the schema `turns`: such interactions can break
//   rates<d>(x, p, rate)            sizes of -df_a/dx_a [N/m], for estimates of rounding errors
//
// Forces depend on places alone, tangents are symmetric. (History of an element would be more numbers in its row of the table.)
#pragma once
#include <tuple>
#include <type_traits>
#include "lattice/spring_laws.hpp"
#include "physics/quadruple/hinge.hpp"
#include "physics/triple/angle_spring.hpp"

namespace bs {

/// The kinds that are there from the start; register_interaction_law (systems/particles/interactions/kinds.hpp) adds others.
using InteractionLaws = std::tuple<AngleSpring, Hinge>;
static_assert(std::is_same_v<std::tuple_element_t<0, InteractionLaws>, AngleSpring>, "generated lattices make angle springs by this place");

/// One more of interaction_schemas().
void add_interaction_schema(const InteractionSchema& schema);

}  // namespace bs
