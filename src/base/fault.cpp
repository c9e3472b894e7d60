#include "base/fault.hpp"

#include <algorithm>
#include <cstdio>

namespace bs {

namespace {
Exit last_told = Exit::ok;
}

void Fault::note(std::int64_t at, std::string what, Exit code) {
  if (!text.empty() && where <= at) return;
  where = at;
  text = std::move(what);
  exit = code;
}

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

void mark_told(Exit exit) { last_told = exit; }

Exit told_exit() { return last_told; }

/// Sends the winner's text and exit code to all ranks.
static PetscErrorCode broadcast(MPI_Comm comm, PetscMPIInt root, std::string* text, Exit* exit) {
  PetscMPIInt head[2] = {static_cast<PetscMPIInt>(text->size()), static_cast<PetscMPIInt>(*exit)};

  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(head, 2, MPI_INT, root, comm));
  text->resize(static_cast<std::size_t>(head[0]));
  PetscCallMPI(MPI_Bcast(text->data(), head[0], MPI_CHAR, root, comm));
  *exit = static_cast<Exit>(head[1]);
  PetscFunctionReturn(0);
}

/// The fault with the smallest `where`, then rank, on every rank; without text if there is none.
static PetscErrorCode choose(MPI_Comm comm, const Fault& fault, std::string* text, Exit* exit) {
  const bool mine = static_cast<bool>(fault);
  std::int64_t first[2] = {mine ? fault.where : std::numeric_limits<std::int64_t>::max(), mine ? 0 : 1};
  PetscMPIInt rank, size, winner;

  PetscFunctionBegin;
  text->clear();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, first, 2, MPI_INT64_T, MPI_MIN, comm));
  if (first[1] != 0) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  winner = mine && fault.where == first[0] ? rank : size;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &winner, 1, MPI_INT, MPI_MIN, comm));
  *text = fault.text;
  *exit = fault.exit;
  PetscCall(broadcast(comm, winner, text, exit));
  PetscFunctionReturn(0);
}

PetscErrorCode shared_fault(MPI_Comm comm, const Fault& fault, std::string* text) {
  Exit exit;

  PetscFunctionBegin;
  PetscCall(choose(comm, fault, text, &exit));
  PetscFunctionReturn(0);
}

PetscErrorCode agree(MPI_Comm comm, const Fault& fault) {
  std::string text;
  Exit exit = Exit::ok;
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCall(choose(comm, fault, &text, &exit));
  if (text.empty()) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) print_line("error", text);
  mark_told(exit);
  PetscFunctionReturn(ERR_TOLD);
}

PetscErrorCode tell(MPI_Comm comm, Exit exit, const std::string& text) {
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) print_line("error", text);
  mark_told(exit);
  PetscFunctionReturn(ERR_TOLD);
}

PetscErrorCode warn(MPI_Comm comm, const std::string& text) {
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) print_line("warning", text);
  PetscFunctionReturn(0);
}

}  // namespace bs
