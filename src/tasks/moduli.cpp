#include "tasks/moduli.hpp"
#include <limits>
#include "base/fault.hpp"
#include "tasks/strain_relaxation.hpp"

namespace bs {

PetscErrorCode Moduli::begin(Equilibrium& model) {
  StrainResponse strained;
  PetscFunctionBegin;
  PetscCall(model.strain_response(0, model.initial_state(), &strained));
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
  StrainRelaxation relaxed;
  PetscMPIInt rank;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm(), &rank));
  PetscCall(relaxed.find(ts, J, model, t, y));
  if (!(relaxed.left() <= GOOD)) {
    out->why = format(
        "-bs_task moduli: the relaxation of the particles leaves %.2g of the forces that a strain makes: the lattice is too floppy for this linear "
        "solver; give -condensed_pc_type cholesky",
        relaxed.left());
    PetscFunctionReturn(0);
  }
  value_ = relaxed.stiffness();
  put(rank, relaxed.strained(), out);
  PetscFunctionReturn(0);
}

}  // namespace bs
