#include "base/crash.hpp"

#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <initializer_list>
#include <new>

#include "base/fault.hpp"
#include "base/memory.hpp"

namespace bs {

namespace {

// What a signal handler may look at: plain memory, filled beforehand.
char reading[512] = "";
int rank = 0;
bool leaving = false;             // the program's own end has begun
alignas(16) char stack[1 << 16];  // a stack that has overflowed cannot carry the handler

struct Crash {
  int signal;
  const char* name;
};
constexpr Crash crashes[] = {{SIGSEGV, "segmentation fault"},
                             {SIGBUS, "bus error"},
                             {SIGFPE, "floating-point exception"},
                             {SIGILL, "illegal instruction"},
                             {SIGABRT, "abort"}};

/// One line of pieces, by write(2) alone: anything else is forbidden in a signal handler.
void write_line(std::initializer_list<const char*> pieces) {
  char line[1024];
  std::size_t used = 0;
  for (const char* piece : pieces)
    for (; *piece && used < sizeof line - 1; ++piece) line[used++] = *piece;
  line[used++] = '\n';
  (void)!write(STDERR_FILENO, line, used);
}

/// Mostly all ranks crash alike: rank 0 reports, and its end is that of the others.
void let_rank_0_speak(int seconds = 1) {
  if (rank == 0) return;
  (void)std::signal(SIGTERM, SIG_DFL);  // by which the launcher ends the others
  const timespec wait = {seconds + rank / 20, (rank % 20) * 50000000L};
  nanosleep(&wait, nullptr);
}

extern "C" void on_crash(int number) {
  const char* name = "signal";
  for (const Crash& crash : crashes)
    if (crash.signal == number) name = crash.name;
  let_rank_0_speak();
  // on the way out: the library that found the file damaged may still stumble over it while it closes it
  if (told_exit() != Exit::ok) _exit(static_cast<int>(told_exit()));
  if (*reading && out_of_memory()) {
    write_line({"backspring: error: ", reading, ": no memory left for the library that reads it: raise the memory limit, or use more ranks"});
    _exit(static_cast<int>(Exit::input));
  }
  if (*reading) {
    write_line({"backspring: error: ", reading, ": damaged: the library that reads it ended in a ", name, "; write the file again"});
    _exit(static_cast<int>(Exit::input));
  }
  write_line({"backspring: error: ", name, " inside the program: this is a bug of backspring; -bs_trace shows where, please report it"});
  _exit(128 + number);
}

/// Nothing catches exceptions: so no stack is unwound, and no distributed object destroyed by one rank alone.
[[noreturn]] void on_terminate() {
  std::string text = "ended without a reason";
  try {
    if (std::current_exception()) std::rethrow_exception(std::current_exception());
  } catch (const std::bad_alloc&) {
    text = "no memory left: raise the memory limit, use more ranks, or a smaller system";
  } catch (const std::exception& error) {
    text = std::string("unexpected: ") + error.what();
  } catch (...) {
    text = "unexpected exception";
  }
  if (*reading) text = std::string(reading) + ": " + text;
  (void)tell_alone(present_phase(), text);
  _exit(static_cast<int>(present_phase()));
}

#ifdef __GLIBC__
/// A library that calls exit(): the ordering PORD inside MUMPS does where its malloc fails.
void on_foreign_exit(int status, void*) {
  if (status == 0 || leaving || told_exit() != Exit::ok) return;
  let_rank_0_speak();
  write_line(
      {"backspring: error: a library ended the program, most probably because it ran out of memory (its own message may stand above): raise the "
       "memory limit, use more ranks, or a smaller system"});
  _exit(static_cast<int>(present_phase()));
}
#endif

}  // namespace

void expect_exit() { leaving = true; }

void end_with_line(const char* text, Exit exit) {
  let_rank_0_speak(10);
  write_line({"backspring: error: ", text});
  _exit(static_cast<int>(exit));
}

PetscErrorCode install_crash_handler() {
  PetscBool trace = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  std::set_terminate(on_terminate);
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-bs_trace", &trace, nullptr));
#ifdef __GLIBC__
  (void)on_exit(on_foreign_exit, nullptr);
#endif
  if (trace) PetscFunctionReturn(0);
  stack_t own = {};
  own.ss_sp = stack;
  own.ss_size = sizeof stack;
  (void)sigaltstack(&own, nullptr);
  struct sigaction action = {};
  action.sa_handler = on_crash;
  action.sa_flags = SA_ONSTACK;
  for (const Crash& crash : crashes) (void)sigaction(crash.signal, &action, nullptr);
  PetscFunctionReturn(0);
}

void ReadingFile::begin(const std::string& path) {
  if (mine_ || *reading) return;
  mine_ = true;
  const std::size_t length = path.copy(reading, sizeof reading - 1);
  for (std::size_t k = 0; k < length; ++k)
    if (static_cast<unsigned char>(reading[k]) < ' ') reading[k] = '?';
  reading[length] = '\0';
}

ReadingFile::~ReadingFile() {
  if (mine_) *reading = '\0';
}

}  // namespace bs
