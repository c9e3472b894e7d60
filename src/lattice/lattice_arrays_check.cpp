// What of arrays in memory makes no lattice: sizes that do not fit one another, and what readers of files refuse before any value is judged.
#include <algorithm>
#include "base/text.hpp"
#include "lattice/columns.hpp"
#include "lattice/groups.hpp"
#include "lattice/lattice_arrays.hpp"
#include "lattice/spring_laws.hpp"
#include "lattice/xsp.hpp"

namespace bs {
namespace {

/// Keeps the first fault.
class Check {
 public:
  explicit Check(const LatticeArrays& arrays)
      : a_(arrays), d_(static_cast<std::size_t>(arrays.dim)), n_(arrays.mass.size()), s_(arrays.stiffness.size()) {}

  std::string run() {
    if (a_.dim < 1 || a_.dim > 3) return std::string(IN_MEMORY) + ": dim is " + std::to_string(a_.dim) + ": give 1, 2 or 3";
    if (n_ == 0) return std::string(IN_MEMORY) + ": mass is empty: give at least one particle";
    particles();
    springs();
    laws();
    box();
    anchors();
    interactions();
    options();
    return fault_;
  }

 private:
  void note(const std::string& text) {
    if (fault_.empty()) fault_ = std::string(IN_MEMORY) + ": " + text;
  }

  /// `rows` rows of `width` numbers, or none where that is allowed.
  void size(const std::string& name, std::size_t given, std::size_t rows, std::size_t width, bool optional) {
    if (given == rows * width || (optional && given == 0)) return;
    note(name + " has " + how_many(static_cast<std::int64_t>(given), "number") + ": give " + std::to_string(rows * width) +
         (optional ? ", or none" : ""));
  }

  void one_of(const std::string& what, const std::string& name, const std::vector<std::string>& names) {
    if (std::find(names.begin(), names.end(), name) == names.end()) note(what + " '" + printable(name) + "' is unknown: give " + alternatives(names));
  }

  template <class List>
  void once(const std::string& what, const List& list) {
    for (std::size_t k = 0; k < list.size(); ++k)
      for (std::size_t j = 0; j < k; ++j)
        if (list[j].name == list[k].name) note(what + list[k].name + " is there twice: give it once");
  }

  void flags(const std::string& what, const std::vector<std::uint8_t>& flag, const char* remedy) {
    const auto bad = std::find_if(flag.begin(), flag.end(), [](std::uint8_t one) { return one > 1; });
    if (bad != flag.end()) note("particle " + std::to_string(bad - flag.begin()) + ": " + what + " is " + std::to_string(*bad) + ": give " + remedy);
  }

  void particles() {
    std::vector<std::string> known;
    size("position", a_.position.size(), n_, d_, false);
    size("velocity", a_.velocity.size(), n_, d_, true);
    size("fixed", a_.fixed.size(), n_, 1, true);
    size("id", a_.id.size(), n_, 1, true);
    flags("fixed", a_.fixed, "1 (fixed) or 0 (free)");
    for (const ParticleParameter& one : particle_parameters) known.emplace_back(one.name);
    for (const Column& one : a_.particle_columns) {
      std::size_t width = 1;
      one_of("column of particles", one.name, known);
      for (const ParticleParameter& parameter : particle_parameters)
        if (one.name == parameter.name) width = static_cast<std::size_t>(parameter.width(a_.dim));
      size("particles/" + one.name, one.value.size(), n_, width, false);
    }
    once("particles/", a_.particle_columns);
    for (const Group& one : a_.groups) {
      if (!is_group_name(one.name)) note("'" + printable(one.name) + "' is no name of a group: give letters, digits and underscores");
      size("group " + one.name, one.member.size(), n_, 1, false);
      flags("member of group " + one.name, one.member, "1 (it belongs to the group) or 0");
    }
    once("group ", a_.groups);
  }

  void springs() {
    std::vector<std::string> of_laws, of_breaking;
    size("springs", a_.springs.size(), s_, 2, false);
    size("rest_length", a_.rest_length.size(), s_, 1, true);
    size("damping", a_.damping.size(), s_, 1, true);
    size("area", a_.area.size(), s_, 1, true);
    size("shift", a_.shift.size(), s_, d_, true);
    for (const SpringParameter& one : spring_parameters()) of_laws.emplace_back(one.name);
    for (const SpringHistory& one : spring_histories()) of_laws.emplace_back(one.name);
    for (const BreakLimit& one : break_limits) of_breaking.emplace_back(one.name);
    of_breaking.emplace_back(BROKEN);
    const auto columns = [this](const char* what, const std::vector<Column>& given, const std::vector<std::string>& known) {
      for (const Column& one : given) {
        one_of(what, one.name, known);
        size("springs/" + one.name, one.value.size(), s_, 1, false);
      }
      once("springs/", given);
    };
    columns("column of springs", a_.spring_columns, of_laws);
    columns("limit of springs", a_.break_columns, of_breaking);
  }

