#include "tasks/statics/snap_through.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "linalg/condensed/condensed.hpp"
#include "solvers/own_solve.hpp"
#include "time/methods.hpp"

namespace bs {

PetscErrorCode SnapThrough::attach(TS ts, TSContext& context, Equilibrium& model, PseudoTime& inner) {
  SNES snes;
  PetscFunctionBegin;
  ts_ = ts;
  context_ = &context;
  model_ = &model;
  inner_ = &inner;
  for (VecHandle* room : {&found_, &low_, &middle_, &high_}) PetscCall(VecDuplicate(model.initial_state(), room->out()));
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(attach_own_solve(snes, this));
  PetscFunctionReturn(0);
}

PetscErrorCode SnapThrough::solve(SNES snes) {
  PetscReal t;
  bool yes = false;
  PetscFunctionBegin;
  PetscCall(inner_->solve(snes));
  if (!inner_->at_load_step() || snes->reason < 0 || snes->iter == 0) PetscFunctionReturn(0);
  PetscCall(TSGetTime(ts_, &t));
  if ((t == 0 && !rests_) || inner_->continued()) {
    if (t != unknown_at_) ++unknown_;
    unknown_at_ = t;
    PetscFunctionReturn(0);
  }
  PetscCall(suspects(snes->vec_sol, &yes));
  if (yes) PetscCall(examine_step(snes, snes->vec_sol));
  PetscFunctionReturn(0);
}

// Along a branch of stable equilibria E(s, x(s)) changes by what the loads do, dE/ds = P = the derivative of E by s alone: by the trapezoidal rule
// from P at both ends, to third order in the length of the step. A jump releases energy beyond that.
PetscErrorCode SnapThrough::suspects(Vec X, bool* yes) {
  constexpr double PART = 0.05;  // of what the change of P makes of the work of the step; what is continuous took 0.02 at most in diluted nets
  PetscReal t, h;
  Vec y;
  Work first, last;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts_, &t));
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(work_at(t, h, y, &first));
  PetscCall(work_at(t + h, -h, X, &last));
  const double released = 0.5 * h * (first.power + last.power) - (last.energy - first.energy);
  *yes = released > std::max(PART * 0.5 * h * std::abs(last.power - first.power), first.rounding + last.rounding);
  PetscFunctionReturn(0);
}

/// h: towards where the loads are those of the step.
PetscErrorCode SnapThrough::work_at(double t, double h, Vec y, Work* out) {
  constexpr double NEAR = 1e-4;
  HeldEnergies at, near, further;
  PetscFunctionBegin;
  PetscCall(model_->energies(t, y, &at));
  PetscCall(model_->energies(t + NEAR * h, y, &near));
  PetscCall(model_->energies(t + 2 * NEAR * h, y, &further));
  out->energy = at.sum();
  out->power = (4 * near.sum() - 3 * at.sum() - further.sum()) / (2 * NEAR * h);
  out->rounding = at.rounding / NEAR;
  PetscFunctionReturn(0);
}

/// The equilibrium at the load factor s that Newton's method finds from another one.
PetscErrorCode SnapThrough::solve_at(SNES snes, double s, Vec from, Vec at, bool* good) {
  PetscFunctionBegin;
  PetscCall(VecCopy(from, snes->vec_sol));
  model_->set_factor(s);
  snes->vec_func_init_set = PETSC_FALSE;
  PetscCall(inner_->newton(snes));
  *good = snes->reason > 0;
  if (*good) PetscCall(VecCopy(snes->vec_sol, at));
  PetscFunctionReturn(0);
}

PetscErrorCode SnapThrough::compare(Vec low, Vec middle, Vec high, Halves* out) const {
  const Layout& at = model_->mechanics()->layout();
  struct {
    double size = -1;
    int rank = 0;
  } most;
  double mine[2] = {0, 0};
  PetscFunctionBegin;
  *out = {};
  const ReadArray a(low), b(middle), c(high);
  for (PetscInt i = 0; i < at.particles; ++i) {
    double squares[3] = {0, 0, 0};
    for (PetscInt k = 0; k < at.dim; ++k) {
      const double first = b[at.x(i, k)] - a[at.x(i, k)], second = c[at.x(i, k)] - b[at.x(i, k)];
      squares[0] += first * first;
      squares[1] += second * second;
      squares[2] += (first - second) * (first - second);
    }
    const double halves[2] = {std::sqrt(squares[0]), std::sqrt(squares[1])}, apart = std::sqrt(squares[2]);
    out->most = std::max(out->most, halves[0] + halves[1]);
    if (apart > most.size) {
      most.size = apart;
      std::copy_n(halves, 2, mine);
    }
  }
  PetscCallMPI(MPI_Comm_rank(model_->comm(), &most.rank));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE_INT, MPI_MAXLOC, model_->comm()));
  PetscCallMPI(MPI_Bcast(mine, 2, MPI_DOUBLE, most.rank, model_->comm()));
  PetscCall(max_over_ranks(model_->comm(), &out->most));
  out->first = mine[0];
  out->second = mine[1];
  PetscFunctionReturn(0);
}

