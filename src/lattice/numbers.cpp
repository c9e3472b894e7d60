#include <algorithm>
#include "base/text.hpp"
#include "lattice/lattice.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {
namespace {

/// What is wrong with `now` in the place of `before`; null: nothing.
const char* fault_of(const std::string& name, double before, double now) {
  if (!usable(now)) return "give finite numbers up to 1e150";
  if (name == "mass") return now > 0 ? nullptr : "give masses > 0 [kg]";
  if (name == "stiffness") return now >= 0 ? nullptr : "give stiffnesses >= 0";
  if (name == "damping") {
    if (now < 0) return "give numbers >= 0 [kg/s]";
    return now > 0 && before == 0 ? "a spring that was made without a damper has none: make another lattice" : nullptr;
  }
  if (name == "rest_length") {
    if (now < 0) return "give lengths >= 0 [m]";
    return (now == 0) != (before == 0) ? "a spring of rest length 0 obeys another law: make another lattice" : nullptr;
  }
  for (const SpringParameter& one : spring_parameters())
    if (name == one.name) return now < 0 && one.nonnegative ? "give numbers >= 0" : now == 0 && one.positive ? "give numbers > 0" : nullptr;
  return nullptr;
}

/// The same of the number of interaction k, beside the others that it takes.
const char* interaction_fault_of(const NumberColumn& column, int dim, std::size_t k, double now) {
  const InteractionSchema& schema = interaction_schemas()[static_cast<std::size_t>(column.kind)];
  const char* remedy = nullptr;
  double p[MOST_INTERACTION_PARAMETERS];
  if (!usable(now)) return "give finite numbers up to 1e150";
  std::copy_n(column.table->data() + k * column.width, column.width, p);
  p[column.first] = now;
  return schema.bad_parameter(p, dim, &remedy) < 0 ? nullptr : remedy;
}

}  // namespace

std::string number_name(const InteractionSchema& schema, std::size_t place) {
  return std::string(schema.group) + "_" + schema.parameters[place].name;
}

InteractionNumber interaction_number(const std::string& name) {
  const std::vector<InteractionSchema>& schemas = interaction_schemas();
  for (std::size_t kind = 0; kind < schemas.size(); ++kind)
    for (std::size_t p = 0; p < schemas[kind].parameters.size(); ++p)
      if (name == number_name(schemas[kind], p)) return {static_cast<int>(kind), p};
  return {};
}

/// Of each law, whether it takes a number of that name; all do where that is none of a law's own.
static std::vector<bool> laws_that_take(const std::string& name) {
  std::vector<bool> all;
  for (const SpringLawInfo& law : spring_laws())
    all.push_back(std::any_of(law.parameters.begin(), law.parameters.end(), [&](const SpringParameter& one) { return name == one.name; }));
  if (std::find(all.begin(), all.end(), true) == all.end()) all.assign(all.size(), true);
  return all;
}

std::vector<double> NumberColumn::values() const {
  std::vector<double> all(size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = (*this)[k];
  return all;
}

void NumberColumn::assign(const std::vector<double>& values) const {
  for (std::size_t k = 0; k < values.size(); ++k) (*this)[k] = values[k];
}

NumberColumn changeable_numbers(Lattice* lattice, const std::string& name) {
  if (name == "mass") return {&lattice->mass};
  if (name == "stiffness") return {&lattice->stiffness};
  if (name == "rest_length") return {&lattice->rest_length};
  if (name == "damping") return {&lattice->damping};
  for (const SpringParameter& one : spring_parameters())
    if (name == one.name)
      for (Column& column : lattice->spring_columns)
        if (column.name == name) return {&column.value};
  const InteractionNumber one = interaction_number(name);
  const std::size_t kind = static_cast<std::size_t>(one.kind);
  if (one.kind < 0 || kind >= lattice->interactions.size() || lattice->interactions[kind].rows.total == 0) return {};
  return {&lattice->interactions[kind].parameter, one.place, interaction_schemas()[kind].parameters.size(), one.kind};
}

std::vector<std::string> interaction_numbers(const Lattice& lattice) {
  std::vector<std::string> names;
  for (std::size_t kind = 0; kind < lattice.interactions.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    for (std::size_t p = 0; p < schema.parameters.size() && lattice.interactions[kind].rows.total > 0; ++p) names.push_back(number_name(schema, p));
  }
  return names;
}

// What a law takes no number of that name for is 0, as in a lattice that is read.
bool change_numbers(Lattice* lattice, const std::string& name, const std::vector<double>& given, std::string* why) {
  std::vector<double> all = given;
  const NumberColumn column = changeable_numbers(lattice, name);
  if (!column) {
    *why =
        "numbers called " + name + " are not the lattice's, or cannot be changed: name stiffness, rest_length, damping, mass or what its laws take";
    return false;
  }
  const char* const of = column.kind >= 0 ? interaction_schemas()[static_cast<std::size_t>(column.kind)].title
                         : name == "mass" ? "particle"
                                          : "spring";
  if (all.size() != column.size()) {
    *why = format("%zu numbers called %s for %s", all.size(), name.c_str(),
                  how_many(static_cast<std::int64_t>(column.size()), std::string(of) + "{s}").c_str());
    return false;
  }
  const std::vector<bool> takes = laws_that_take(name);
  const bool by_law = std::find(takes.begin(), takes.end(), false) != takes.end();
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (by_law && !takes[lattice->spring_laws.empty() ? static_cast<std::size_t>(lattice->spring_law) : lattice->spring_laws[k]]) {
      all[k] = 0;
      continue;
    }
    if (const char* fault = column.kind >= 0 ? interaction_fault_of(column, lattice->dim, k, all[k]) : fault_of(name, column[k], all[k])) {
      *why = format("%s %zu: %s %g; %s", of, k, name.c_str(), all[k], fault);
      return false;
    }
  }
  column.assign(all);
  return true;
}

}  // namespace bs
