// PETSc's own errors, in one line from one rank.
#include <hdf5.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "base/crash.hpp"
#include "base/factor_memory.hpp"
#include "base/fault.hpp"
#include "base/option_names.hpp"

namespace bs {

namespace {

Exit phase = Exit::input;
bool trace = false;
bool petsc_error = false;    // an error of PETSc's has been met
Exit petsc_exit = Exit::ok;  // the phase it was met in

/// First line of PETSc's message; the generic text of the code where there is none.
std::string first_line(PetscErrorCode code, const char* message) {
  const char* generic = nullptr;
  if (!message || !message[std::strspn(message, " \n\t")]) {
    (void)PetscErrorMessage(code, &generic, nullptr);
    message = generic ? generic : "unknown error";
  }
  message += std::strspn(message, " \n\t");
  return std::string(message, std::strcspn(message, "\n"));
}

/// The option that has this value, the last one of several; empty where none has.
std::string option_of(const std::string& value) {
  std::vector<std::pair<std::string, std::string>> options;
  std::string name;
  if (options_in_force(&options)) return {};
  for (const auto& [one, text] : options)
    if (text == value) name = "-" + one;
  return name;
}

/// PETSc's message in the user's terms: its readers of options name the value they refuse, not the option.
std::string explained(const std::string& text, const char* function) {
  const std::string as_it_is = text + " (in " + (function ? function : "PETSc") + ")";
  const char begin[] = "Input string ", logical[] = "Unknown logical value: ";
  const std::size_t from = sizeof begin - 1, to = text.find(" has no ");
  if (text.compare(0, sizeof logical - 1, logical) == 0) {
    const std::string value = text.substr(sizeof logical - 1), name = option_of(value);
    return name.empty() ? as_it_is : "option " + name + ": " + value + " is neither true nor false";
  }
  if (text.compare(0, from, begin) != 0 || to == std::string::npos) {
    for (const char* refusal : {"Unable to find requested", "Unknown option", "Unknown TSAdapt", "Unknown Mat type"})
      if (text.compare(0, std::strlen(refusal), refusal) == 0) return as_it_is + ": -help lists the valid names";
    return as_it_is;
  }
  const std::string value = text.substr(from, to - from), name = option_of(value);
  const bool whole = text.find("integer") != std::string::npos;
  return name.empty() ? as_it_is : "option " + name + ": " + value + " is not a " + (whole ? "whole " : "") + "number: -help explains the option";
}

/// Whether PETSc could not open a file to write, which is a failure of output in whatever phase.
bool is_of_output(PetscErrorCode code, const std::string& text) {
  if (code == PETSC_ERR_FILE_WRITE) return true;
  if (code != PETSC_ERR_FILE_OPEN) return false;
  for (const char* begin : {"Cannot open PetscViewer file", "Unable to open trace file", "Unable to open file", "Cannot open log file"})
    if (text.compare(0, std::strlen(begin), begin) == 0) return true;
  return text.find(" for WRITE") != std::string::npos;
}

/// PETSc 3.18's allocator reports the caller's line number as the error code and its name as the message.
bool is_of_memory(PetscErrorCode code, const char* function) {
  const std::string name = function ? function : "";
  return code == PETSC_ERR_MEM || name == "PetscMallocAlign" || name == "PetscReallocAlign" || name == "PetscTrMallocDefault";
}

/// Some of PETSc's messages tell how much was asked for: "Memory requested 1234".
std::string of_memory(const char* message) {
  std::string asked;
  const char* const number = message ? std::strstr(message, "Memory requested ") : nullptr;
  if (number) asked = format(" for %.3g MB more", std::strtod(number + std::strlen("Memory requested "), nullptr) / 1e6);
  return "no memory left" + asked + ": raise the memory limit, use more ranks, or a smaller system";
}

/// Memory that MUMPS did not get, which it names by a number; empty where the text tells of something else.
std::string of_mumps_memory(const std::string& text) {
  const std::size_t at = text.find("INFOG(1)=");
  if (text.find("MUMPS") == std::string::npos || at == std::string::npos) return {};
  const long infog = std::strtol(text.c_str() + at + std::strlen("INFOG(1)="), nullptr, 10);
  if (!mumps_lacks_memory(infog)) return {};
  return format("no memory left for the factors of the linear solver (MUMPS: INFOG(1) = %ld): ", infog) + mumps_memory_remedy(infog, "") +
         ", use more ranks, or an iterative solver";
}

std::string in_users_words(PetscErrorCode code, const char* function, const char* message) {
  const std::string text = first_line(code, message);
  if (code == PETSC_ERR_MEM && function && !std::strcmp(function, "PetscOptionsSetValue_Private"))
    return "too many options: PETSc holds 512, those that the program sets itself among them: leave out those that this run does not use";
  if (is_of_memory(code, function)) return of_memory(message);
  const std::string mumps = of_mumps_memory(text);
  if (!mumps.empty()) return mumps;
  return explained(text, function);
}

PetscErrorCode handle(MPI_Comm comm, int line, const char* function, const char* file, PetscErrorCode code, PetscErrorType type, const char* message,
                      void* context) {
  if (code == ERR_TOLD) return code;
  if (trace) {
    if (!petsc_error) petsc_exit = phase;
    petsc_error = true;
    return PetscTraceBackErrorHandler(comm, line, function, file, code, type, message, context);
  }
  // What follows from an error already told is not news.
  if (type != PETSC_ERROR_INITIAL || petsc_error || told_exit() != Exit::ok) return code;
  petsc_error = true;
  petsc_exit = is_of_output(code, first_line(code, message)) ? Exit::io : phase;

  (void)tell_alone(petsc_exit, in_users_words(code, function, message));
  return code;
}

}  // namespace

PetscErrorCode tell_alone(Exit exit, const std::string& text) {
  PetscMPIInt rank = 0, size = 1;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  if (rank > 0) {
    // Rank 0 reports and aborts if it met the error too; else the lowest of the others does.
    std::signal(SIGTERM, SIG_DFL);
    usleep(1000000u + 50000u * static_cast<unsigned>(std::min(rank, 40)));
  }
  print_line("error", text);
  mark_told(exit);
  if (size > 1) MPI_Abort(PETSC_COMM_WORLD, static_cast<int>(exit));
  return ERR_TOLD;
}

void watch_start() { (void)PetscPushErrorHandler(handle, nullptr); }

PetscErrorCode install_error_handler() {
  PetscBool set = PETSC_FALSE, value = PETSC_TRUE;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-bs_trace", &value, &set));
  trace = set && value;
  PetscCall(PetscPushErrorHandler(handle, nullptr));
  if (!trace) H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  PetscFunctionReturn(0);
}

void set_phase(Exit phase_exit) { phase = phase_exit; }

Exit present_phase() { return phase; }

void forget_faults() {
  petsc_error = false;
  mark_told(Exit::ok);
}

int finish(PetscErrorCode code) {
  if (code == 0) return static_cast<int>(Exit::ok);
  if (code == ERR_TOLD) return static_cast<int>(told_exit());
  if (told_exit() != Exit::ok) return static_cast<int>(told_exit());
  if (!petsc_error) {
    // Came up without passing the handler.
    (void)tell_alone(phase, first_line(code, nullptr));
    return static_cast<int>(phase);
  }
  // Traced by PETSc in its own words.
  PetscMPIInt size = 1;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  expect_exit();
  if (size > 1) MPI_Abort(PETSC_COMM_WORLD, static_cast<int>(petsc_exit));
  return static_cast<int>(petsc_exit);
}

}  // namespace bs
