// The lists of laws as readers, writers and checks see them (lattice/spring_laws.hpp).
#include "physics/interactions/registry.hpp"
#include <algorithm>
#include "physics/pair/springs/registry.hpp"

namespace bs {

template <class... Law>
static constexpr std::size_t widest(const std::tuple<Law...>*) {
  return std::max({Law::parameters.size() + Law::history.size()...});
}
static_assert(widest(static_cast<SpringLaws*>(nullptr)) == SPRING_WIDTH, "SPRING_WIDTH is what the widest law takes");

template <class... Law>
static std::vector<SpringLawInfo> describe_springs(const std::tuple<Law...>&) {
  return {{Law::name,
           Law::title,
           {Law::parameters.begin(), Law::parameters.end()},
           {Law::history.begin(), Law::history.end()},
           Law::zero_rest,
           Law::softens,
           Law::relaxes}...};
}

const std::vector<SpringLawInfo>& spring_laws() {
  static const std::vector<SpringLawInfo> laws = describe_springs(SpringLaws{});
  return laws;
}

const std::vector<std::pair<std::string, std::string>>& damper_laws() {
  static const auto laws = std::apply(
      [](auto... law) {
        return std::vector<std::pair<std::string, std::string>>{{law.name, law.title}...};
      },
      DamperLaws{});
  return laws;
}

double spring_rate_at_rest(std::size_t place, double k, double L, const double* more) {
  double rate = 0;
  with_spring_law(static_cast<int>(place), [&](auto law) {
    using Law = decltype(law);
    rate = with_more<Law>(more, 0, [&](auto... all) { return spring_rate<Law>(k, L, all...); });
  });
  return rate;
}

std::vector<std::string> spring_law_names() {
  std::vector<std::string> names;
  for (const SpringLawInfo& law : spring_laws()) names.emplace_back(law.name);
  return names;
}

std::vector<std::string> damper_law_names() {
  std::vector<std::string> names;
  for (const auto& law : damper_laws()) names.push_back(law.first);
  return names;
}

template <class Number>
static std::vector<Number> each_once(std::vector<Number> SpringLawInfo::*numbers) {
  std::vector<Number> all;
  for (const SpringLawInfo& law : spring_laws())
    for (const Number& one : law.*numbers)
      if (std::none_of(all.begin(), all.end(), [&](const Number& known) { return std::string(known.name) == one.name; })) all.push_back(one);
  return all;
}

std::vector<SpringParameter> spring_parameters() { return each_once<SpringParameter>(&SpringLawInfo::parameters); }

std::vector<SpringHistory> spring_histories() { return each_once<SpringHistory>(&SpringLawInfo::history); }

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
