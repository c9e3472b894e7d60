// What a task finds: numbers for a program that asks for them, and what a run tells of its last state.
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>
#include "output/report.hpp"
#include "solvers/step_record.hpp"
#include "systems/frame_rows.hpp"
#include "systems/system.hpp"

namespace bs {

/// In the context of a communicator: called after every good load step of tasks on it, whose time is the load factor. Empty: no call.
struct LoadStepObserver {
  std::function<void(const StepRecord&)> on_step;
};

/// Filled by the task that finds it; the same on every rank, particles in the order of the input.
struct Result {
  double load_factor = 0;  ///< statics, moduli: of the last equilibrium
  FrameData frame;         ///< statics, moduli: the last equilibrium, as a trajectory has it, also of a run that failed; modes: what they are about
  std::int64_t steps = 0, rejected = 0, newton = 0, krylov = 0;  ///< statics, moduli: load steps, and iterations in all of them
  std::vector<double> stiffness;                                 ///< moduli: (q, q), row by row, by the components of tasks/moduli.hpp [N/m^(d-1)]
  std::vector<double> omega_squared;                             ///< modes: ascending [1/s^2]
  std::vector<double> shapes;                                    ///< modes: (K, N, d), of the mass matrix's norm 1 [kg^-1/2]
  std::vector<double> residual;                                  ///< modes: bounds of the errors of omega_squared [1/s^2]
  std::int64_t zero_modes = -1;                                  ///< modes, moduli: motions without stiffness; -1: not counted
};

/// What a task computes at the last state of a run, for its report, its trajectory and its summary.
struct FinalResults {
  std::string failure;             ///< why nothing could be computed; empty where it was
  std::vector<Dataset> tables;     ///< of the trajectory, which has them already, without values
  Report report;                   ///< entries of the report
  std::vector<std::string> lines;  ///< of the summary
};

}  // namespace bs
