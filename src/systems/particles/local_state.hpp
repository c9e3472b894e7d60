// The state of this rank's particles and of their ghosts, side by side.
#pragma once
#include <cstdint>
#include <utility>
#include "base/arrays.hpp"
#include "network/network.hpp"

namespace bs {

/// Holds (x, v) of every local particle, block 2d each: owned first, then ghosts. Fixed particles stand where they
/// started, at rest, and what is driven is where its motion takes it, whatever the vector says, so that forces do not depend on
/// their entries. Ghosts have v = 0 where no damper needs it: only positions travel then.
class LocalState {
 public:
  /// Collective. `net` must outlive the object; `layout` is a state vector.
  PetscErrorCode create(const Network& net, Vec layout);
  /// Collective. Fills the local states of time t from y by one scatter.
  PetscErrorCode gather(double t, Vec y);
  /// The same in two: owned states are there after the first, ghosts after the second.
  PetscErrorCode gather_begin(double t, Vec y);
  PetscErrorCode gather_end(double t, Vec y);
  /// What is driven, of the state gathered last, is moved to where it is at time t; images keep their velocities: who asks wants positions alone.
  void drive_to(double t);
  /// The same for a direction: zero where components are held; images move as their particles do.
  PetscErrorCode gather_direction(Vec z);
  /// Of the state gathered last; known after gather_begin.
  double time() const { return time_; }
  bool created() const { return net_ != nullptr; }
  /// Changes whenever owned states do; what has been computed of them alone still holds while it is the same.
  std::uint64_t version() const { return version_; }
  /// 2d numbers (x, v) of local particle i. Images stand where they are, not where their particles are.
  const double* at(PetscInt i) const { return values_.data() + static_cast<std::size_t>(i) * width_; }
  /// Tensions [N], one for each link, that tangents take in place of those of the springs as they are; borrowed; null: there are none.
  void set_tensions(const double* tensions) { tensions_ = tensions; }
  const double* tensions() const { return tensions_; }

 private:
  PetscErrorCode scatter_begin(Vec y);
  bool is_last(Vec y);
  void copy_owned(const double* states);
  PetscErrorCode scatter_end(Vec y);
  void hold(double t, PetscInt first, PetscInt last);
  void note_driven();
  const Network* net_ = nullptr;
  std::size_t width_ = 0;
  VecHandle ghost_values_;
  ScatterHandle scatter_;
  HugeVector<double> values_;
  std::uint64_t version_ = 0;
  std::pair<PetscObjectId, PetscObjectState> last_{0, 0};  ///< vector and its state that owned states were taken from; 0: no vector's
  bool velocities_ = true;                                 ///< of ghosts travel
  const double* tensions_ = nullptr;
  double time_ = 0;  ///< of the state gathered last, and of the images' displacements
};

}  // namespace bs
