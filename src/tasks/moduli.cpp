#include "tasks/moduli.hpp"
#include <limits>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "tasks/strain_relaxation.hpp"
#include "tasks/tangent_solve.hpp"

namespace bs {

/// Collective. Motions of a periodic lattice that meet no resistance: independent motions q with |q.K q| < delta q.s q at the state that `lin` is
/// linearised at, less the d translations, by Sylvester's law of inertia: the negative pivots of -K - delta diag(s) less those of -K + delta diag(s).
/// delta is 1e-9, s the stiffness of all springs at each particle, so that neither masses nor springs that are stiff elsewhere count. K must be
/// symmetric. -1: MUMPS, which factors both, is not there or failed.
static PetscErrorCode count_zero_modes(Linearisation& lin, PetscInt* count) {
  constexpr double NOTHING = 1e-9;
  TangentFactors factors;
  PetscInt below[2] = {0, 0};
  PetscFunctionBegin;
  *count = -1;
  PetscCall(factors.create(lin));
  below[0] = lin.unknowns();
  for (int k = 0; k < 2 && factors.mean() > 0; ++k) {
    bool good = false;
    PetscCall(factors.factor_raised(k == 0 ? -NOTHING : NOTHING, &good));
    if (!good) PetscFunctionReturn(0);
    PetscCall(factors.negative_pivots(&below[k]));
  }
  *count = below[0] - below[1] - lin.layout().dim;
  PetscFunctionReturn(0);
}

PetscErrorCode Moduli::begin(Equilibrium& model, std::int64_t unknowns) {
  StrainResponse strained;
  PetscFunctionBegin;
  PetscCall(model.strain_response(0, model.initial_state(), &strained));
  if (strained.count == 0)
    PetscCall(
        fail(model.comm(), Exit::input, "-bs_task moduli: the lattice has no periodic box: give -bs_lattice_periodic or a lattice file with /box"));
  if (!strained.held.empty())
    PetscCall(fail(model.comm(), Exit::input, "-bs_task moduli: " + strained.held + " do not follow the strain of the box: leave them out"));
  most_ = unknowns;
  count_ = strained.count;
  dim_ = model.dim();
  names_ = component_names(dim_);
  value_.assign(static_cast<std::size_t>(count_ * count_), std::numeric_limits<double>::quiet_NaN());
  PetscFunctionReturn(0);
}

/// Their rows are written by one rank.
void Moduli::add_tables(PetscMPIInt rank, std::vector<Dataset>* out) const {
  std::string components;
  for (const std::string& name : names_) components += (components.empty() ? "" : ",") + name;
  out->push_back({"/moduli/stiffness",
                  0,
                  count_,
                  count_,
                  rank == 0 ? value_ : std::vector<double>{},
                  {{"components", components},
                   {"meaning", "second derivatives of the energy by strain per volume, engineering shears, stresses at hand included"}},
                  {1, 2 - dim_, -2}});
  out->push_back({"/moduli/zero_modes",
                  0,
                  1,
                  0,
                  rank == 0 ? std::vector<std::int64_t>{floppy_} : std::vector<std::int64_t>{},
                  {{"meaning", "motions without stiffness beyond the translations; -1: not counted"}}});
}

PetscErrorCode Moduli::count_floppy(Equilibrium& model) {
  Linearisation& lin = model.mechanics()->linearisation();
  PetscFunctionBegin;
  if (lin.unknowns() <= most_) PetscCall(count_zero_modes(lin, &floppy_));
  PetscFunctionReturn(0);
}

void Moduli::put(PetscMPIInt rank, const StrainResponse& strained, FinalResults* out) const {
  std::string stress = "stress:";
  for (int a = 0; a < count_; ++a) {
    std::string text = "stiffness, row " + names_[static_cast<std::size_t>(a)] + ":";
    for (int b = 0; b < count_; ++b) text += format(" %.8g", value_[static_cast<std::size_t>(a * count_ + b)]);
    out->lines.push_back(text);
    stress += format(" %s %.6g", names_[static_cast<std::size_t>(a)].c_str(), strained.stress[static_cast<std::size_t>(a)]);
  }
  out->lines.push_back(stress);
  std::vector<std::vector<double>> rows;
  rows.reserve(static_cast<std::size_t>(count_));
  for (int a = 0; a < count_; ++a) rows.emplace_back(value_.begin() + a * count_, value_.begin() + (a + 1) * count_);
  out->report.set("stiffness", rows);
  if (floppy_ != 0)
    out->lines.push_back(
        floppy_ > 0
            ? how_many(floppy_,
                       "motion{ beside the translations meets|s beside the translations meet} no resistance: floppy parts, which carry nothing")
            : "motions without resistance were not counted (-bs_zero_modes_unknowns)");
  out->report.set("zero_modes", floppy_);
  add_tables(rank, &out->tables);
}

PetscErrorCode Moduli::find(TS ts, Mat J, Equilibrium& model, double t, Vec y, FinalResults* out) {
  StrainRelaxation relaxed;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(model.comm());
  PetscCall(relaxed.find(ts, J, model, t, y));
  if (!(relaxed.left() <= StrainRelaxation::GOOD)) {
    out->failure = format(
        "-bs_task moduli: the relaxation of the particles leaves %.2g of the forces that a strain makes: the lattice is too floppy for this linear "
        "solver; give -condensed_pc_type cholesky",
        relaxed.left());
    if (relaxed.memory_lack().yes) out->failure = "-bs_task moduli: " + relaxed.memory_lack().said();
    PetscFunctionReturn(0);
  }
  value_ = relaxed.stiffness();
  PetscCall(count_floppy(model));
  put(rank, relaxed.strained(), out);
  PetscFunctionReturn(0);
}

}  // namespace bs
