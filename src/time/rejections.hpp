// Rejected attempts at a step: counted by reason, and limited in number.
#pragma once
#include <petscts.h>
#include <cstdint>
#include <string>
#include "base/factor_memory.hpp"
#include "base/facts.hpp"
#include "solvers/step_record.hpp"
#include "systems/model.hpp"
#include "time/implicit/linear_reuse.hpp"
#include "time/stepping/step_length.hpp"
#include "time/ts_setup.hpp"

namespace bs {

/// "2 line search, 1 error estimate"; empty if there are none.
std::string in_words(const RejectionCounts& counts);

class RejectionWatch {
 public:
  explicit RejectionWatch(Model& model) : model_(model) {}
  /// Hooks into `ts`. A step is given up when an attempt shorter than `step_min` [s] would follow, or after `most`
  /// rejections in a row.
  PetscErrorCode attach(TS ts, double step_min, std::int64_t most);
  /// Collective. Once the solvers are set up: linear solves are judged by their residuals, where the model is linear.
  PetscErrorCode attach_solvers(TS ts, const TSContext& context);
  /// Before a step of length h from time t [s].
  void begin_step(double t, double h) { attempts_.begin(t, h); }
  /// Collective. Before a stage is solved for: whether the attempt before this one was rejected, and whether the limit is reached.
  PetscErrorCode before_stage(TS ts);
  /// Collective. After a step, good or not: counts what is left.
  PetscErrorCode end_step(TS ts);
  /// Since the run began; `restore` sets them.
  const RejectionCounts& counts() const { return counts_; }
  void save(Facts* facts) const;
  void restore(const Facts& facts);
  std::int64_t in_a_row() const { return attempts_.in_a_row(); }
  bool gave_up() const { return gave_up_; }
  /// Why the last attempt was rejected, in words.
  const std::string& last() const { return last_; }
  /// What to try against it.
  std::string advice() const;
  bool lacks_memory() const { return lack_.yes; }
  /// Length of the present attempt [s].
  double length() const { return attempts_.length(); }
  /// Length of the last attempt that was rejected [s].
  double last_attempt() const { return attempts_.last_rejected(); }

 private:
  static PetscErrorCode check(TSAdapt adapt, TS ts, PetscReal time, Vec y, PetscBool* accept);
  PetscErrorCode count_rejection(TS ts);
  bool enough(double next) const { return lack_.yes || stage_.hopeless || attempts_.spent(next); }
  PetscErrorCode name_failure(TS ts);
  PetscErrorCode name_reason(TS ts, bool solve_failed);

  Model& model_;
  LinearCheck linear_;
  const TSContext* context_ = nullptr;
  StageCheck stage_;         ///< of the last attempt
  bool unprepared_ = false;  ///< -snes_mf
  Attempts attempts_;
  PetscInt rejected_ = 0, failures_ = 0;  ///< of the TS, looked at so far
  bool gave_up_ = false;
  MemoryLack lack_;  ///< a shorter step would need as much
  RejectionCounts counts_{};
  std::string last_;
  Rejection last_reason_ = NEWTON;
};

// What a run has done, step by step, over the runs it continues.

/// What a run did, for the summary and the report.
struct RunCounts {
  std::int64_t steps = 0, rejected = 0, newton = 0, krylov = 0, shortened = 0;
};

std::int64_t total(const RejectionCounts& counts);

class StepCounter {
 public:
  const RunCounts& counts() const { return counts_; }
  void add_shortened() { ++counts_.shortened; }
  /// The run has come to step number `steps`.
  void set_steps(std::int64_t steps) { counts_.steps = steps; }
  /// Iterations of the solvers since they were made, and rejections since the run began: what is new goes into `record`.
  void count(std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected, StepRecord* record);
  void save(Facts* facts) const;
  /// `newton`, `krylov`: what the solvers have counted so far and is no step's; `rejected`: of the run.
  void restore(const Facts& facts, std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected);

 private:
  RunCounts counts_;
  RejectionCounts rejected_{};                          ///< by reason, at the last count
  std::int64_t newton_before_ = 0, krylov_before_ = 0;  ///< to be added to what the solvers count
};

}  // namespace bs
