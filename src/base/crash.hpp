// The last safety net: unexpected exceptions and crashes also end with one line and an exit code.
#pragma once
#include <petscsys.h>
#include <string>
#include "base/fault.hpp"

namespace bs {

/// Local. From here on an uncaught exception (most often std::bad_alloc) is reported in one line and ends the
/// program with the exit code of the present phase, on all ranks; a crash (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) is
/// reported in one line and ends it with 128 + signal, or with Exit::input while a ReadingFile exists. With -bs_trace
/// PETSc's own handler of signals, which prints its traceback, stays. Call after install_error_handler().
PetscErrorCode install_crash_handler();

/// To be called when the program ends normally. An exit() before that, by a library, is reported in one line and ends with the exit
/// code of the present phase.
void expect_exit();

/// From a signal handler: prints "backspring: error: TEXT" and ends at once. Usually all ranks arrive here: rank 0 prints first,
/// and its exit ends the others.
[[noreturn]] void end_with_line(const char* text, Exit exit);

/// While it exists, a crash is attributed to the library that reads file `path`: HDF5 1.10 crashes on some
/// damaged files. Objects do not nest: the first one counts.
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
