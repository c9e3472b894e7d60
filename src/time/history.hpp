// The history of earlier steps that a time-stepping method uses. PETSc gives no access to its own memory of them, so the states
// a method would need are kept beside it, and given back to a new TS by steps whose solver knows the answer.
#pragma once
#include <petscts.h>
#include <cstdint>
#include <string>
#include <vector>
#include "base/handle.hpp"
#include "checkpoint/checkpoint.hpp"
#include "time/methods.hpp"
#include "time/starter.hpp"

namespace bs {

class History {
 public:
  /// Collective. Once the type of `ts` is set; hooks into its stages.
  PetscErrorCode attach(TS ts);
  /// Collective. Before a step: its start is kept.
  PetscErrorCode begin_step(TS ts);
  /// Collective. After a good step.
  PetscErrorCode end_step(TS ts);
  /// After a good step: the method starts without history.
  void forget();
  /// Before a stage at `time`.
  void before_stage(double time) { starter_.aim(time); }
  /// Collective. After a stage was solved for; of this attempt.
  PetscErrorCode record_stage(TS ts, PetscReal time, Vec stage);
  /// The state the present or last step began with; null before the first one.
  std::int64_t steps() const { return steps_; }  ///< since the method last started without history
  bool replaying() const { return replaying_; }
  /// During a step: the state the last good step began with and that step's length; null where there was none.
  Vec before_last(double* step) const;
  Vec last_start() const { return past_.empty() ? nullptr : past_.back().state.get(); }
  bool in_step() const { return open_; }  ///< whether that is of a step that is not done

  /// What a checkpoint holds of it, between two steps.
  void save(Facts* facts, std::vector<NamedState>* states) const;
  /// Collective. Gives `ts`, which is set up and stands at (time, y), the memory of the run in `file`. `missing` receives
  /// what could not be given back; empty if all was.
  PetscErrorCode restore(TS ts, Model& model, const Checkpoint& file, std::string* missing);

 private:
  using Kind = Memory;
  struct Past {
    double time = 0, step = 0;  ///< of the step that began here; its length
    VecHandle state;
  };
  PetscErrorCode copy(Vec from, VecHandle* to) const;
  PetscErrorCode restore_acceleration(TS ts, Model& model, const Checkpoint& file, std::string* missing);
  PetscErrorCode replay(TS ts);
  /// Whether the present step is one of the first steps of bdf of order 3 to 6, which Starter computes.
  bool in_starting_procedure() const;

  Kind kind_ = Kind::none;
  std::size_t depth_ = 1;   ///< starts of good steps that are needed
  bool open_ = false;       ///< the newest start is of a step not yet done
  std::int64_t steps_ = 0;  ///< since the method last started without history
  std::vector<Past> past_;  ///< oldest first; up to depth_ + 1
  bool replaying_ = false;
  double used_ = 0;     ///< length of this attempt's step
  VecHandle half_;      ///< what bdf's starting procedure finds first, of the first step
  Starter starter_;     ///< of bdf
  Vec kept_ = nullptr;  ///< the acceleration that the type carries; borrowed
};

}  // namespace bs
