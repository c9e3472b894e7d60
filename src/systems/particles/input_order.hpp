// Positions and velocities in the input's order, from the state of a rank's particles and back.
#pragma once
#include <utility>
#include <vector>
#include "network/network.hpp"
#include "systems/system.hpp"

namespace bs {

/// Rows that are a rank's own in the input as well as in the state are copied in one pass; the others travel by two scatters.
class InputOrder {
 public:
  /// Collective. `rows`: of the input that are this rank's; `layout`: a state vector. `net` must outlive the object.
  PetscErrorCode create(const Network& net, PetscInt rows, Vec layout);
  bool created() const { return net_ != nullptr; }
  /// Collective. position() and velocity() from y, or y from them.
  PetscErrorCode from_state(Vec y);
  PetscErrorCode to_state(Vec y);
  /// Whether one rank has all rows: then it can make them piece by piece, from a y that must not change meanwhile.
  bool has_all() const { return has_all_; }
  /// Of positions and of velocities. Both of a piece are made in one pass, so ask for both of it before the next.
  std::pair<RowSource, RowSource> sources(Vec y);
  Vec position() const { return position_; }
  Vec velocity() const { return velocity_; }

 private:
  PetscErrorCode create_scatters(Vec layout);
  PetscErrorCode exchange(Vec y, ScatterMode way);
  PetscErrorCode copy(Vec y, PetscInt first, PetscInt count, double* x, double* v) const;
  PetscErrorCode make_piece(Vec y, PetscInt first, PetscInt count);
  const Network* net_ = nullptr;
  std::vector<PetscInt> own_;  ///< of this rank's rows: the owned particle, -1 where it is another rank's
  bool has_all_ = false;
  bool travels_ = false;  ///< some rank has rows that are another's
  VecHandle position_, velocity_;
  std::vector<double> x_, v_;  ///< rows [piece_.first, piece_.first + piece_.second) of both, behind one another
  std::pair<PetscInt, PetscInt> piece_{0, 0};
  ScatterHandle to_position_, to_velocity_;  ///< not created where nothing travels
};

}  // namespace bs
