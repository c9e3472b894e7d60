#include "physics/interactions/registry.hpp"

namespace bs {

template <class... Laws>
static constexpr bool fit_records(const std::tuple<Laws...>*) {
  return ((Laws::ends <= MOST_ENDS && Laws::parameters <= MOST_INTERACTION_PARAMETERS) && ...);
}
static_assert(fit_records(static_cast<const InteractionLaws*>(nullptr)), "records hold fewer ends or parameters than a law has");

static std::vector<InteractionSchema>& known_schemas() {
  static std::vector<InteractionSchema> schemas =
      std::apply([](auto... law) { return std::vector<InteractionSchema>{decltype(law)::schema()...}; }, InteractionLaws{});
  return schemas;
}

const std::vector<InteractionSchema>& interaction_schemas() { return known_schemas(); }

void add_interaction_schema(const InteractionSchema& schema) { known_schemas().push_back(schema); }

}  // namespace bs
