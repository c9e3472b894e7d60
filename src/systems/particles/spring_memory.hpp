// Internal variables of springs (plastic stretch, ...): written to frames and checkpoints, and restored.
#pragma once
#include <string>
#include <vector>
#include "systems/model.hpp"
#include "systems/particles/spring_table.hpp"

namespace bs {

class SpringMemory {
 public:
  /// Collective. `net` must outlive the object; `rows`: this rank's springs in the input's order.
  PetscErrorCode create(Network& net, const Rows& rows);
  /// Whether some spring of some rank has a law with history.
  bool active() const { return !numbers_.empty(); }
  /// Collective. The numbers by name, 0 where a spring's law has none of that name; vectors borrowed.
  PetscErrorCode gather(std::vector<StatePart>* parts);
  /// The same for a frame.
  PetscErrorCode fields(std::vector<Field>* out);
  /// Collective. The vectors that gather() handed out, refilled, into the network: both ends of a spring get the same bits.
  PetscErrorCode scatter();
  /// Collective, once links carry what they do at time t: both ends of every spring get what its end of the lower number carries: across the edge of
  /// a periodic box an image's position is rounded, so that the length, and what follows from it, differs in its last bit between the two.
  PetscErrorCode accept(double t);
  /// Energy lost so far [J], this rank's share.
  double dissipated() const;
  void keep(const Keeper& keep);
  Network& net() const { return *net_; }

 private:
  struct Number {
    std::string name;
    Powers powers;
    std::vector<int> place;  ///< per law: where it stands among what the law takes; -1: nowhere
    VecHandle rows;
  };
  /// The number's place in net.links.more; null where the link's law has none.
  double* find(const Number& number, PetscInt link) const;
  Network* net_ = nullptr;
  SpringTable table_;
  std::vector<Number> numbers_;
};

}  // namespace bs
