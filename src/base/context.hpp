// What is remembered for all that runs on one communicator: in the place of variables of the whole process. What its owner asks of a run on it.
#pragma once
#include <mpi.h>
#include <functional>
#include <map>
#include <memory>
#include <typeindex>
#include <typeinfo>
#include <utility>

namespace bs {

/// One object of each type that is asked for, made at the first question.
class Context {
 public:
  template <class T>
  T& held() {
    std::shared_ptr<void>& slot = parts_[std::type_index(typeid(T))];
    if (!slot) slot = std::make_shared<T>();
    return *static_cast<T*>(slot.get());
  }

 private:
  std::map<std::type_index, std::shared_ptr<void>> parts_;
};

/// Local. The context of `comm`, an attribute of it: made at the first call, shared by the communicators that are duplicated from `comm` afterwards,
/// as PETSc does for its objects, and freed with the last of them.
std::shared_ptr<Context> context_of(MPI_Comm comm);

/// Local. The object of type T in the context of `comm`.
template <class T>
T& held_by(MPI_Comm comm) {
  return context_of(comm)->held<T>();
}

/// Local. Takes the context off `comm`, for communicators that are never freed.
void drop_context(MPI_Comm comm);

/// What the owner asks of a run, looked at between steps; by default nothing. Each rank has its own; what one of them is asked, all do.
struct Signals {
  std::function<int()> ending;       ///< the number of the signal that ends the run; 0: none
  std::function<bool()> checkpoint;  ///< whether a checkpoint was asked for since the last call
};
inline void set_signals(MPI_Comm comm, Signals signals) { held_by<Signals>(comm) = std::move(signals); }

/// Local.
inline int ending_signal(MPI_Comm comm) {
  const Signals& signals = held_by<Signals>(comm);
  return signals.ending ? signals.ending() : 0;
}
inline bool checkpoint_is_asked(MPI_Comm comm) {
  const Signals& signals = held_by<Signals>(comm);
  return signals.checkpoint && signals.checkpoint();
}

}  // namespace bs
