#include "systems/particles/interactions/kinds.hpp"

namespace bs {

std::vector<InteractionMaker>& interaction_makers() {
  static std::vector<InteractionMaker> makers =
      std::apply([](auto... law) { return std::vector<InteractionMaker>{InteractionMaker::of<decltype(law)>()...}; }, InteractionLaws{});
  return makers;
}

}  // namespace bs