  void laws() {
    if (!a_.spring_law.empty()) one_of("spring_law", a_.spring_law, spring_law_names());
    if (!a_.damping_law.empty()) one_of("damping_law", a_.damping_law, damper_law_names());
    for (const std::string& name : a_.laws) one_of("laws:", name, spring_law_names());
    size("law", a_.law.size(), s_, 1, true);
    const std::int64_t names = static_cast<std::int64_t>(a_.laws.size());
    if (!a_.law.empty() && names == 0) note("law has a number for each spring and laws is empty: give the names that these are places of");
    const auto bad = std::find_if(a_.law.begin(), a_.law.end(), [names](std::int64_t at) { return at < 0 || at >= names; });
    if (bad != a_.law.end())
      note("spring " + std::to_string(bad - a_.law.begin()) + ": law is " + std::to_string(*bad) + ": give places in laws, 0 to " +
           std::to_string(names - 1));
  }

  void box() {
    PeriodicBox box = a_.box;
    for (int k = a_.dim; k < 3; ++k)
      if (box.periodic[k]) note("box is periodic along edge " + std::to_string(k) + " (from 0): there are " + std::to_string(a_.dim));
    if (box.active() && !complete_edges(&box, a_.dim))
      note("the edges of the box span no volume: give finite vectors [m] that do not lie in one plane or line");
    bool some = !a_.shift.empty();
    for (const InteractionArrays& one : a_.interactions) some = some || !one.shift.empty();
    if (some && !box.active()) note("shift is given and the box is not periodic: leave it out, or say along which edges the box is periodic");
  }

  void anchors() {
    const std::size_t count = a_.anchors.stiffness.size();
    size("anchors/particle", a_.anchors.particle.size(), count, 1, false);
    size("anchors/point", a_.anchors.point.size(), count, d_, false);
    size("anchors/rest_length", a_.anchors.rest_length.size(), count, 1, true);
    size("anchors/damping", a_.anchors.damping.size(), count, 1, true);
  }

  void interactions() {
    std::vector<std::string> kinds;
    for (const InteractionSchema& schema : interaction_schemas()) kinds.push_back(std::string(schema.group) + "s");
    for (std::size_t k = 0; k < a_.interactions.size(); ++k) {
      const InteractionArrays& one = a_.interactions[k];
      const std::size_t kind = static_cast<std::size_t>(std::find(kinds.begin(), kinds.end(), one.kind) - kinds.begin());
      one_of("kind of interactions", one.kind, kinds);
      if (kind == kinds.size()) return;
      for (std::size_t j = 0; j < k; ++j)
        if (a_.interactions[j].kind == one.kind) note(one.kind + " are there twice: give them once");
      const InteractionSchema& schema = interaction_schemas()[kind];
      const std::size_t ends = static_cast<std::size_t>(schema.ends), rows = one.ends.size() / ends;
      if (one.ends.size() % ends != 0)
        note(one.kind + "/ends has " + how_many(static_cast<std::int64_t>(one.ends.size()), "number") + ": give " + std::to_string(ends) +
             " for each of them");
      size(one.kind + "/parameter", one.parameter.size(), rows, schema.parameters.size(), false);
      size(one.kind + "/shift", one.shift.size(), rows, ends * d_, true);
      std::vector<std::string> limits{BROKEN};
      for (const BreakLimit& limit : turn_limits) limits.emplace_back(limit.name);
      if (!schema.turns) limits.clear();
      for (const Column& column : one.break_columns) {
        one_of("limit of interactions", column.name, limits);
        size(one.kind + "/" + column.name, column.value.size(), rows, 1, false);
      }
      once(one.kind + "/", one.break_columns);
    }
  }

  /// Those that a lattice file can keep.
  void options() {
    for (const auto& [name, value] : a_.implied_options) {
      if (std::find(std::begin(XSP_OPTIONS), std::end(XSP_OPTIONS), name) == std::end(XSP_OPTIONS))
        note("implied option '" + printable(name) + "' is none of a scene's: give it with the settings");
      if (value.empty() || value.find_first_of(" \t\n") != std::string::npos)
        note("implied option " + printable(name) + " has the value '" + printable(value) + "': give one without blanks");
    }
  }

  const LatticeArrays& a_;
  std::size_t d_, n_, s_;
  std::string fault_;
};

}  // namespace

std::string fault_of(const LatticeArrays& arrays) { return Check(arrays).run(); }

}  // namespace bs
