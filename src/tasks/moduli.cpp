#include "tasks/moduli.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/fault.hpp"
#include "tasks/tangent_solve.hpp"

namespace bs {

PetscErrorCode Moduli::begin(Equilibrium& model) {
  StrainResponse strained;
  PetscFunctionBegin;
  PetscCall(model.mechanics()->strain_response(0, model.initial_state(), &strained));
  if (strained.count == 0)
    PetscCall(
        tell(model.comm(), Exit::input, "-bs_task moduli: the lattice has no periodic box: give -bs_lattice_periodic or a lattice file with /box"));
  if (!strained.held.empty())
    PetscCall(tell(model.comm(), Exit::input, "-bs_task moduli: " + strained.held + " do not follow the strain of the box: leave them out"));
  count_ = strained.count;
  value_.assign(static_cast<std::size_t>(count_ * count_), std::numeric_limits<double>::quiet_NaN());
  PetscFunctionReturn(0);
}

Dataset Moduli::table(PetscMPIInt rank) const {
  return {"/moduli/stiffness",
          0,
          count_,
          count_,
          rank == 0 ? value_ : std::vector<double>{},  // its rows are written by one rank
          {{"components", count_ == 1   ? "xx"
                          : count_ == 3 ? "xx,yy,xy"
                                        : "xx,yy,zz,yz,xz,xy"},
           {"meaning", "second derivatives of the energy by strain per volume, engineering shears, stresses at hand included"}}};
}

PetscErrorCode Moduli::relax(TS ts, Mat J, Equilibrium& model, double t, Vec y, const StrainResponse& strained, double* left) {
  const Layout at = model.mechanics()->layout();
  const std::size_t q = static_cast<std::size_t>(count_), size = static_cast<std::size_t>(at.particles * at.dim);
  constexpr double ROUNDING = 1e-13;
  TangentSolve solve;
  VecHandle load, u;
  std::vector<double> sums(q * q, 0.0);
  PetscFunctionBegin;
  PetscCall(solve.prepare(ts, J, model, t, y));
  for (VecHandle* vec : {&load, &u}) PetscCall(VecDuplicate(y, vec->out()));
  *left = 0;
  for (std::size_t a = 0; a < q; ++a) {
    PetscScalar* f = nullptr;
    const PetscScalar* moved = nullptr;
    double one = 0;
    PetscCall(VecZeroEntries(load));
    PetscCall(VecGetArray(load, &f));
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c) f[at.v(i, c)] = strained.force[a * size + static_cast<std::size_t>(i * at.dim + c)];
    PetscCall(VecRestoreArray(load, &f));
    PetscReal norm = 0;
    PetscCall(VecNorm(load, NORM_2, &norm));
    if (norm <= ROUNDING * strained.size[a]) continue;  // every particle follows the strain by itself
    PetscCall(solve.solve(load, u, &one));
    *left = std::max(*left, one * norm / strained.size[a]);  // of what the springs add up to
    PetscCall(VecGetArrayRead(u, &moved));
    for (std::size_t b = 0; b < q; ++b)
      for (PetscInt i = 0; i < at.particles; ++i)
        for (PetscInt c = 0; c < at.dim; ++c)
          sums[a * q + b] += strained.force[b * size + static_cast<std::size_t>(i * at.dim + c)] * moved[at.x(i, c)];
    PetscCall(VecRestoreArrayRead(u, &moved));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<PetscMPIInt>(sums.size()), MPI_DOUBLE, MPI_SUM, model.comm()));
  for (std::size_t a = 0; a < q; ++a)
    for (std::size_t b = 0; b < q; ++b)
      value_[a * q + b] = (strained.affine[a * q + b] - 0.5 * (sums[a * q + b] + sums[b * q + a])) / strained.volume;
  PetscFunctionReturn(0);
}

void Moduli::put(PetscMPIInt rank, const StrainResponse& strained, Findings* out) const {
  static const char* const NAMES[3][6] = {{"xx"}, {"xx", "yy", "xy"}, {"xx", "yy", "zz", "yz", "xz", "xy"}};
  const char* const* names = NAMES[count_ == 1 ? 0 : count_ == 3 ? 1 : 2];
  std::string stress = "stress:";
  for (int a = 0; a < count_; ++a) {
    std::string text = std::string("stiffness, row ") + names[a] + ":";
    for (int b = 0; b < count_; ++b) text += format(" %.8g", value_[static_cast<std::size_t>(a * count_ + b)]);
    out->lines.push_back(text);
    stress += format(" %s %.6g", names[a], strained.stress[static_cast<std::size_t>(a)]);
  }
  out->lines.push_back(stress);
  std::vector<std::vector<double>> rows;
  for (int a = 0; a < count_; ++a) rows.emplace_back(value_.begin() + a * count_, value_.begin() + (a + 1) * count_);
  out->matrices.emplace_back("stiffness", std::move(rows));
  out->tables.push_back(table(rank));
}

PetscErrorCode Moduli::find(TS ts, Mat J, Equilibrium& model, double t, Vec y, Findings* out) {
  constexpr double GOOD = 1e-9;
  StrainResponse strained;
  double left = 0;
  PetscMPIInt rank;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm(), &rank));
  PetscCall(model.mechanics()->strain_response(model.factor(t), y, &strained));
  PetscCall(relax(ts, J, model, t, y, strained, &left));
  if (!(left <= GOOD)) {
    out->why = format(
        "-bs_task moduli: the relaxation of the particles leaves %.2g of the forces that a strain makes: the lattice is too floppy for this linear "
        "solver; give -condensed_pc_type cholesky",
        left);
    PetscFunctionReturn(0);
  }
  put(rank, strained, out);
  PetscFunctionReturn(0);
}

}  // namespace bs
