#include "systems/particles/breaking/rules.hpp"
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include "base/error.hpp"
#include "base/options.hpp"
#include "lattice/random.hpp"

namespace bs {

namespace {

/// M,SEED or W,SEED.
void read_scatter(Section& o, const char* name, const char* help, BreakRules::Scatter kind, BreakRules* rules) {
  double numbers[2] = {0, 0};
  int count = 0;
  if (!o.reals(name, help, numbers, 2, &count)) return;
  if (rules->scatter != BreakRules::none) o.fail("options -bs_break_weibull and -bs_break_uniform: give one of them");
  const bool whole = count == 2 && numbers[1] == std::floor(numbers[1]) && std::abs(numbers[1]) < 9e15;
  const bool fits = kind == BreakRules::weibull ? numbers[0] > 0 : numbers[0] > 0 && numbers[0] < 1;
  if (!whole || !fits)
    o.fail(std::string("option ") + name + ": give " +
           (kind == BreakRules::weibull ? "the modulus, > 0, and a whole number as the seed, as in 5,1"
                                        : "the half width, between 0 and 1, and a whole number as the seed, as in 0.2,1"));
  rules->scatter = kind;
  rules->width = numbers[0];
  rules->seed = static_cast<std::int64_t>(numbers[1]);
}

/// Whether limits of the lattice are numbers > 0 or inf.
PetscErrorCode check_limits(MPI_Comm comm, const Lattice& l) {
  Error fault;
  PetscFunctionBegin;
  for (const Column& column : l.break_columns)
    for (std::size_t k = 0; k < column.value.size() && !fault; ++k) {
      const std::int64_t row = l.springs.first + static_cast<std::int64_t>(k);
      const double value = column.value[k];
      if (column.name == BROKEN && value != 0 && value != 1)
        fault.note(row, format("%s: spring %" PRId64 ", %s: %g; write 1 (broken) or 0", l.source.c_str(), row, column.path.c_str(), value));
      else if (column.name != BROKEN && !(value > 0))
        fault.note(row, format("%s: spring %" PRId64 ", %s: %g; write a number > 0, or inf for a spring that does not break", l.source.c_str(), row,
                               column.path.c_str(), value));
    }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode BreakRules::read(MPI_Comm comm, const Lattice& lattice) {
  int chosen = side, which = worst;
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Springs that break", [&](Section& o) {
    for (int c = 0; c < BREAK_LIMITS; ++c) {
      const BreakLimit& one = break_limits[c];
      const std::string help = std::string(one.meaning) + " at which springs break, the same for all; the dataset /springs/" + one.name +
                               " of a lattice file takes precedence; default: they do not break [" + one.unit + "]";
      o.real(one.option, help.c_str(), limit[c], Range::positive);
    }
    o.choice("-bs_break_in", "what makes springs break: being longer than at rest (tension), shorter (compression), or both",
             {"tension", "compression", "both"}, chosen);
    o.choice("-bs_break",
             "which springs break after a step, or at a load of statics: all that are past their limits, or the one that is furthest past it (worst)",
             {"all", "worst"}, which);
    read_scatter(
        o, "-bs_break_weibull",
        "scatter of the limits, M,SEED: each is multiplied by a number of the Weibull distribution of modulus M and scale 1; default: none [1]",
        weibull, this);
    read_scatter(o, "-bs_break_uniform", "scatter of the limits, W,SEED: each is multiplied by a number between 1 - W and 1 + W; default: none [1]",
                 uniform, this);
    int count = 0;
    notched =
        o.reals("-bs_break_notch", "x,y,x,y of a line, the springs across which are broken from the start; default: none [m]", notch, 4, &count);
    if (notched && count != 4) o.fail("option -bs_break_notch: give four numbers, the ends of a line, as in 0,0.5,0.3,0.5 [m]");
    o.texts("-bs_break_spare", "groups of particles whose springs do not break, separated by commas; default: none", spared);
    for (const std::string& name : spared)
      if (std::none_of(lattice.groups.begin(), lattice.groups.end(), [&](const Group& g) { return g.name == name; }))
        o.fail("option -bs_break_spare: there is no group " + name + ": choose its particles by -bs_group_" + name +
               ", or name a group of the lattice");
  }));
  if (notched && (lattice.dim != 2 || lattice.box.active()))
    PetscCall(fail(comm, Exit::input, "option -bs_break_notch: notches are for lattices in 2 dimensions without a periodic box: leave it out"));
  side = static_cast<Side>(chosen);
  worst = which == 1;
  PetscCall(check_limits(comm, lattice));
  PetscFunctionReturn(0);
}

bool BreakRules::active(const Lattice& lattice) const {
  if (lattice.springs.total == 0) return false;
  for (const double value : limit)
    if (std::isfinite(value)) return true;
  return notched || !lattice.break_columns.empty();
}

double BreakRules::factor(std::int64_t row) const {
  if (scatter == none) return 1;
  const double U = hash_uniform(seed, Stream::breaking, row, 0);
  return scatter == weibull ? std::pow(-std::log1p(-U), 1 / width) : 1 + width * (2 * U - 1);
}

std::string BreakRules::describe(const Lattice& lattice) const {
  std::string text;
  for (int c = 0; c < BREAK_LIMITS; ++c) {
    const std::string name = break_limits[c].name;
    const bool column = find_column(lattice.break_columns, name) != nullptr;
    if (!column && !std::isfinite(limit[c])) continue;
    text += (text.empty() ? "" : " or ") + name;
    text += column ? " of the lattice" : format(" %g", limit[c]);
  }
  if (text.empty()) return text;
  constexpr const char* sides[] = {"in tension", "in compression", "in tension or compression"};
  text = "springs break at " + text + ", " + sides[side] + (worst ? ", one at a time" : "");
  if (scatter == weibull) text += format("; limits scatter by Weibull's distribution of modulus %g, seed %lld", width, static_cast<long long>(seed));
  if (scatter == uniform) text += format("; limits scatter by up to %g, seed %lld", width, static_cast<long long>(seed));
  return text;
}

}  // namespace bs
