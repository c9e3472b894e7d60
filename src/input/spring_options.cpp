#include <algorithm>
#include <cinttypes>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "input/adjust.hpp"
#include "lattice/spring_laws.hpp"

namespace bs {

void SpringOptions::read(Section& section) {
  std::string formulas;
  int index = 0;
  for (const SpringLawInfo& law : spring_laws()) formulas += (formulas.empty() ? "" : "; ") + std::string(law.name) + " " + law.title;
  if (section.choice("-bs_spring_law", ("spring law, with the tension at length l: " + formulas).c_str(), spring_law_names(), index))
    spring_law = index;
  index = 0;
  if (section.choice("-bs_damping_law", "relative velocity that a spring damps: axial, its component along the spring only; simple, all of it",
                     damper_law_names(), index))
    damping_law = index;
  for (const SpringParameter& one : spring_parameters()) {
    Constant constant{one, std::string("-bs_spring_") + one.name};
    const std::string help = std::string(one.meaning) + ", the same for all springs; the dataset /springs/" + one.name +
                             " of a lattice file takes precedence [" + one.unit + "]";
    constant.given = section.real(constant.option.c_str(), help.c_str(), constant.value,
                                  one.positive      ? Range::positive
                                  : one.nonnegative ? Range::nonnegative
                                                    : Range::any);
    constants.push_back(constant);
  }
}

namespace {

using Used = std::vector<std::uint8_t>;

std::size_t law_of(const Lattice& l, std::size_t k) { return l.law_by_row ? l.spring_laws[k] : static_cast<std::size_t>(l.spring_law); }

const Column* column_of(const Lattice& l, const std::string& name) { return find_column(l.spring_columns, name); }

template <class List>
bool holds(const List& list, const std::string& name) {
  return std::any_of(list.begin(), list.end(), [&](const auto& one) { return name == one.name; });
}

/// Whether a law takes or carries `name`.
bool takes(const SpringLawInfo& law, const std::string& name) { return holds(law.parameters, name) || holds(law.history, name); }

bool some_takes(const Used& used, const std::string& name) {
  for (std::size_t k = 0; k < used.size(); ++k)
    if (used[k] && takes(spring_laws()[k], name)) return true;
  return false;
}

PetscErrorCode find_used(MPI_Comm comm, const Lattice& l, Used* used) {
  PetscFunctionBegin;
  used->assign(spring_laws().size(), 0);
  for (std::size_t k = 0; k < static_cast<std::size_t>(l.springs.count); ++k) (*used)[law_of(l, k)] = 1;
  PetscCall(max_over_ranks(comm, used->data(), used->size()));
  PetscFunctionReturn(0);
}

/// Columns that no spring takes are dropped; constants become columns.
PetscErrorCode assign_parameters(MPI_Comm comm, const SpringOptions& options, const Used& used, Lattice* l) {
  PetscFunctionBegin;
  std::vector<Column> kept;
  for (Column& one : l->spring_columns) {
    if (some_takes(used, one.name)) kept.push_back(std::move(one));
    else l->warnings.push_back(l->source + ": " + one.path + ": no spring obeys a law that takes it, it is ignored");
  }
  l->spring_columns = std::move(kept);
  for (const SpringOptions::Constant& constant : options.constants) {
    const std::string name = constant.parameter.name;
    if (!constant.given) continue;
    if (!some_takes(used, name)) {
      PetscCall(warn(comm, "ignored_options", "option " + constant.option + ": no spring obeys a law that takes it: ignored"));
    } else if (const Column* own = column_of(*l, name)) {
      PetscCall(warn(comm, "ignored_options", l->source + ": has its own " + own->path + "; ignored: " + constant.option));
    } else {
      l->spring_columns.push_back({name, constant.option, std::vector<double>(static_cast<std::size_t>(l->springs.count), constant.value)});
    }
  }
  PetscFunctionReturn(0);
}

/// A law lacks a number it needs, or has none at all.
PetscErrorCode require_numbers(MPI_Comm comm, const Used& used, const Lattice& l) {
  PetscFunctionBegin;
  for (std::size_t k = 0; k < used.size(); ++k) {
    const SpringLawInfo& law = spring_laws()[k];
    bool some = law.parameters.empty();
    for (const SpringParameter& one : law.parameters) some = some || column_of(l, one.name);
    for (const SpringParameter& one : law.parameters) {
      if (!used[k] || column_of(l, one.name) || (some && !one.needed)) continue;
      PetscCall(fail(comm, Exit::input,
                     format("%s: springs obey the law %s, which needs %s: give -bs_spring_%s, or the dataset /springs/%s [%s]", l.source.c_str(),
                            law.name, one.name, one.name, one.name, one.unit)));
    }
  }
  PetscFunctionReturn(0);
}

/// A path is a sum of sizes.
bool is_path(const std::string& name) { return name.size() > 5 && name.compare(name.size() - 5, 5, "_path") == 0; }

/// Values that a spring's law takes must be in range; the others become 0.
PetscErrorCode check_columns(MPI_Comm comm, Lattice* l) {
  Error fault;
  PetscFunctionBegin;
  for (Column& column : l->spring_columns)
    for (std::size_t k = 0; k < column.value.size(); ++k) {
      const SpringLawInfo& law = spring_laws()[law_of(*l, k)];
      double& value = column.value[k];
      if (!takes(law, column.name)) {
        value = 0;
        continue;
      }
      const char* unit = "m";
      bool nonnegative = false, positive = false;
      for (const SpringParameter& one : law.parameters)
        if (column.name == one.name) unit = one.unit, nonnegative = one.nonnegative, positive = one.positive;
      for (const SpringHistory& one : law.history)
        if (column.name == one.name) unit = one.unit, nonnegative = is_path(one.name);
      const std::int64_t row = l->springs.first + static_cast<std::int64_t>(k);
      if (!std::isfinite(value) || (nonnegative && value < 0) || (positive && value == 0))
        fault.note(row, format("%s: spring %" PRId64 ", %s: %g; write a finite number%s [%s]", l->source.c_str(), row, column.path.c_str(), value,
                               positive      ? " > 0"
                               : nonnegative ? " >= 0"
                                             : "",
                               unit));
    }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode apply_spring_options(MPI_Comm comm, const SpringOptions& options, Lattice* l) {
  Used used;
  PetscFunctionBegin;
  if (options.spring_law >= 0) {
    if (l->law_by_row)
      PetscCall(fail(comm, Exit::input,
                     format("option -bs_spring_law %s: %s has a law for each spring: leave the option out",
                            spring_laws()[static_cast<std::size_t>(options.spring_law)].name, l->source.c_str())));
    l->spring_law = static_cast<SpringLaw>(options.spring_law);
    l->spring_law_given = true;
  }
  if (options.damping_law >= 0) {
    l->damping_law = static_cast<DampingLaw>(options.damping_law);
    l->damping_law_given = true;
  }
  PetscCall(find_used(comm, *l, &used));
  PetscCall(assign_parameters(comm, options, used, l));
  PetscCall(require_numbers(comm, used, *l));
  PetscCall(check_columns(comm, l));
  PetscFunctionReturn(0);
}

PetscErrorCode check_rest_lengths(MPI_Comm comm, const Lattice& l) {
  Error fault;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < l.rest_length.size() && !fault; ++k) {
    const SpringLawInfo& law = spring_laws()[law_of(l, k)];
    const std::int64_t row = l.springs.first + static_cast<std::int64_t>(k);
    if (l.rest_length[k] == 0 && !law.zero_rest)
      fault.note(row, format("%s: spring %" PRId64 ": rest length 0, where the law %s has no direction: write a length > 0 [m]", l.source.c_str(),
                             row, law.name));
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
