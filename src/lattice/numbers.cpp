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

}  // namespace

std::vector<double>* changeable_numbers(Lattice* lattice, const std::string& name) {
  if (name == "mass") return &lattice->mass;
  if (name == "stiffness") return &lattice->stiffness;
  if (name == "rest_length") return &lattice->rest_length;
  if (name == "damping") return &lattice->damping;
  for (const SpringParameter& one : spring_parameters())
    if (name == one.name)
      for (Column& column : lattice->spring_columns)
        if (column.name == name) return &column.value;
  return nullptr;
}

bool change_numbers(Lattice* lattice, const std::string& name, const std::vector<double>& all, std::string* why) {
  std::vector<double>* const column = changeable_numbers(lattice, name);
  const char* const of = name == "mass" ? "particle" : "spring";
  if (!column) {
    *why =
        "numbers called " + name + " are not the lattice's, or cannot be changed: name stiffness, rest_length, damping, mass or what its law takes";
    return false;
  }
  if (all.size() != column->size()) {
    *why = format("%zu numbers called %s for %s", all.size(), name.c_str(),
                  how_many(static_cast<std::int64_t>(column->size()), std::string(of) + "{s}").c_str());
    return false;
  }
  for (std::size_t k = 0; k < all.size(); ++k)
    if (const char* fault = fault_of(name, (*column)[k], all[k])) {
      *why = format("%s %zu: %s %g; %s", of, k, name.c_str(), all[k], fault);
      return false;
    }
  *column = all;
  return true;
}

}  // namespace bs
