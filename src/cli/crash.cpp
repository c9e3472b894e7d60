#include "cli/crash.hpp"
#include <petscblaslapack.h>
#include <sys/time.h>
#include <unistd.h>
#include <csignal>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <initializer_list>
#include <memory>
#include <new>
#include <vector>
#include "base/context.hpp"
#include "base/h5_handle.hpp"
#include "base/memory.hpp"

namespace bs {

namespace {

// What a signal handler may look at: plain memory, filled beforehand.
MPI_Comm run = MPI_COMM_NULL;
const Error* failed = nullptr;       // the error that `run` holds
std::shared_ptr<Context> held_here;  // keeps it
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
  if (failed && *failed) _exit(static_cast<int>(failed->exit));
  const char* const reading = file_being_read();
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
  if (*file_being_read()) text = std::string(file_being_read()) + ": " + text;
  const Exit exit = present_phase(run);
  (void)fail_here(run, exit, text);
  _exit(static_cast<int>(exit));
}

#ifdef __GLIBC__
/// A library that calls exit(): the ordering PORD inside MUMPS does where its malloc fails.
void on_foreign_exit(int status, void*) {
  if (status == 0 || leaving || *failed) return;
  let_rank_0_speak();
  write_line(
      {"backspring: error: a library ended the program, most probably because it ran out of memory (its own message may stand above): raise the "
       "memory limit, use more ranks, or a smaller system"});
  _exit(static_cast<int>(present_phase(run)));
}
#endif

}  // namespace

void expect_exit() { leaving = true; }

void end_with_line(const char* text, Exit exit) {
  let_rank_0_speak(10);
  write_line({"backspring: error: ", text});
  _exit(static_cast<int>(exit));
}

PetscErrorCode install_crash_handler(MPI_Comm comm, bool trace) {
  PetscFunctionBegin;
  run = comm;
  failed = &last_error(comm);
  held_here = context_of(comm);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  std::set_terminate(on_terminate);
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

namespace {

constexpr int BLAS_SECONDS = 3;  // of processor time, for what takes a millisecond

extern "C" void on_no_memory(int) {
  end_with_line(
      "no memory for the work space of BLAS (128 MB in Debian's OpenBLAS): raise the memory limit (ulimit -d, "
      "ulimit -v, that of the job), or run fewer ranks on this machine",
      Exit::input);
}

/// A Cholesky factorisation too large for the kernels that need no work space.
PetscErrorCode first_call() {
  constexpr int N = 96;
  std::vector<PetscScalar> identity(static_cast<std::size_t>(N) * N, 0.0);
  PetscBLASInt n = N, info = 0;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < N; ++k) identity[k * (N + 1)] = 1.0;
  PetscCallBLAS("LAPACKpotrf", LAPACKpotrf_("L", &n, identity.data(), &n, &info));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode reserve_blas_memory() {
  PetscFunctionBegin;
  struct sigaction watch = {}, before = {};
  watch.sa_handler = on_no_memory;
  const itimerval limit = {{0, 0}, {BLAS_SECONDS, 0}}, none = {};
  itimerval other = {};
  (void)sigaction(SIGPROF, &watch, &before);
  (void)setitimer(ITIMER_PROF, &limit, &other);
  PetscCall(first_call());
  (void)setitimer(ITIMER_PROF, &none, nullptr);
  (void)sigaction(SIGPROF, &before, nullptr);
  if (other.it_value.tv_sec || other.it_value.tv_usec) (void)setitimer(ITIMER_PROF, &other, nullptr);  // a profiler's
  PetscFunctionReturn(0);
}

namespace {

volatile std::sig_atomic_t ending = 0, asked = 0;
volatile std::sig_atomic_t launched = 0;  // by mpirun or its like, which passes signals on
volatile pid_t first_sender = 0;
timespec first_at = {};

double seconds_since(const timespec& then) {
  timespec now = {};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec - then.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec - then.tv_nsec);
}

/// Whether it is the first signal again: sent to the process and to its group at once, as timeout(1) does, or passed on by a
/// launcher to a rank that has had it already.
bool same_order(pid_t sender) {
  constexpr double AT_ONCE = 0.2;  // [s]
  const pid_t parent = getppid();
  return seconds_since(first_at) < AT_ONCE || (launched && sender == parent && first_sender != parent);
}

extern "C" void on_ending(int number, siginfo_t* info, void*) {
  if (!ending) {
    first_sender = info->si_pid;
    clock_gettime(CLOCK_MONOTONIC, &first_at);
    ending = number;
  } else if (!same_order(info->si_pid)) {
    static const char said[] = "backspring: a second signal: the run ends at once, without the last frame and checkpoint\n";
    (void)!write(STDERR_FILENO, said, sizeof said - 1);
    _exit(128 + number);
  }
}

extern "C" void on_asking(int) { asked = 1; }

}  // namespace

void catch_signals(MPI_Comm comm) {
  launched = std::getenv("OMPI_COMM_WORLD_RANK") || std::getenv("PMIX_RANK") || std::getenv("PMI_RANK");
  struct sigaction action = {};
  action.sa_flags = SA_RESTART | SA_SIGINFO;
  action.sa_sigaction = on_ending;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  action.sa_flags = SA_RESTART;
  action.sa_handler = on_asking;
  sigaction(SIGUSR1, &action, nullptr);
  set_signals(comm, {[] { return static_cast<int>(ending); },
                     [] {
                       const bool come = asked != 0;
                       asked = 0;
                       return come;
                     }});
}

}  // namespace bs
