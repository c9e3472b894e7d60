// How the step compares with the fastest oscillation, at the start of a run and as the system changes, and whether explicit steps would cost less.
#pragma once
#include <petscts.h>
#include <string>
#include <vector>
#include "base/error.hpp"
#include "output/report.hpp"
#include "tasks/spectrum.hpp"
#include "time/ts_setup.hpp"

namespace bs {

struct Advice {
  Spectrum spectrum;
  double step = 0;           ///< h, nominal [s]
  double explicit_step = 0;  ///< largest stable step of symplectic Euler [s]; 0: nothing to say
  std::string hint;          ///< one line, or empty
  /// Lines of the header; none where there is nothing to say.
  std::vector<std::string> lines() const;
  /// Keys of the closing report; none where there is nothing to say.
  void put(Report* report) const;
  /// The same figures for the trajectory, under /backspring/advice; `rank` 0 holds them.
  void put(PetscMPIInt rank, std::vector<Dataset>* constants) const;
};

/// The largest stable step of an explicit `method` on oscillations up to `omega` with damping rates up to `damping` [s]; 0: it has none, or is not
/// known.
double largest_stable_step(const Method& method, double omega, double damping);

/// Reads -bs_advise (on by default).
PetscErrorCode read_advise(MPI_Comm comm, bool* wanted);

/// Collective. Looks at `model` around its initial state with at most 15 evaluations of the forces; reports nothing for models
/// without particles or without oscillations. Call once the TS is set up.
PetscErrorCode advise(Model& model, TS ts, const TSContext& context, Advice* out);

/// Springs that stiffen, or meet, make steps unstable that were stable at the start, and sheets that fold make implicit steps dear. After steps 1, 2,
/// 4, ... 512 and every 512th, the fastest oscillation is estimated anew where it matters, by at most 15 evaluations of the forces; from below, so
/// that nothing is said of a step that is stable.
class StepWatch {
 public:
  StepWatch(Model& model, Warnings& warnings) : model_(model), warnings_(warnings) {}
  /// Watches types of fixed steps on mechanical systems: explicit ones that are stable at the start, by what was found there, for their stability,
  /// implicit ones for their cost.
  PetscErrorCode begin(TS ts, const TSContext& context, const Advice& start);
  /// Collective. After a step; warns once.
  PetscErrorCode check(PetscInt step, double t, Vec y);

 private:
  PetscErrorCode check_limit(PetscInt step, double t, Vec y);
  PetscErrorCode check_cost(PetscInt step, double t, Vec y);
  double explicit_seconds(double t, double most) const;

  Model& model_;
  Warnings& warnings_;
  const Method* method_ = nullptr;  ///< null: not watched
  bool implicit_ = false;
  double step_ = 0;                                ///< nominal [s]
  double evaluation_ = 0, limit_ = 0, start_ = 0;  ///< seconds of a force evaluation; largest stable explicit step, and time at the start [s]
  double wall_ = 0;                                ///< MPI_Wtime at the start
};

}  // namespace bs