// jump: how far a particle goes in the half that is left while it hardly moves in the other one; 0: there is none. A path that ends at a limit
// point moves by 0.41 in its first half of what it moves in the second.
PetscErrorCode SnapThrough::close_in(SNES snes, Span* span, double* jump) {
  constexpr int HALVINGS = 5;
  constexpr double ALIKE = 0.9, STILL = 0.2, NOTHING = 1e-7;
  double length = 0;
  PetscFunctionBegin;
  *jump = 0;
  PetscCall(VecNorm(span->high, NORM_INFINITY, &length));
  for (int k = 0; k < HALVINGS; ++k) {
    const double middle = 0.5 * (span->from + span->to);
    Halves halves;
    bool good = false;
    PetscCall(solve_at(snes, middle, span->low, middle_, &good));
    if (!good) PetscFunctionReturn(0);
    PetscCall(compare(span->low, middle_, span->high, &halves));
    const bool later = halves.second > halves.first;
    const double less = std::min(halves.first, halves.second), more = std::max(halves.first, halves.second);
    if (halves.most <= NOTHING * length || less > ALIKE * more) PetscFunctionReturn(0);
    if (k == HALVINGS - 1 && less <= STILL * more) *jump = more;
    PetscCall(VecCopy(middle_, later ? span->low : span->high));
    (later ? span->from : span->to) = middle;
  }
  PetscFunctionReturn(0);
}

// Two equilibria under the same load: what is free to move without resistance may be anywhere, at the same energy.
PetscErrorCode SnapThrough::releases(SNES snes, const Span& span, bool* yes) {
  constexpr double STAYS = 0.2;
  HeldEnergies before, behind;
  Halves halves;
  bool good = false;
  PetscFunctionBegin;
  *yes = true;
  PetscCall(solve_at(snes, span.from, span.high, middle_, &good));
  if (!good) PetscFunctionReturn(0);
  PetscCall(compare(span.low, middle_, span.high, &halves));
  if (halves.second > STAYS * halves.first) PetscFunctionReturn(0);
  PetscCall(model_->energies(span.from, span.low, &before));
  PetscCall(model_->energies(span.from, middle_, &behind));
  *yes = before.sum() - behind.sum() > std::max(before.rounding, behind.rounding);
  PetscFunctionReturn(0);
}

// Motions without stiffness have no branch to begin with as long as there is no load at all: the first step is looked at from the smallest of loads.
PetscErrorCode SnapThrough::examine_step(SNES snes, Vec X) {
  constexpr double SMALLEST = 1.0 / 1024;
  const PetscInt iterations = snes->iter;
  const SNESConvergedReason reason = snes->reason;
  Span span;
  double jump = 0;
  PetscReal t, h;
  bool good = false, released = false;
  PC pc;
  Vec y;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts_, &t));
  PetscCall(TSGetTimeStep(ts_, &h));
  PetscCall(TSGetSolution(ts_, &y));
  PetscCall(VecCopy(X, found_));
  PetscCall(VecCopy(X, high_));
  span = {t > 0 ? t : SMALLEST * h, t + h, low_, high_};
  PetscCall(solve_at(snes, span.from, y, low_, &good));
  if (good) PetscCall(close_in(snes, &span, &jump));
  if (jump > 0) PetscCall(releases(snes, span, &released));
  if (released && t != last_) {
    if (count_++ == 0) {
      from_ = span.from;
      to_ = span.to;
      jump_ = jump;
    }
    last_ = t;
  }
  // as if nothing had been
  model_->set_factor(std::numeric_limits<double>::quiet_NaN());
  PetscCall(VecCopy(found_, X));
  snes->iter = iterations;
  snes->reason = reason;
  PetscCall(linear_solver_of(ts_, nullptr, &pc));
  PetscCall(condensed_renew(pc));
  context_->newton.forget_lengths();
  PetscFunctionReturn(0);
}

void SnapThrough::count(const std::string& otherwise, std::vector<Tally>* out) const {
  out->push_back({"snap_through", "load step{s} in which the shape jumped to another branch of equilibria (snap-through)", count_,
                  otherwise.empty() ? "" : "snap-through was not looked for " + otherwise});
  out->push_back({"snap_through_unknown",
                  "load step{s} in which snap-through was not looked for all the way, from a start that is no equilibrium, after a break, or where "
                  "pseudo-transient continuation led to another shape",
                  unknown_});
}

PetscErrorCode SnapThrough::warn(Warnings* warnings) const {
  PetscFunctionBegin;
  if (count_ == 0) PetscFunctionReturn(0);
  PetscCall(warnings->add(
      "snap_through",
      format("the shape jumps to another branch of equilibria (snap-through) in %s, first between the load factors %.6g and %.6g, "
             "where a particle moves by %.3g m: a limit load is passed there; -bs_load_control arc follows the path through it, -bs_task "
             "dynamics the motion",
             how_many(count_, "load step").c_str(), from_, to_, jump_)));
  PetscFunctionReturn(0);
}

void SnapThrough::save(Facts* facts) const {
  facts->whole["snap_through"] = count_;
  facts->whole["snap_through_unknown"] = unknown_;
  facts->real["snap_from"] = from_;
  facts->real["snap_to"] = to_;
  facts->real["snap_jump"] = jump_;
  facts->real["snap_last"] = last_;
  facts->real["snap_unknown_at"] = unknown_at_;
}

void SnapThrough::restore(const Facts& facts) {
  count_ = facts.whole_of("snap_through", count_);
  unknown_ = facts.whole_of("snap_through_unknown", unknown_);
  from_ = facts.real_of("snap_from", from_);
  to_ = facts.real_of("snap_to", to_);
  jump_ = facts.real_of("snap_jump", jump_);
  last_ = facts.real_of("snap_last", last_);
  unknown_at_ = facts.real_of("snap_unknown_at", unknown_at_);
}

}  // namespace bs
