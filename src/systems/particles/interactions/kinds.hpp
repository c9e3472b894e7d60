// The kinds of interactions between several particles: those of the registry, and laws that a program on the library brings along.
#pragma once
#include <memory>
#include <string>
#include <vector>
#include "physics/interactions/registry.hpp"
#include "systems/particles/interactions/interaction.hpp"

namespace bs {

/// Makes the term of one law in a plane or in space from a table of its interactions.
struct InteractionMaker {
  using Make = std::unique_ptr<Term> (*)(const Network&, const InteractionTable&);
  Make plane, space;
  template <class Law>
  static InteractionMaker of() {
    return {make<Law, 2>, make<Law, 3>};
  }

 private:
  template <class Law, int d>
  static std::unique_ptr<Term> make(const Network& net, const InteractionTable& table) {
    return std::make_unique<Interaction<Law, d>>(net, table);
  }
};

/// By kind, in the order of interaction_schemas().
std::vector<InteractionMaker>& interaction_makers();

/// Makes a law of 2 to 4 ends known to the process, before the first lattice that has such interactions: a type with what
/// physics/interactions/registry.hpp lists. Lattices then hold its interactions under the name of its group and an s, in memory
/// (LatticeArrays::interactions) and in files; all that is made of angle springs is made of them, too. Once more is once.
template <class Law>
void register_interaction_law() {
  static_assert(Law::ends >= 2 && Law::ends <= MOST_ENDS && Law::parameters <= MOST_INTERACTION_PARAMETERS,
                "a law has 2 to MOST_ENDS ends and at most MOST_INTERACTION_PARAMETERS parameters");
  std::vector<InteractionMaker>& makers = interaction_makers();
  for (const InteractionSchema& schema : interaction_schemas())
    if (std::string(schema.group) == Law::schema().group) return;
  add_interaction_schema(Law::schema());
  makers.push_back(InteractionMaker::of<Law>());
}

}  // namespace bs
