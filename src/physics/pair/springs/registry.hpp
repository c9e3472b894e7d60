// The laws of springs and of dampers by name. A new law is one header and one line here: readers, options, -help, header lines,
// trajectories, checkpoints and the loops take names, parameters and history from these lists. Append: a law's place in the list
// is part of the fingerprints in checkpoints.
#pragma once
#include <algorithm>
#include <string>
#include <tuple>
#include <utility>
#include <vector>
#include "physics/pair/dampers/axial.hpp"
#include "physics/pair/dampers/simple.hpp"
#include "physics/pair/springs/plastic.hpp"
#include "physics/pair/springs/polynomial.hpp"
#include "physics/pair/springs/spring.hpp"
#include "physics/pair/springs/tension.hpp"

namespace bs {

using SpringLaws = std::tuple<HookeSpring, StrainSpring, TensionSpring, PolynomialSpring, PlasticSpring>;
using DamperLaws = std::tuple<AxialDamper, SimpleDamper>;

/// What the program asks of a law that it knows by its place.
struct SpringLawInfo {
  const char *name, *title;
  std::vector<SpringParameter> parameters;
  std::vector<SpringHistory> history;
  bool zero_rest, softens;
  std::size_t width() const { return parameters.size() + history.size(); }
};

template <class... Law>
std::vector<SpringLawInfo> describe_springs(const std::tuple<Law...>&) {
  return {{Law::name,
           Law::title,
           {Law::parameters.begin(), Law::parameters.end()},
           {Law::history.begin(), Law::history.end()},
           Law::zero_rest,
           Law::softens}...};
}

template <class... Law>
constexpr std::size_t widest(const std::tuple<Law...>*) {
  return std::max({Law::parameters.size() + Law::history.size()...});
}
/// The most numbers that any law takes beyond stiffness and rest length.
constexpr std::size_t SPRING_WIDTH = widest(static_cast<SpringLaws*>(nullptr));

/// All spring laws, in the list's order.
inline const std::vector<SpringLawInfo>& spring_laws() {
  static const std::vector<SpringLawInfo> laws = describe_springs(SpringLaws{});
  return laws;
}

/// Name and formula of all dampers' laws, in the list's order.
inline const std::vector<std::pair<std::string, std::string>>& damper_laws() {
  static const auto laws = std::apply(
      [](auto... law) {
        return std::vector<std::pair<std::string, std::string>>{{law.name, law.title}...};
      },
      DamperLaws{});
  return laws;
}

inline std::vector<std::string> spring_law_names() {
  std::vector<std::string> names;
  for (const SpringLawInfo& law : spring_laws()) names.emplace_back(law.name);
  return names;
}

inline std::vector<std::string> damper_law_names() {
  std::vector<std::string> names;
  for (const auto& law : damper_laws()) names.push_back(law.first);
  return names;
}

/// Every parameter that some law takes, each name once.
inline std::vector<SpringParameter> spring_parameters() {
  std::vector<SpringParameter> all;
  const auto known = [&](const std::string& name) {
    for (const SpringParameter& one : all)
      if (name == one.name) return true;
    return false;
  };
  for (const SpringLawInfo& law : spring_laws())
    for (const SpringParameter& parameter : law.parameters)
      if (!known(parameter.name)) all.push_back(parameter);
  return all;
}

/// Names of all histories that some law has, each once.
inline std::vector<std::string> spring_histories() {
  std::vector<std::string> all;
  for (const SpringLawInfo& law : spring_laws())
    for (const SpringHistory& one : law.history)
      if (std::find(all.begin(), all.end(), one.name) == all.end()) all.emplace_back(one.name);
  return all;
}

template <class F, std::size_t... I>
inline void with_spring_law(int place, F&& f, std::index_sequence<I...>) {
  (void)((place == static_cast<int>(I) ? (f(std::tuple_element_t<I, SpringLaws>{}), true) : false) || ...);
}

/// Calls f(law) with the law at `place` of the list.
template <class F>
inline void with_spring_law(int place, F&& f) {
  with_spring_law(place, std::forward<F>(f), std::make_index_sequence<std::tuple_size_v<SpringLaws>>{});
}

}  // namespace bs
