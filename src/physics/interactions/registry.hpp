// The laws of several ends. A new one is one header and one line here; its kind is its place in the list.
#pragma once
#include <tuple>
#include <type_traits>
#include <vector>

#include "physics/triple/angle_spring.hpp"

namespace bs {

using InteractionLaws = std::tuple<AngleSpring>;
static_assert(std::is_same_v<std::tuple_element_t<0, InteractionLaws>, AngleSpring>, "generated lattices make angle springs by this place");

/// One for each kind, in the list's order.
inline const std::vector<InteractionSchema>& interaction_schemas() {
  static const std::vector<InteractionSchema> schemas =
      std::apply([](auto... law) { return std::vector<InteractionSchema>{decltype(law)::schema()...}; }, InteractionLaws{});
  return schemas;
}

}  // namespace bs
