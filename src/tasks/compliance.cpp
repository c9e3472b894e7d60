#include "tasks/compliance.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/vec_array.hpp"
#include "tasks/tangent_solve.hpp"

namespace bs {

PetscErrorCode Compliance::begin(Equilibrium& model, const std::vector<std::string>& names) {
  const std::vector<ParticleGroup> all = model.mechanics()->groups();
  std::string known, fault;
  PetscFunctionBegin;
  for (const ParticleGroup& group : all) known += (known.empty() ? "" : ", ") + group.name;
  for (const std::string& name : names) {
    const auto at = std::find_if(all.begin(), all.end(), [&](const ParticleGroup& one) { return one.name == name; });
    if (at == all.end())
      fault = "there is no group " + name + ": choose its particles by -bs_group_" + name + (known.empty() ? "" : ", or name some of " + known);
    else if (std::any_of(groups_.begin(), groups_.end(), [&](const ParticleGroup& one) { return one.name == name; }))
      fault = "the group " + name + " is named twice: name it once";
    else groups_.push_back(*at);
    if (!fault.empty()) PetscCall(fail(model.comm(), Exit::input, "option -bs_compliance_groups: " + fault));
  }
  if (wanted() && model.free_bodies() > 0)
    PetscCall(
        fail(model.comm(), Exit::input,
             format("option -bs_compliance_groups: bodies that are tied to nothing (%lld of them) yield to loads without end: fix a particle of "
                    "each, tie it to an anchor, or leave the option out",
                    static_cast<long long>(model.free_bodies()))));
  dim_ = model.dim();
  const std::size_t size = groups_.size() * static_cast<std::size_t>(dim_);
  value_.assign(size * size, std::numeric_limits<double>::quiet_NaN());
  PetscFunctionReturn(0);
}

Dataset Compliance::table(PetscMPIInt rank) const {
  std::string names;
  for (const ParticleGroup& group : groups_) names += (names.empty() ? "" : ",") + group.name;
  const int size = static_cast<int>(groups_.size()) * dim_;
  return {"/compliance/matrix",
          0,
          size,
          size,
          rank == 0 ? value_ : std::vector<double>{},  // its rows are written by one rank
          {{"groups", names}, {"meaning", "mean displacement of each group along each axis per unit force on each group along each axis"}},
          {-1, 0, 2}};
}

PetscErrorCode Compliance::set_load(Mechanics& mechanics, std::size_t group, PetscInt component, Vec load) const {
  const Layout& at = mechanics.layout();
  PetscFunctionBegin;
  PetscCall(VecZeroEntries(load));
  const WriteArray a(load);
  for (const PetscInt i : groups_[group].member)
    if (mechanics.linearisation().moves(i, component)) a[at.v(i, component)] = 1 / static_cast<double>(groups_[group].total);
  PetscFunctionReturn(0);
}

/// Whether the stiffness of the motion u, u.f/u.Mu, differs from the shift of the solve, which is all that a motion without resistance has.
PetscErrorCode Compliance::is_resisted(Equilibrium& model, Vec load, Vec u, bool* yes) const {
  constexpr double DISTINCT = 10;
  const Layout at = layout_of(u);
  const std::vector<double>& masses = model.mechanics()->masses();
  double sums[2] = {0, 0};
  PetscFunctionBegin;
  const ReadArray af(load), au(u);
  for (PetscInt i = 0; i < at.particles; ++i)
    for (PetscInt c = 0; c < at.dim; ++c) {
      sums[0] += af[at.v(i, c)] * au[at.x(i, c)];
      sums[1] += masses[static_cast<std::size_t>(i)] * au[at.x(i, c)] * au[at.x(i, c)];
    }
  PetscCall(sum_over_ranks(model.comm(), sums, 2));
  *yes = std::abs(sums[0]) > DISTINCT * model.sharp_shift() * sums[1];
  PetscFunctionReturn(0);
}

/// Column `column` of C.
PetscErrorCode Compliance::add_means(MPI_Comm comm, Vec u, std::size_t column) {
  const Layout at = layout_of(u);
  const std::size_t d = static_cast<std::size_t>(dim_), size = groups_.size() * d;
  std::vector<double> sums(size, 0.0);
  PetscFunctionBegin;
  const ReadArray a(u);
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (const PetscInt i : groups_[g].member)
      for (std::size_t c = 0; c < d; ++c) sums[g * d + c] += a[at.x(i, static_cast<PetscInt>(c))];
  PetscCall(sum_over_ranks(comm, sums.data(), size));
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (std::size_t k = g * d; k < (g + 1) * d; ++k) value_[k * size + column] = sums[k] / static_cast<double>(groups_[g].total);
  PetscFunctionReturn(0);
}

void Compliance::put(PetscMPIInt rank, FinalResults* out) const {
  const std::size_t d = static_cast<std::size_t>(dim_), size = groups_.size() * d;
  Report entry;
  std::vector<std::string> names;
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    std::string text = "compliance of " + groups_[g].name + " [m/N]:";
    for (std::size_t c = 0; c < d; ++c) text += format(" %c %.6g", 'x' + static_cast<int>(c), value_[(g * d + c) * (size + 1)]);
    out->lines.push_back(text);
    names.push_back(groups_[g].name);
  }
  entry.set("groups", names);
  entry.set("matrix", value_);
  out->report.set("compliance", entry);
  out->tables.push_back(table(rank));
}

PetscErrorCode Compliance::find(TS ts, Mat J, Equilibrium& model, double t, Vec y, FinalResults* out) {
  constexpr double GOOD = 1e-7;
  VecHandle load, u;
  TangentSolve solve;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(model.comm());
  PetscCall(solve.prepare(ts, J, model, t, y));
  for (VecHandle* vec : {&load, &u}) PetscCall(VecDuplicate(y, vec->out()));
  for (std::size_t g = 0; g < groups_.size(); ++g)
    for (int c = 0; c < dim_; ++c) {
      bool resisted = false;
      PetscCall(set_load(*model.mechanics(), g, c, load));
      double left = 0;
      PetscCall(solve.solve(load, u, GOOD, &left));
      resisted = left <= GOOD;
      if (resisted && left >= 0) PetscCall(is_resisted(model, load, u, &resisted));
      if (!resisted) {
        out->failure = format(
            "option -bs_compliance_groups: no displacement bears a load on the group %s along %c: a motion of the structure meets no resistance, "
            "or too little for this linear solver; hold it by fixed particles or anchors, or give -condensed_pc_type cholesky",
            groups_[g].name.c_str(), 'x' + c);
        if (solve.memory_lack().yes) out->failure = "option -bs_compliance_groups: " + solve.memory_lack().said();
        PetscFunctionReturn(0);
      }
      PetscCall(add_means(model.comm(), u, g * static_cast<std::size_t>(dim_) + static_cast<std::size_t>(c)));
    }
  put(rank, out);
  PetscFunctionReturn(0);
}

}  // namespace bs
