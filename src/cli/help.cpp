#include "cli/help.hpp"
#include <petscsys.h>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <set>
#include <string>
#include <vector>

namespace bs {
namespace {

std::string collected;
std::size_t own = std::string::npos;                                       ///< length of what was collected of the run that was asked for
PetscErrorCode (*printing)(FILE*, const char[], va_list) = PetscVFPrintf;  // PETSc's own

// Every text of PETSc, also that of its lists of types, comes through here on the rank that prints.
PetscErrorCode collect(FILE* file, const char* format, va_list arguments) {
  size_t length = 0;
  PetscFunctionBegin;
  if (file != stdout) {
    PetscCall(printing(file, format, arguments));
    PetscFunctionReturn(0);
  }
  std::vector<char> text(64 * 1024);
  PetscCall(PetscVSNPrintf(text.data(), text.size(), format, &length, arguments));
  collected += text.data();
  PetscFunctionReturn(0);
}

/// A title begins a section: it stands at the margin and ends with a colon.
bool is_title(const std::string& line) { return !line.empty() && line[0] != ' ' && line[0] != '-' && line.back() == ':'; }

std::vector<std::string> sections_of(const std::string& text) {
  std::vector<std::string> sections(1);
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) end = text.size();
    const std::string line = text.substr(begin, end - begin);
    if (is_title(line)) sections.emplace_back();
    sections.back() += line + "\n";
    begin = end + 1;
  }
  return sections;
}

void print(const std::string& text) {
  std::string shown = text;
  for (std::size_t at; (at = shown.find("\n----------------------------------------\n")) != std::string::npos;) shown.erase(at + 1, 41);
  std::fputs(shown.c_str(), stdout);
}

/// A section without the program's options in `seen`, to which it adds those that are left; empty where none is.
std::string unseen(const std::string& section, std::set<std::string>* seen) {
  std::string out, rest = section, kept;
  std::size_t end;
  for (bool first = true; (end = rest.find('\n')) != std::string::npos; rest.erase(0, end + 1), first = false) {
    const std::string line = rest.substr(0, end + 1);
    const bool option = line.compare(0, 6, "  -bs_") == 0;
    if (!option && !first) continue;
    if (!option) out = line;
    else if (seen->insert(line.substr(0, line.find(": "))).second) kept += line;
  }
  return kept.empty() ? kept : out + kept;
}

}  // namespace

void translate_common_flags(int argc, char** argv) {
  static char help[] = "-help", version[] = "-bs_version";
  for (int k = 1; k < argc; ++k) {
    if (std::strcmp(argv[k], "--help") == 0 || std::strcmp(argv[k], "-h") == 0) argv[k] = help;
    if (std::strcmp(argv[k], "--version") == 0) argv[k] = version;
  }
}

void collect_help(int argc, const char* const* argv) {
  for (int k = 1; k < argc; ++k)
    if (std::strcmp(argv[k], "-help") == 0) PetscVFPrintf = collect;
}

void collect_help_of_others() {
  if (own == std::string::npos) own = collected.size();
}

void print_help() {
  PetscVFPrintf = printing;
  if (collected.empty()) return;
  std::set<std::string> seen;
  const std::vector<std::string> sections = sections_of(collected.substr(0, own));
  print(sections[0].substr(0, sections[0].find("\n----")) + "\n");
  for (std::size_t k = 1; k < sections.size(); ++k)
    if (sections[k].find("\n  -bs_") != std::string::npos) print(unseen(sections[k], &seen));
  for (const std::string& section : sections_of(own < collected.size() ? collected.substr(own) : std::string())) print(unseen(section, &seen));
  std::puts(
      "\nOptions of PETSc that this run can use (https://petsc.org has their "
      "manual)\n===========================================================================");
  for (std::size_t k = 1; k < sections.size(); ++k)
    if (sections[k].find("\n  -bs_") == std::string::npos) print(sections[k]);
  collected.clear();
}

}  // namespace bs
