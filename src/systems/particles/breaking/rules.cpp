#include "systems/particles/breaking/rules.hpp"
#include <algorithm>
#include <cinttypes>
#include <cmath>
#include "base/error.hpp"
#include "base/hash.hpp"
#include "base/options.hpp"
#include "lattice/spring_laws.hpp"
#include "network/network.hpp"

namespace bs {

namespace {

std::string a_or_an(const std::string& title) { return (std::string("aeiou").find(title[0]) == std::string::npos ? "a " : "an ") + title; }

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

/// Whether limits are numbers > 0 or inf, and flags 0 or 1.
void check_limits(const Lattice& l, const std::string& title, const Rows& rows, const std::vector<Column>& columns, Error* fault) {
  for (const Column& column : columns)
    for (std::size_t k = 0; k < column.value.size() && !*fault; ++k) {
      const std::int64_t row = rows.first + static_cast<std::int64_t>(k);
      const double value = column.value[k];
      const std::string place = format("%s: %s %" PRId64 ", %s: %g; ", l.source.c_str(), title.c_str(), row, column.path.c_str(), value);
      if (column.name == BROKEN && value != 0 && value != 1) fault->note(row, place + "write 1 (broken) or 0");
      else if (column.name != BROKEN && !(value > 0))
        fault->note(row, place + "write a number > 0, or inf for " + a_or_an(title) + " that does not break");
    }
}

}  // namespace

PetscErrorCode BreakRules::read(MPI_Comm comm, const Lattice& lattice) {
  int chosen = side, which = worst;
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Springs and other parts that break", [&](Section& o) {
    for (int c = 0; c < BREAK_LIMITS; ++c) {
      const BreakLimit& one = break_limits[c];
      const std::string help = std::string(one.meaning) + " at which springs break, the same for all; the dataset /springs/" + one.name +
                               " of a lattice file takes precedence; default: they do not break [" + one.unit + "]";
      o.real(one.option, help.c_str(), limit[c], Range::positive);
    }
    read_turns(o);
    o.choice("-bs_break_in", "what makes springs break: being longer than at rest (tension), shorter (compression), or both",
             {"tension", "compression", "both"}, chosen);
    o.choice("-bs_break",
             "which parts break after a step, or at a load of statics: all that are past their limits, or the one that is furthest past it (worst)",
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
    o.texts("-bs_break_spare", "groups of particles whose springs, angle springs and hinges do not break, separated by commas; default: none",
            spared);
    for (const std::string& name : spared)
      if (std::none_of(lattice.groups.begin(), lattice.groups.end(), [&](const Group& g) { return g.name == name; }))
        o.fail("option -bs_break_spare: there is no group " + name + ": choose its particles by -bs_group_" + name +
               ", or name a group of the lattice");
  }));
  if (notched && (lattice.dim != 2 || lattice.box.active()))
    PetscCall(fail(comm, Exit::input, "option -bs_break_notch: notches are for lattices in 2 dimensions without a periodic box: leave it out"));
  side = static_cast<Side>(chosen);
  worst = which == 1;
  PetscCall(check(comm, lattice));
  PetscFunctionReturn(0);
}

/// -bs_break_angle_change, ..., -bs_break_hinge_energy
void BreakRules::read_turns(Section& o) {
  const std::vector<InteractionSchema>& schemas = interaction_schemas();
  turn_limit.resize(schemas.size());
  for (std::size_t kind = 0; kind < schemas.size(); ++kind) {
    const InteractionSchema& schema = schemas[kind];
    turn_limit[kind].fill(std::numeric_limits<double>::infinity());
    for (std::size_t c = 0; c < TURN_LIMITS && schema.turns; ++c) {
      const BreakLimit& one = turn_limits[c];
      const std::string name = std::string("-bs_break_") + schema.group + "_" + one.option,
                        help = std::string(one.meaning) + " at which " + schema.title + "s break, the same for all; the dataset /" + schema.group +
                               "s/" + one.name + " of a lattice file takes precedence; default: they do not break [" + one.unit + "]";
      o.real(name.c_str(), help.c_str(), turn_limit[kind][c], Range::positive);
    }
  }
  o.flag(
      "-bs_break_with_springs",
      "whether an angle spring breaks with a spring along one of its arms, a hinge with one along a side of its triangles; else they bear on as if "
      "the spring were there",
      with_springs);
}

