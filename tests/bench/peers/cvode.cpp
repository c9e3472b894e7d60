// SUNDIALS CVODE on y' = (v, f/m): BDF with Newton and GMRES, Jacobian products by differences, no preconditioner
// (--adams 0); or Adams with functional iteration (--adams 1). Steps and orders are CVODE's, within --rtol.
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sunlinsol/sunlinsol_spgmr.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>
#include <cstdio>
#include <cstring>
#include "cube.hpp"

struct System {
  const peers::Cube* cube;
  double deadline;
};

// y = (all positions, all velocities)
static int right_side(realtype, N_Vector y, N_Vector ydot, void* data) {
  const System& system = *static_cast<System*>(data);
  const peers::Cube& cube = *system.cube;
  const std::size_t half = 3 * cube.particles;
  const double* a = N_VGetArrayPointer(y);
  double* out = N_VGetArrayPointer(ydot);
  std::memcpy(out, a + half, half * sizeof(double));
  forces(cube, a, out + half);
  for (std::size_t k = half; k < 2 * half; ++k) out[k] /= cube.mass;
  return peers::now() > system.deadline ? -1 : 0;
}

int main(int argc, char** argv) {
  const peers::Arguments given(argc, argv, {{"n", 12}, {"time", 0.05}, {"stiff", 0}, {"adams", 0}, {"rtol", 1e-4}, {"atol", 1e-6}, {"limit", 1e9}});
  const peers::Cube cube = peers::make_cube(given.whole("n"), given["stiff"] != 0);
  const std::size_t half = 3 * cube.particles;
  SUNContext context;
  if (SUNContext_Create(nullptr, &context)) return 1;
  N_Vector y = N_VNew_Serial(static_cast<sunindextype>(2 * half), context);
  std::memcpy(N_VGetArrayPointer(y), cube.x.data(), half * sizeof(double));
  std::memcpy(N_VGetArrayPointer(y) + half, cube.v.data(), half * sizeof(double));
  const bool adams = given["adams"] != 0;
  void* memory = CVodeCreate(adams ? CV_ADAMS : CV_BDF, context);
  const double start = peers::now();
  System system{&cube, start + given["limit"]};
  SUNLinearSolver linear = nullptr;
  SUNNonlinearSolver nonlinear = nullptr;
  if (CVodeInit(memory, right_side, 0.0, y) || CVodeSStolerances(memory, given["rtol"], given["atol"]) || CVodeSetUserData(memory, &system) ||
      CVodeSetMaxNumSteps(memory, 100000000))
    return 1;
  if (adams) {
    nonlinear = SUNNonlinSol_FixedPoint(y, 0, context);
    if (CVodeSetNonlinearSolver(memory, nonlinear)) return 1;
  } else {
    linear = SUNLinSol_SPGMR(y, SUN_PREC_NONE, 30, context);
    if (CVodeSetLinearSolver(memory, linear, nullptr)) return 1;
  }
  CVodeSetErrFile(memory, nullptr);
  realtype reached = 0;
  const int status = CVode(memory, given["time"], y, &reached, CV_NORMAL);
  const double seconds = peers::now() - start;
  long steps = 0, evaluations = 0, newton = 0, krylov = 0, products = 0;
  CVodeGetNumSteps(memory, &steps);
  CVodeGetNumRhsEvals(memory, &evaluations);
  CVodeGetNumNonlinSolvIters(memory, &newton);
  if (!adams) {
    CVodeGetNumLinIters(memory, &krylov);
    CVodeGetNumLinRhsEvals(memory, &products);
  }
  peers::print_json({{"seconds", seconds},
                     {"steps", static_cast<double>(steps)},
                     {"newton", static_cast<double>(newton)},
                     {"krylov", static_cast<double>(krylov)},
                     {"evaluations", static_cast<double>(evaluations + products)},
                     {"reached", reached},
                     {"converged", status >= 0}},
                    N_VGetArrayPointer(y) + half - 3);
  CVodeFree(&memory);
  if (linear) SUNLinSolFree(linear);
  if (nonlinear) SUNNonlinSolFree(nonlinear);
  N_VDestroy(y);
  SUNContext_Free(&context);
  return 0;
}
