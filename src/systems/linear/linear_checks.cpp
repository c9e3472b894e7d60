// What is to be known of a linear system with the method that is to step it, before the first step.
#include <algorithm>
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/hash.hpp"
#include "base/text.hpp"
#include "base/vec_array.hpp"
#include "systems/linear/linear_model.hpp"
#include "systems/linear/system.hpp"

namespace bs {

namespace {

/// What a method does to a violated algebraic equation, and what to give instead.
std::string what_becomes_of_it(const Plan& plan, std::int64_t startup) {
  const bool sign = plan.type == "cn" || plan.type == "theta";
  std::string text = startup > 0         ? "the first step, by backward Euler, jumps"
                     : plan.type == "cn" ? "the first steps jump, and cn keeps the violation with changing sign"
                     : plan.type == "theta"
                         ? "the first steps jump, and theta carries the violation on with changing sign, by (theta - 1)/theta a step"
                         : "the first step jumps";
  text += "; give -bs_linear_dc or a consistent -bs_linear_x0";
  return sign && startup == 0 ? text + ", or -bs_linear_be_steps 1" : text;
}

/// By how much the state violates an equation, and its row, counted from 1; negative: the row with most part in a combination of several.
struct Violation {
  double size = 0;
  int row = 0;
};

/// w'r beyond the rounding of its terms, if that is the worst so far; r and the sizes of its terms from row `first` on.
void note_violation(const SparseVector& w, const PetscScalar* r, const PetscScalar* size, PetscInt first, Violation* worst) {
  constexpr double ROUNDING = 1e-10;
  double sum = 0, scale = 0;
  std::size_t main = 0;
  for (std::size_t e = 0; e < w.at.size(); ++e) {
    sum += w.value[e] * r[w.at[e] - first];
    scale += std::abs(w.value[e]) * size[w.at[e] - first];
    if (std::abs(w.value[e]) > std::abs(w.value[main])) main = e;
  }
  const int row = static_cast<int>(w.at[main]) + 1;
  if (std::abs(sum) > std::max(ROUNDING * scale, worst->size)) *worst = {std::abs(sum), w.at.size() > 1 ? -row : row};
}

/// All entries on every rank, in its place.
PetscErrorCode bring_to_all(VecHandle* vector) {
  Handle<VecScatter, VecScatterDestroy> scatter;
  VecHandle whole;
  PetscFunctionBegin;
  PetscCall(VecScatterCreateToAll(*vector, scatter.out(), whole.out()));
  PetscCall(VecScatterBegin(scatter, *vector, whole, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, *vector, whole, INSERT_VALUES, SCATTER_FORWARD));
  *vector = std::move(whole);
  PetscFunctionReturn(0);
}

}  // namespace

/// G x = B u must hold at the start in what no derivative occurs in: empty rows of C and, where they are known, all combinations of rows that cancel
/// in it.
PetscErrorCode LinearModel::warn_inconsistent(const Plan& plan) {
  VecHandle r, size, of_sources;
  PetscReal most;
  Violation worst;
  PetscFunctionBegin;
  if (of_C_.known ? of_C_.left.empty() : zero_rows_ == 0) PetscFunctionReturn(0);
  for (VecHandle* vector : {&r, &size}) PetscCall(VecDuplicate(system_.x0, vector->out()));
  PetscCall(MatMult(system_.G, system_.x0, r));
  PetscCall(VecNorm(system_.x0, NORM_INFINITY, &most));
  PetscCall(MatGetRowMaxAbs(system_.G, size, nullptr));
  PetscCall(VecScale(size, most));
  PetscCall(add_sources(start_, -1, r));
  if (system_.B) {
    PetscCall(VecDuplicate(Bu_, of_sources.out()));
    PetscCall(VecCopy(Bu_, of_sources));
    PetscCall(VecAbs(of_sources));
    PetscCall(VecAXPY(size, 1, of_sources));
  }
  if (of_C_.known) {
    for (VecHandle* vector : {&r, &size}) PetscCall(bring_to_all(vector));
    const ReadArray ar(r), as(size);
    for (const SparseVector& w : of_C_.left) note_violation(w, ar, as, 0, &worst);
  } else {
    PetscInt first, last;
    PetscCall(VecGetOwnershipRange(r, &first, &last));
    const ReadArray ar(r), as(size);
    for (PetscInt i = first; i < last; ++i) {
      bool empty = true;
      PetscCall(each_nonzero(system_.C, i, [&](PetscInt, double) { empty = false; }));
      if (empty) note_violation({{i}, {1.0}}, ar, as, first, &worst);
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE_INT, MPI_MAXLOC, comm_));
  if (worst.size > 0)
    PetscCall(warn(comm_, "inconsistent_start",
                   format("the initial state violates algebraic row %d%s by %g: ", std::abs(worst.row),
                          worst.row < 0 ? ", with those that cancel its derivatives," : "", worst.size) +
                       what_becomes_of_it(plan, startup_steps_)));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::prepare(const Plan& plan) {
  PetscFunctionBegin;
  const bool velocity = plan.implicit && plan.form == Form::velocity;
  if (!plan.implicit || velocity || !plan.descriptor) PetscCall(invert_C(plan));
  if (velocity && !diagonal_) PetscCall(fail(comm_, Exit::input, plan.method + " needs a diagonal C here: use bdf, cn or theta"));
  if (!plan.polynomial.empty()) PetscCall(warn_unstable(plan));
  PetscCall(find_null_spaces(system_.C, &of_C_));
  // after a jump of sources algebraic states would ring
  const bool algebraic = of_C_.known ? !of_C_.left.empty() : zero_rows_ > 0;
  if (plan.adaptive && algebraic && (plan.type == TSCN || plan.type == TSTHETA)) startup_steps_ = std::max<std::int64_t>(startup_steps_, 1);
  PetscCall(warn_inconsistent(plan));
  type_ = plan.type;
  may_grow_ = !plan.any_step;
  PetscFunctionReturn(0);
}

/// Index 2 or more: parts of x are derivatives of u, which no method here was made for.
PetscErrorCode LinearModel::warn_index() {
  PencilIndex index;
  PetscFunctionBegin;
  PetscCall(find_index(system_.G, of_C_, &index));
  of_C_ = {};
  if (!index.higher) PetscFunctionReturn(0);
  std::string where;
  for (std::size_t k = 0; k < index.rows.size(); ++k)
    where += (k == 0                       ? index.rows.size() > 1 ? ", rows " : ", row "
              : k + 1 == index.rows.size() ? " and "
                                           : ", ") +
             std::to_string(static_cast<long long>(index.rows[k]) + 1);
  const bool serves = type_ == "beuler" || type_ == "bdf";
  PetscCall(warn(comm_, "higher_index",
                 "the system is of index 2 or more: some algebraic equations do not determine their unknowns" + where +
                     " (a cut-set of inductors, or a loop of capacitors and voltage sources?), which are then derivatives of the sources; " +
                     (serves ? type_ + " needs a constant step for these, and its first steps are wrong in them"
                             : type_ + " loses its order in these, or rings: take beuler or bdf at a constant step") +
                     ", or reduce the index, by a small resistance in the loop or across the cut-set"));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::check_solver(KSP ksp) {
  bool singular = false;
  PetscFunctionBegin;
  if (ksp) PetscCall(is_singular(ksp, &singular));
  if (singular)
    PetscCall(fail(comm_, Exit::input,
                   system_.origin + ": sigma C + G is singular to working precision at this step: the pencil (G, C) determines no solution "
                                    "(a floating node, a loop of sources, a duplicate equation?), or -ts_dt meets one of its eigenvalues"));
  if (ksp) PetscCall(require_solver(ksp, ""));
  PetscCall(warn_index());
  PetscFunctionReturn(0);
}

// What a linear system shows: header lines, observables, fields of a frame, labels.

std::vector<std::string> LinearModel::describe() const {
  PetscInt n = 0;
  MatInfo G = {}, C = {};
  (void)MatGetSize(system_.G, &n, nullptr);
  (void)MatGetInfo(system_.G, MAT_GLOBAL_SUM, &G);
  (void)MatGetInfo(system_.C, MAT_GLOBAL_SUM, &C);
  std::vector<std::string> lines;
  lines.push_back(format("linear system G x + C x' = B u: %s, %.0f nonzeros in G, %.0f in C, from %s", how_many(n, "state").c_str(), G.nz_used,
                         C.nz_used, system_.origin.c_str()));
  lines.push_back(std::string("C: ") +
                  (diagonal_    ? "diagonal"
                   : symmetric_ ? "symmetric"
                                : "not symmetric") +
                  (zero_rows_ > 0 ? ", " + how_many(zero_rows_, "empty row") + " (algebraic equations)" : std::string()));
  lines.push_back("sources: " + sources_.describe());
  if (dc_) lines.push_back("initial state: operating point G x = B u");
  if (conditions_) lines.push_back("initial state: IC of capacitors and inductors");
  if (startup_steps_ > 0) lines.push_back("first " + how_many(startup_steps_, "step") + " by backward Euler");
  return lines;
}

std::vector<Tally> LinearModel::tallies() const {
  if (fillings_ > 0) return {{"matrix_setups", "set-up{s} of the step's matrix (factored as often, where it is)", fillings_}};
  return {{"matrix_setups", diagonal_ ? "factorisations: C is diagonal" : "factorisation of C", diagonal_ ? 0 : 1}};
}

// 1/2 x'C x, the energy held in capacitors and inductors, where C is symmetric
PetscErrorCode LinearModel::observe(double, Vec y, std::vector<Observable>* out) {
  PetscScalar energy;
  PetscFunctionBegin;
  out->clear();
  if (!symmetric_) PetscFunctionReturn(0);
  PetscCall(MatMult(system_.C, y, work_));
  PetscCall(VecDot(work_, y, &energy));
  out->push_back({"energy", {0.5 * energy}});
  PetscFunctionReturn(0);
}

// E = x.C x/2 with C symmetric has dE/dt = x.(B u - G x): what the sources and active elements supply. Types that are stable at any step do not make
// energy.
PetscErrorCode LinearModel::energy_supply(double t, Vec y, EnergySupply* out, bool* has) {
  PetscScalar inner = 0, power = 0;
  VecHandle change;
  PetscFunctionBegin;
  *has = may_grow_ && symmetric_;
  if (!*has) PetscFunctionReturn(0);
  PetscCall(VecDuplicate(y, change.out()));
  PetscCall(MatMult(system_.C, y, change));
  PetscCall(VecDot(change, y, &inner));
  PetscCall(MatMult(system_.G, y, change));
  PetscCall(VecScale(change, -1));
  PetscCall(add_sources(t, 1, change));
  PetscCall(VecDot(change, y, &power));
  out->inner = 0.5 * inner;
  out->power = std::max(0.0, power);
  *has = !(inner < 0);
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::fields(double t, Vec y, std::vector<Field>* out) {
  PetscFunctionBegin;
  *out = {{"/states", y, true}};
  if (system_.B) {
    PetscCall(set_sources(t));
    out->push_back({"/sources", u_, true});
  }
  PetscFunctionReturn(0);
}

/// This rank's words of the rows of `layout` as a dataset; none where no rank has words.
static PetscErrorCode add_words(MPI_Comm comm, const char* path, const std::vector<std::string>& words, Vec layout, std::vector<Dataset>* out) {
  PetscInt n, first;
  unsigned long long width = 0;
  PetscFunctionBegin;
  for (const std::string& word : words) width = std::max<unsigned long long>(width, word.size());
  PetscCall(max_over_ranks(comm, &width));
  if (width == 0) PetscFunctionReturn(0);
  PetscCall(VecGetSize(layout, &n));
  PetscCall(VecGetOwnershipRange(layout, &first, nullptr));
  Words table;
  table.width = static_cast<std::size_t>(width);
  for (std::string word : words) {
    word.resize(table.width, '\0');
    table.text += word;
  }
  out->push_back({path, first, n, 0, std::move(table)});
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::take_constants(std::vector<Dataset>* out) {
  PetscFunctionBegin;
  out->clear();
  PetscCall(add_words(comm_, "/states/labels", system_.labels, system_.x0, out));
  PetscCall(add_words(comm_, "/states/units", system_.units, system_.x0, out));
  if (!system_.B) PetscFunctionReturn(0);
  PetscCall(add_words(comm_, "/sources/labels", system_.source_labels, u_, out));
  PetscCall(add_words(comm_, "/sources/units", system_.source_units, u_, out));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::gather_state(Vec y, std::vector<StatePart>* parts) {
  PetscFunctionBegin;
  PetscCall(VecCopy(y, work_));
  *parts = {{"states", work_}};
  PetscFunctionReturn(0);
}

PetscErrorCode LinearModel::fingerprint(std::uint64_t* value) {
  RowSum sum;
  PetscFunctionBegin;
  std::uint64_t table = 0;
  for (Mat matrix : {system_.G.get(), system_.C.get(), system_.B.get()}) {
    table += 2;
    if (!matrix) continue;
    PetscInt first, last;
    PetscCall(MatGetOwnershipRange(matrix, &first, &last));
    for (PetscInt i = first; i < last; ++i) {
      PetscInt n;
      const PetscInt* columns;
      const PetscScalar* values;
      PetscCall(MatGetRow(matrix, i, &n, &columns, &values));
      sum.add(table, i, 1, static_cast<int>(n), columns);
      sum.add(table + 1, i, 1, static_cast<int>(n), values);
      PetscCall(MatRestoreRow(matrix, i, &n, &columns, &values));
    }
  }
  *value = sum.value();
  PetscCall(sum_over_ranks(comm_, value));
  PetscFunctionReturn(0);
}

}  // namespace bs
