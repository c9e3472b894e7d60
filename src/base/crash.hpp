// The last net: what no code expected still ends in one line and an exit code.
#pragma once
#include <petscsys.h>
#include <string>
#include "base/fault.hpp"

namespace bs {

/// Local. From here on an exception that nobody catches (std::bad_alloc above all) is told in one line and ends the
/// program with the exit code of the present phase, on all ranks; a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) is
/// told in one line and ends it with 128 + signal, or with Exit::input while a ReadingFile lives. With -bs_trace
/// PETSc's own handler of signals, which prints its traceback, stays. Call after install_error_handler().
PetscErrorCode install_crash_handler();

/// The program ends by itself from here on. An exit() before that, by a library, is told in one line and ends with the exit
/// code of the present phase.
void expect_exit();

/// From a signal handler: "backspring: error: TEXT" and an end at once. Mostly all ranks come here alike: rank 0 speaks first,
/// and its end is that of the others.
[[noreturn]] void end_with_line(const char* text, Exit exit);

/// While it lives, a library at work on file `path` is to blame for a crash: HDF5 1.10 does not survive every
/// damaged file. They do not nest: the first counts.
class ReadingFile {
 public:
  ReadingFile() = default;
  explicit ReadingFile(const std::string& path) { begin(path); }
  ReadingFile(const ReadingFile&) = delete;
  ReadingFile& operator=(const ReadingFile&) = delete;
  ~ReadingFile();
  void begin(const std::string& path);

 private:
  bool mine_ = false;
};

}  // namespace bs
