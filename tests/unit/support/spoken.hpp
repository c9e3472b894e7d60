// For tests of what the program says: this rank's stderr or stdout caught in a string, and its error handler.
#pragma once
#include <petscsys.h>
#include <unistd.h>

#include <cstdio>
#include <string>

#include "base/collective.hpp"
#include "cli/voice.hpp"
#include "output/progress.hpp"

/// Catches one stream while it lives; text() gives what came.
class Caught {
 public:
  explicit Caught(std::FILE* stream = stderr) : stream_(stream), into_(std::tmpfile()) {
    std::fflush(stream_);
    saved_ = dup(fileno(stream_));
    dup2(fileno(into_), fileno(stream_));
  }
  ~Caught() {
    restore();
    std::fclose(into_);
  }
  std::string text() {
    restore();
    std::string all;
    std::rewind(into_);
    for (int c = std::fgetc(into_); c != EOF; c = std::fgetc(into_)) all += static_cast<char>(c);
    return all;
  }

 private:
  void restore() {
    if (saved_ < 0) return;
    std::fflush(stream_);
    dup2(saved_, fileno(stream_));
    close(saved_);
    saved_ = -1;
  }
  std::FILE* stream_;
  std::FILE* into_;
  int saved_ = -1;
};

/// The program's voice and its handler of PETSc's errors while it lives.
struct Handled {
  Handled() {
    bs::clear_error(PETSC_COMM_WORLD);
    bs::print_messages_of(PETSC_COMM_WORLD);
    bs::let_runs_print(PETSC_COMM_WORLD);
  }
  ~Handled() {
    bs::set_listener(PETSC_COMM_WORLD, {});
    bs::clear_error(PETSC_COMM_WORLD);
  }
  bs::PetscErrors handler{PETSC_COMM_WORLD};
};

using bs::rank_of;
using bs::size_of;
