// Reading of options: each has a name, a help text with its unit and a range check, and is recorded, so that a
// misspelt -bs_ option can be answered with the nearest name.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <set>
#include <string>
#include <vector>
#include "base/petsc_versions.hpp"

namespace bs {

enum class Range { any, positive, nonnegative };

/// A block of options under one heading of -help. The first error sticks and is returned by read_section; the options
/// after it are still listed by -help. Numbers are parsed strictly ("12abc", "", "nan" are refused). `help` ends in the
/// unit in brackets, e.g. "time step [s]": messages repeat it. Two sections must not share a title (PETSc lists one).
/// Each reader leaves its value alone where the option is absent and returns whether it was present.
class Section {
 public:
  Section(OptionItems items, MPI_Comm comm) : items_(items), comm_(comm) {}
  bool real(const char* name, const char* help, double& value, Range range = Range::any);
  /// Up to `max` numbers separated by commas; `count` receives how many were given.
  bool reals(const char* name, const char* help, double* values, int max, int* count = nullptr);
  bool integer(const char* name, const char* help, std::int64_t& value, Range range = Range::any);
  bool integers(const char* name, const char* help, std::vector<std::int64_t>& values);
  bool flag(const char* name, const char* help, bool& value);
  /// Words, never the name of a file.
  bool text(const char* name, const char* help, std::string& value);
  /// Collective. The name of a file that the run writes or goes on with, or what such names begin with. Never taken from a checkpoint, but for the
  /// run's own trajectory and checkpoint.
  bool path(const char* name, const char* help, std::string& value);
  /// Collective. The name of a file to read, found as find_input says.
  bool file(const char* name, const char* help, std::string& value);
  /// The words that options given have in place of NAME in `name`, which ends in _NAME.
  std::vector<std::string> names(const std::string& name, const char* help);
  /// Words separated by commas.
  bool texts(const char* name, const char* help, std::vector<std::string>& values);
  /// One of `choices`, or three letters and more that only one of them begins with; `index` is its position. Anything else is an error that lists
  /// them.
  bool choice(const char* name, const char* help, const std::vector<std::string>& choices, int& index);
  PetscErrorCode status() const { return status_; }
  MPI_Comm comm() const { return comm_; }
  /// Collective: makes `text` the section's error (exit 2), unless it has one.
  void fail(const std::string& text);

 private:
  bool find(const char* name, const char* help, const std::string& present, std::string* value, bool* bare = nullptr);
  bool real_of(const char* name, const char* help, const std::string& word, double* value);
  bool integer_of(const char* name, const char* help, const std::string& word, std::int64_t* value);
  void refuse(const char* name, const std::string& value, const std::string& why, const std::string& remedy);
  OptionItems items_;
  MPI_Comm comm_;
  PetscErrorCode status_ = 0;
};

/// Calls body(section) between PETSc's begin and end of an options block titled `title`.
template <class Body>
PetscErrorCode read_section(MPI_Comm comm, const char* title, Body&& body) {
  PetscErrorCode status = 0;
  PetscFunctionBegin;
  PetscOptionsBegin(comm, nullptr, title, nullptr);
  Section section(PetscOptionsObject, comm);
  body(section);
  status = section.status();
  PetscOptionsEnd();
  PetscFunctionReturn(status);
}

/// Names (with the leading dash) of every option read through a Section on `comm` so far.
const std::set<std::string>& known_options(MPI_Comm comm);

/// Whether `name` (with its dash) is one of `names`, in whose place of NAME any word may stand.
bool is_listed(const std::set<std::string>& names, const std::string& name);

/// Collective. An option that begins with -bs_, that no reader knows and that is none of `others` is an error that suggests the nearest name.
/// Call after every reader has run.
PetscErrorCode reject_unknown_options(MPI_Comm comm, const std::set<std::string>& others = {});

}  // namespace bs
