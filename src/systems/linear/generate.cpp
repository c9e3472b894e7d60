// Built-in linear systems.
#include <cmath>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/memory.hpp"
#include "systems/linear/system.hpp"

namespace bs {
namespace {

constexpr PetscInt LABELLED = 100000;  // states; beyond, labels would only be numbers that take space

PetscErrorCode create(MPI_Comm comm, PetscInt rows, PetscInt columns, PetscInt width, MatHandle* out) {
  PetscFunctionBegin;
  PetscCall(MatCreateAIJ(comm, PETSC_DECIDE, PETSC_DECIDE, rows, columns, width, nullptr, width, nullptr, out->out()));
  PetscFunctionReturn(0);
}

PetscErrorCode start(MPI_Comm comm, PetscInt n, PetscInt width, LinearSystem* out) {
  PetscFunctionBegin;
  const PetscMPIInt ranks = size_of(comm);
  // G, C, B and four vectors; the matrix of a step, which explicit types do without, asks for itself
  const double entries = static_cast<double>(width) + 2, row = entries * (sizeof(PetscScalar) + sizeof(PetscInt)) + 4 * sizeof(PetscScalar);
  PetscCall(reserve_memory(comm, {"a linear system of " + how_many(n, "state"), static_cast<double>(n) * row / ranks, ""}));
  PetscCall(create(comm, n, n, width, &out->G));
  PetscCall(create(comm, n, n, 1, &out->C));
  PetscCall(create(comm, n, 1, 1, &out->B));
  PetscFunctionReturn(0);
}

PetscErrorCode finish(LinearSystem* s) {
  PetscFunctionBegin;
  PetscCall(assemble(s->G));
  PetscCall(assemble(s->C));
  PetscCall(assemble(s->B));
  s->source = "step(1)";
  PetscFunctionReturn(0);
}

// Nodes in a line, each with C_i to ground; R_i joins node i to the one before, R_0 the source to node 0:
//   C_i v_i' + (v_i - v_{i-1})/R_i + (v_i - v_{i+1})/R_{i+1} = 0,  R_i = R (1 + a sin 1.7 i), C_i = C (1 + a cos 0.9 i)
PetscErrorCode rc_ladder(MPI_Comm comm, PetscInt n, const SystemOptions& o, LinearSystem* out) {
  PetscInt first, last;
  PetscFunctionBegin;
  PetscCall(start(comm, n, 3, out));
  PetscCall(MatGetOwnershipRange(out->G, &first, &last));
  const auto conductance = [&](PetscInt i) { return 1 / (o.resistance * (1 + o.vary * std::sin(1.7 * static_cast<double>(i)))); };
  for (PetscInt i = first; i < last; ++i) {
    const double left = conductance(i), right = i + 1 < n ? conductance(i + 1) : 0.0;
    PetscCall(MatSetValue(out->G, i, i, left + right, INSERT_VALUES));
    if (i > 0) PetscCall(MatSetValue(out->G, i, i - 1, -left, INSERT_VALUES));
    else PetscCall(MatSetValue(out->B, 0, 0, left, INSERT_VALUES));
    if (i + 1 < n) PetscCall(MatSetValue(out->G, i, i + 1, -right, INSERT_VALUES));
    PetscCall(MatSetValue(out->C, i, i, o.capacitance * (1 + o.vary * std::cos(0.9 * static_cast<double>(i))), INSERT_VALUES));
    if (n <= LABELLED) out->labels.push_back("v" + std::to_string(i + 1));
  }
  PetscCall(finish(out));
  PetscFunctionReturn(0);
}

// Source, R, L, C in series; unknowns v1 v2 v3 iL iV, three algebraic rows:
//   (v1 - v2)/R + iV = 0;  (v2 - v1)/R + iL = 0;  C v3' - iL = 0;  L iL' + v3 - v2 = 0;  v1 = u
PetscErrorCode rlc(MPI_Comm comm, const SystemOptions& o, LinearSystem* out) {
  PetscInt first, last;
  PetscFunctionBegin;
  const double g = 1 / (o.resistance_given ? o.resistance : 20.0), capacitance = o.capacitance_given ? o.capacitance : 1e-6;
  const double G[5][5] = {{g, -g, 0, 0, 1}, {-g, g, 0, 1, 0}, {0, 0, 0, -1, 0}, {0, -1, 1, 0, 0}, {1, 0, 0, 0, 0}};
  const char* const names[5] = {"v1", "v2", "v3", "iL", "iV"};
  PetscCall(start(comm, 5, 5, out));
  PetscCall(MatGetOwnershipRange(out->G, &first, &last));
  for (PetscInt i = first; i < last; ++i) {
    for (PetscInt j = 0; j < 5; ++j)
      if (G[i][j] != 0) PetscCall(MatSetValue(out->G, i, j, G[i][j], INSERT_VALUES));
    if (i == 2) PetscCall(MatSetValue(out->C, 2, 2, capacitance, INSERT_VALUES));
    if (i == 3) PetscCall(MatSetValue(out->C, 3, 3, o.inductance, INSERT_VALUES));
    if (i == 4) PetscCall(MatSetValue(out->B, 4, 0, 1, INSERT_VALUES));
    out->labels.push_back(names[i]);
  }
  PetscCall(finish(out));
  PetscFunctionReturn(0);
}

// T' = kappa Laplace T on the unit interval or square, finite volumes of width 1/(n + 1); the left side is held at
// u(t), the others at 0. Cells are numbered along x first.
PetscErrorCode heat(MPI_Comm comm, PetscInt nx, PetscInt ny, const SystemOptions& o, LinearSystem* out) {
  PetscInt first, last;
  PetscFunctionBegin;
  const bool plane = ny > 0;
  const PetscInt rows = plane ? ny : 1, n = nx * rows;
  const double dx = 1.0 / static_cast<double>(nx + 1), dy = plane ? 1.0 / static_cast<double>(ny + 1) : 1.0;
  const double gx = o.conductivity * dy / dx, gy = plane ? o.conductivity * dx / dy : 0.0;
  PetscCall(start(comm, n, plane ? 5 : 3, out));
  PetscCall(MatGetOwnershipRange(out->G, &first, &last));
  for (PetscInt i = first; i < last; ++i) {
    const PetscInt x = i % nx, y = i / nx;
    PetscCall(MatSetValue(out->G, i, i, 2 * gx + 2 * gy, INSERT_VALUES));
    if (x > 0) PetscCall(MatSetValue(out->G, i, i - 1, -gx, INSERT_VALUES));
    else PetscCall(MatSetValue(out->B, i, 0, gx, INSERT_VALUES));
    if (x + 1 < nx) PetscCall(MatSetValue(out->G, i, i + 1, -gx, INSERT_VALUES));
    if (y > 0) PetscCall(MatSetValue(out->G, i, i - nx, -gy, INSERT_VALUES));
    if (y + 1 < rows) PetscCall(MatSetValue(out->G, i, i + nx, -gy, INSERT_VALUES));
    PetscCall(MatSetValue(out->C, i, i, dx * dy, INSERT_VALUES));
    if (n <= LABELLED) out->labels.push_back("T" + std::to_string(x + 1) + (plane ? "," + std::to_string(y + 1) : ""));
  }
  PetscCall(finish(out));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode generate_system(MPI_Comm comm, const SystemOptions& o, LinearSystem* out) {
  static const char* const names[] = {"", "rc_ladder", "rlc", "heat1d", "heat2d"};
  const std::size_t wanted = o.type == 4 ? 2 : o.type == 2 ? 0 : 1;
  double unknowns = 1;
  PetscFunctionBegin;
  for (const std::int64_t k : o.size) unknowns *= static_cast<double>(k);
  std::string error;
  if (o.size.size() != wanted)
    error = wanted == 0 ? std::string("has five states: leave the size out")
                        : format("needs %s: write -bs_linear_size %s", how_many(static_cast<std::int64_t>(wanted), "number").c_str(),
                                 wanted > 1 ? "100,100" : "100");
  for (const std::int64_t k : o.size)
    if (k < 1) error = "needs positive numbers";
  if (error.empty() && unknowns > static_cast<double>(PETSC_MAX_INT) / 5) error = "is too large for this PETSc's indices";
  if (!error.empty()) PetscCall(fail(comm, Exit::input, format("option -bs_linear_size: %s %s", names[o.type], error.c_str())));
  const PetscInt n = o.size.empty() ? 5 : static_cast<PetscInt>(o.size[0]);
  if (o.type == 1) PetscCall(rc_ladder(comm, n, o, out));
  if (o.type == 2) PetscCall(rlc(comm, o, out));
  if (o.type == 3) PetscCall(heat(comm, n, 0, o, out));
  if (o.type == 4) PetscCall(heat(comm, n, static_cast<PetscInt>(o.size[1]), o, out));
  out->origin = std::string("generator ") + names[o.type];
  PetscFunctionReturn(0);
}

}  // namespace bs