PetscErrorCode BreakRules::check(MPI_Comm comm, const Lattice& l) const {
  Error fault;
  bool turns = false;
  PetscFunctionBegin;
  check_limits(l, "spring", l.springs, l.break_columns, &fault);
  for (std::size_t kind = 0; kind < turn_limit.size(); ++kind) {
    const InteractionSchema& schema = interaction_schemas()[kind];
    const std::int64_t total = kind < l.interactions.size() ? l.interactions[kind].rows.total : 0;
    turns = turns || (schema.turns && total > 0);
    if (total > 0) check_limits(l, schema.title, l.interactions[kind].rows, l.interactions[kind].break_columns, &fault);
    for (std::size_t c = 0; c < TURN_LIMITS; ++c)
      if (total == 0 && std::isfinite(turn_limit[kind][c]))
        PetscCall(fail(comm, Exit::input,
                       format("option -bs_break_%s_%s: the lattice has no %ss: leave it out, or give it some", schema.group, turn_limits[c].option,
                              schema.title)));
  }
  PetscCall(fail_if_any(comm, fault));
  if (with_springs && !(turns && active(l)))
    PetscCall(fail(comm, Exit::input,
                   std::string("option -bs_break_with_springs: ") +
                       (turns ? "no spring may break: give a limit of springs, such as -bs_break_strain, or leave it out"
                              : "the lattice has neither angle springs nor hinges: leave it out")));
  PetscFunctionReturn(0);
}

bool BreakRules::active(const Lattice& lattice, std::size_t kind) const {
  if (kind >= lattice.interactions.size() || lattice.interactions[kind].rows.total == 0) return false;
  const auto& own = turn_limit[kind];
  return with_springs || !lattice.interactions[kind].break_columns.empty() ||
         std::any_of(own.begin(), own.end(), [](double value) { return std::isfinite(value); });
}

bool BreakRules::active(const Lattice& lattice) const {
  if (lattice.springs.total == 0) return false;
  for (const double value : limit)
    if (std::isfinite(value)) return true;
  return notched || !lattice.break_columns.empty();
}

double BreakRules::factor(std::int64_t row, std::int64_t of) const {
  if (scatter == none) return 1;
  const double U = hash_uniform(seed, Stream::breaking, row, of);
  return scatter == weibull ? std::pow(-std::log1p(-U), 1 / width) : 1 + width * (2 * U - 1);
}

std::vector<std::uint8_t> BreakRules::spared_particles(const Network& net) const {
  std::vector<std::uint8_t> flags(static_cast<std::size_t>(net.n + net.ghosts), 0);
  for (const NetworkGroup& group : net.groups)
    if (std::find(spared.begin(), spared.end(), group.name) != spared.end())
      for (const PetscInt i : group.member) flags[static_cast<std::size_t>(i)] = 1;
  return flags;
}

std::string BreakRules::describe(const Lattice& lattice) const {
  constexpr const char* sides[] = {"in tension", "in compression", "in tension or compression"};
  const auto limits = [](const BreakLimit* which, const double* same, int count, const std::vector<Column>& columns) {
    std::string text;
    for (int c = 0; c < count; ++c) {
      const bool own = find_column(columns, which[c].name) != nullptr;
      if (own || std::isfinite(same[c]))
        text += (text.empty() ? "" : " or ") + std::string(which[c].name) + (own ? " of the lattice" : format(" %g", same[c]));
    }
    return text;
  };
  std::string text = limits(break_limits, limit, BREAK_LIMITS, lattice.break_columns);
  if (!text.empty()) text = "springs break at " + text + ", " + sides[side];
  for (std::size_t kind = 0; kind < lattice.interactions.size(); ++kind) {
    const std::string own = limits(turn_limits, turn_limit[kind].data(), TURN_LIMITS, lattice.interactions[kind].break_columns);
    if (!own.empty()) text += (text.empty() ? "" : "; ") + std::string(interaction_schemas()[kind].title) + "s break at " + own;
  }
  if (text.empty()) return text;
  if (with_springs) text += "; what has a broken spring along a side breaks with it";
  text += worst ? ", one at a time" : "";
  if (scatter == weibull) text += format("; limits scatter by Weibull's distribution of modulus %g, seed %lld", width, static_cast<long long>(seed));
  if (scatter == uniform) text += format("; limits scatter by up to %g, seed %lld", width, static_cast<long long>(seed));
  return text;
}

}  // namespace bs
