// PETSc's own errors in the words of a user.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string>
#include <utility>
#include <vector>
#include "base/error.hpp"
#include "base/factor_memory.hpp"
#include "base/option_aliases.hpp"
#include "base/option_names.hpp"

namespace bs {

namespace {

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

/// "option NAME: VALUE" of the last option whose value satisfies `is` (is the one that PETSc complains of); empty where none does.
template <class Is>
std::string option_with(Is&& is) {
  std::vector<std::pair<std::string, std::string>> options;
  std::string found;
  if (options_in_force(&options)) return {};
  for (const auto& [name, value] : options)
    if (is(value)) found = "option " + kept_name("-" + name) + ": " + value;
  return found;
}

/// PETSc 3.25 itself refuses numbers out of bounds, and its message holds the number but not the option: finds the option; empty where none has it.
std::string out_of_bounds(const std::string& text) {
  const char begin[] = "Newly set value ";
  const std::size_t from = sizeof begin - 1, to = std::min(text.find(" less than"), text.find(" greater than"));
  if (text.compare(0, from, begin) != 0 || to == std::string::npos) return {};
  const double number = std::strtod(text.c_str() + from, nullptr);
  const std::string found = option_with([number](const std::string& value) {
    char* end = nullptr;
    const double its = std::strtod(value.c_str(), &end);
    const bool close = std::isfinite(number) && std::abs(its - number) <= 1e-4 * std::abs(number);
    return !value.empty() && !*end && (std::isnan(number) ? std::isnan(its) : close || its == number);
  });
  return found.empty() ? "" : found + " is" + (std::isnan(number) ? " not a number" : text.substr(to));
}

/// PETSc's message in the user's terms: its readers of options name the value they refuse, not the option.
std::string explained(const std::string& text, const char* function) {
  const std::string as_it_is = text + " (in " + (function ? function : "PETSc") + ")";
  const char begin[] = "Input string ", logical[] = "Unknown logical value: ";
  const std::size_t from = sizeof begin - 1, to = text.find(" has no ");
  if (text.compare(0, sizeof logical - 1, logical) == 0) {
    const std::string found = option_with([&](const std::string& value) { return value == text.substr(sizeof logical - 1); });
    return found.empty() ? as_it_is : found + " is neither true nor false";
  }
  if (text.find("does not have a multiply transpose defined") != std::string::npos)
    return "a solver of this run multiplies by the transposed Jacobian, which its operator does not have: "
           "give another -snes_type or -ksp_type, or an assembled matrix by -bs_operator assembled, without -snes_mf";
  const std::string bounds = out_of_bounds(text);
  if (!bounds.empty()) return bounds;
  if (text.compare(0, from, begin) != 0 || to == std::string::npos) {
    for (const char* refusal : {"Unable to find requested", "Unknown option", "Unknown TSAdapt", "Unknown Mat type"})
      if (text.compare(0, std::strlen(refusal), refusal) == 0) return as_it_is + ": -help lists the valid names";
    return as_it_is;
  }
  const std::string found = option_with([&](const std::string& value) { return value == text.substr(from, to - from); });
  const bool whole = text.find("integer") != std::string::npos;
  return found.empty() ? as_it_is : found + " is not a " + (whole ? "whole " : "") + "number: -help explains the option";
}

/// Whether PETSc could not open a file for writing: a failure of output, whatever the program is doing.
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

/// A message about memory that MUMPS could not get, recognised by its INFOG(1); empty where the text is about something else.
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

}  // namespace

PetscErrorCode PetscErrors::handle(MPI_Comm, int, const char* function, const char*, PetscErrorCode code, PetscErrorType type, const char* message,
                                   void* context) {
  auto* self = static_cast<PetscErrors*>(context);
  const MPI_Comm comm = self->comm_;
  // only the first error is reported: not those that follow from it, nor those raised while its message is made
  if (code == ERR_FAILED || type != PETSC_ERROR_INITIAL || self->busy_ || last_error(comm)) return code;
  self->busy_ = true;
  (void)fail_here(comm, is_of_output(code, first_line(code, message)) ? Exit::io : present_phase(comm), in_users_words(code, function, message));
  self->busy_ = false;
  return code;
}

}  // namespace bs
