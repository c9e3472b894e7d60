#include "cli/voice.hpp"
#include <unistd.h>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include "base/collective.hpp"
#include "cli/crash.hpp"

namespace bs {

namespace {

struct Traced {
  MPI_Comm comm = MPI_COMM_NULL;
  Exit exit = Exit::ok;  ///< the phase in which PETSc's first error was met; ok: none was
};
Traced traced;

PetscErrorCode trace(MPI_Comm comm, int line, const char* function, const char* file, PetscErrorCode code, PetscErrorType type, const char* message,
                     void* context) {
  auto* of = static_cast<Traced*>(context);
  if (code == ERR_FAILED) return code;
  if (of->exit == Exit::ok) of->exit = present_phase(of->comm);
  return PetscTraceBackErrorHandler(comm, line, function, file, code, type, message, nullptr);
}

/// Rank 0 reports and aborts if it met the error too; else the lowest of the others does.
void end_all(MPI_Comm comm, int rank, const Error& error) {
  const PetscMPIInt size = size_of(comm);
  if (rank > 0) {
    std::signal(SIGTERM, SIG_DFL);
    usleep(1000000u + 50000u * static_cast<unsigned>(std::min(rank, 40)));
  }
  print_line("error", error.text);
  if (size > 1) MPI_Abort(comm, static_cast<int>(error.exit));
}

}  // namespace

void print_line(const char* kind, const std::string& text) {
  std::string line = std::string("backspring: ") + kind + ": " + text;
  // A file name may hold anything; the line stays one line.
  std::replace_if(
      line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  line += '\n';
  std::fflush(stdout);
  std::fwrite(line.data(), 1, line.size(), stderr);
  std::fflush(stderr);
}

void print_messages_of(MPI_Comm comm) {
  const PetscMPIInt rank = rank_of(comm);
  Listener listener;
  listener.warning = [](const std::string& text) { print_line("warning", text); };
  listener.error = [comm, rank](const Error& error, bool alone) {
    if (alone) end_all(comm, rank, error);
    else if (rank == 0) print_line("error", error.text);
  };
  set_listener(comm, listener);
}

PetscErrorCode trace_petsc_errors(MPI_Comm comm) {
  traced = {comm, Exit::ok};
  return PetscPushErrorHandler(trace, &traced);
}

int exit_code_of(MPI_Comm comm, PetscErrorCode code) {
  if (code == 0) return static_cast<int>(Exit::ok);
  const Error error = outcome(comm, code);
  if (!last_error(comm) && traced.exit == Exit::ok) (void)fail_here(comm, error.exit, error.text);  // it came up without passing the handler
  if (last_error(comm)) return static_cast<int>(error.exit);
  // traced by PETSc in its own words
  const PetscMPIInt size = size_of(comm);
  expect_exit();
  if (size > 1) MPI_Abort(comm, static_cast<int>(traced.exit));
  return static_cast<int>(traced.exit);
}

}  // namespace bs
