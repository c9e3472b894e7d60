#include "tasks/statics/stability.hpp"
#include <algorithm>
#include "base/error.hpp"
#include "tasks/statics/saddle_point.hpp"
#include "time/methods.hpp"

namespace bs {
namespace {

void put(PetscInt negative, int verdict, std::vector<Observable>* out) {
  out->push_back({"negative_pivots", {static_cast<double>(negative)}});
  out->push_back({"stability", {static_cast<double>(verdict)}});
}

}  // namespace

// The tangent at the equilibrium itself: Newton's last one is of the iterate before it.
PetscErrorCode Stability::assess(TS ts, Mat J, Equilibrium& model, const PseudoTime& solver, double factor, Vec y, std::vector<Observable>* out) {
  PetscInt negative = -1;
  bool found = false, known = false;
  PetscFunctionBegin;
  if (!model.mechanics()->linearisation().complete()) {
    skip(out);
    note(factor, model.factor(factor), negative, Verdict::unknown);
    PetscFunctionReturn(0);
  }
  PetscCall(solver.is_found_minimum(factor, y, &negative, &known));
  if (!known) PetscCall(count_unstable_directions(ts, J, model, factor, y, &negative));
  if (!known && negative < 0 && iterations_ > 0 && factor > 0) {
    VecHandle z;
    PetscCall(VecDuplicate(y, z.out()));
    PetscCall(search_unstable_direction(ts, model, static_cast<PetscInt>(iterations_), z, &found));
  }
  const Verdict verdict = negative > 0 || found ? Verdict::unstable : negative == 0 ? Verdict::stable : Verdict::unknown;
  put(negative, static_cast<int>(verdict), out);
  note(factor, model.factor(factor), negative, verdict);
  PetscFunctionReturn(0);
}

void Stability::skip(std::vector<Observable>* out) { put(-1, 0, out); }

/// A state may be looked at twice, before a checkpoint and after it.
void Stability::note(double clock, double factor, PetscInt negative, Verdict verdict) {
  if (clock == last_) return;
  last_ = clock;
  if (before_ >= 0 && negative != before_) ++changes_;
  before_ = negative;
  if (clock <= 0) return;
  if (verdict == Verdict::unstable && unstable_ == 0) first_unstable_ = factor;
  if (verdict == Verdict::unstable) most_ = std::max<std::int64_t>(most_, negative);
  ++(verdict == Verdict::unstable ? unstable_ : verdict == Verdict::stable ? stable_ : unknown_);
}

void Stability::count(std::vector<Tally>* out) const {
  out->push_back({"inertia_changes",
                  "time{s} the number of negative pivots changed: {a limit or branch point lies|limit points and branch points lie} there",
                  changes_});
  out->push_back({"unstable", "{equilibrium is|equilibria are} unstable: the tangent there has negative pivots", unstable_});
  out->push_back({"stable", "", stable_});
  out->push_back({"stability_unknown",
                  "{equilibrium of which it is not known whether it is|equilibria of which it is not known whether they are} stable: no unstable "
                  "direction was found, and the linear solver does not count "
                  "them (-condensed_pc_type cholesky does)",
                  unknown_});
}

PetscErrorCode Stability::warn(Warnings* warnings) const {
  PetscFunctionBegin;
  if (unstable_ == 0) PetscFunctionReturn(0);
  const std::string directions =
      most_ > 0 ? "up to " + how_many(most_, "direction") : std::string("at least one direction, by an iterative estimate");
  PetscCall(warnings->add(
      "unstable_equilibria",
      format("%s, the first at the load factor %.10g, in %s: the smallest disturbance leads away from them; disturb "
             "the start (-bs_lattice_perturbation), or see where it leads by -bs_task dynamics",
             how_many(unstable_, "of " + how_many(stable_ + unstable_ + unknown_, "{equilibrium|equilibria}") + " {is|are} unstable").c_str(),
             first_unstable_, directions.c_str())));
  PetscFunctionReturn(0);
}

void Stability::save(Facts* facts) const {
  const std::pair<const char*, std::int64_t> whole[] = {{"stable", stable_},  {"unstable", unstable_},  {"stability_unknown", unknown_},
                                                        {"inertia", before_}, {"most_unstable", most_}, {"inertia_changes", changes_}};
  for (const auto& [name, value] : whole) facts->whole[name] = value;
  facts->real["first_unstable"] = first_unstable_;
  facts->real["stability_noted"] = last_;
}

void Stability::restore(const Facts& facts) {
  const std::pair<const char*, std::int64_t*> whole[] = {{"stable", &stable_},  {"unstable", &unstable_},  {"stability_unknown", &unknown_},
                                                         {"inertia", &before_}, {"most_unstable", &most_}, {"inertia_changes", &changes_}};
  for (const auto& [name, value] : whole) *value = facts.whole_of(name, *value);
  first_unstable_ = facts.real_of("first_unstable", first_unstable_);
  last_ = facts.real_of("stability_noted", last_);
}

}  // namespace bs
