#include "base/option_names.hpp"
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/options.hpp"
#include "base/text.hpp"

namespace bs {

bool is_given(const std::string& option) {
  PetscBool found = PETSC_FALSE;
  return !PetscOptionsHasName(nullptr, nullptr, option.c_str(), &found) && found;
}

PetscErrorCode read_start_time(PetscReal* time) {
  PetscFunctionBegin;
  *time = 0;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-ts_init_time", time, nullptr));
  PetscFunctionReturn(0);
}

std::vector<std::string> words_of_environment() {
  const char* const more = std::getenv("PETSC_OPTIONS");
  std::istringstream in(more ? more : "");
  return {std::istream_iterator<std::string>(in), {}};
}

PetscErrorCode is_on(const char* option, bool* yes) {
  PetscBool value = PETSC_FALSE;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, option, &value, nullptr));
  *yes = value;
  PetscFunctionReturn(0);
}

PetscErrorCode first_on(std::initializer_list<const char*> options, std::string* first) {
  PetscFunctionBegin;
  first->clear();
  for (const char* option : options) {
    bool on = false;
    PetscCall(is_on(option, &on));
    if (on && first->empty()) *first = option;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode set_unless_given(const std::string& option, const char* value) {
  PetscFunctionBegin;
  if (!is_given(option)) PetscCall(PetscOptionsSetValue(nullptr, option.c_str(), value));
  PetscFunctionReturn(0);
}

PetscErrorCode start_petsc(const std::vector<char*>& words, const char* help) {
  static char skip[] = "-skip_petscrc";
  static std::vector<char*> kept;
  kept = words;
  const bool said = std::any_of(words.begin() + 1, words.end(), [](const char* word) { return strcasecmp(word, skip) == 0; });
  if (!said) kept.insert(kept.begin() + 1, skip);
  kept.push_back(nullptr);
  int count = static_cast<int>(kept.size()) - 1;
  char** all = kept.data();
  if (const PetscErrorCode status = PetscInitialize(&count, &all, nullptr, help)) return status;
  PetscFunctionBegin;
  if (!said) PetscCall(PetscOptionsClearValue(nullptr, skip));
  PetscFunctionReturn(0);
}

PetscErrorCode end_petsc() {
  const PetscErrorCode status = set_unless_given("-options_left", "false");
  const PetscErrorCode end = PetscFinalize();
  return status ? status : end;
}

std::string value_of(const std::string& option, const std::string& otherwise) {
  const char* text = nullptr;
  PetscBool found = PETSC_FALSE;
  if (PetscOptionsFindPair(nullptr, nullptr, option.c_str(), &text, &found) || !found) return otherwise;
  return text ? text : "";
}

namespace {

/// The value of the option `name` (with its dash). PETSc's own look at an option that nothing has read yet would count as one.
PetscErrorCode value_in_force(const std::string& name, const std::map<std::string, std::string>& unread, std::string* value) {
  const char* text = nullptr;
  PetscBool set = PETSC_FALSE;
  PetscFunctionBegin;
  const auto at = unread.find(name);
  if (at == unread.end()) PetscCall(PetscOptionsFindPair(nullptr, nullptr, name.c_str(), &text, &set));
  *value = at != unread.end() ? at->second : set && text ? text : "";
  PetscFunctionReturn(0);
}

PetscErrorCode unread_options(std::map<std::string, std::string>* unread) {
  PetscInt count = 0;
  char **names = nullptr, **values = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  for (PetscInt k = 0; k < count; ++k) (*unread)[std::string("-") + names[k]] = values[k] ? values[k] : "";
  PetscCall(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode options_in_force(std::vector<std::pair<std::string, std::string>>* options) {
  char* text = nullptr;
  std::map<std::string, std::string> unread;
  PetscFunctionBegin;
  PetscCall(unread_options(&unread));
  PetscCall(PetscOptionsGetAll(nullptr, &text));  // "-name value -name -name value "
  const std::string all(text);
  PetscCall(PetscFree(text));
  options->clear();
  for (std::size_t at = 0, end; (end = all.find(' ', at)) != std::string::npos;) {
    const std::string name = all.substr(at, end - at);
    std::string value;
    if (name[0] != '-') {  // of a name with a blank, which only YAML can give and nothing reads
      at = end + 1;
      continue;
    }
    PetscCall(value_in_force(name, unread, &value));  // not by the words: a value may hold some that look like options, as 0.1*t -sin(t)
    options->emplace_back(name.substr(1), value);
    at = end + 1;
    if (all.compare(at, value.size() + 1, value + " ") == 0) at += value.size() + 1;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode option_endings(const std::string& begin, std::vector<std::string>* endings) {
  std::vector<std::pair<std::string, std::string>> options;
  PetscFunctionBegin;
  endings->clear();
  PetscCall(options_in_force(&options));
  for (const auto& [name, value] : options)
    if (lower(name).rfind(lower(begin), 0) == 0) endings->push_back(name.substr(begin.size()));
  PetscFunctionReturn(0);
}

namespace {

/// The file that a viewer's description names; empty where it names none.
std::string viewer_file(const std::string& value) {
  static const std::set<std::string> kinds = {"", "ascii", "binary", "hdf5", "vtk", "exodusii", "matlab", "mathematica", "adios"};
  const std::size_t kind = value.find(':');
  if (kind == std::string::npos || kinds.count(value.substr(0, kind)) == 0) return {};
  const std::string file = value.substr(kind + 1, value.find(':', kind + 1) - kind - 1);
  return file == "stdout" || file == "stderr" || file == "-" ? "" : file;
}

/// Options whose whole value is the name of a file.
bool names_file(const std::string& option) { return option == "citations" || option == "malloc_view"; }

/// Why a file cannot be written; 0 where it can. Nothing is made or changed.
int reason_against(const std::string& file) {
  struct stat status;
  const std::string folder = folder_of(file);
  if (stat(file.c_str(), &status) == 0) return S_ISDIR(status.st_mode) ? EISDIR : access(file.c_str(), W_OK) == 0 ? 0 : errno;
  if (errno != ENOENT) return errno;
  if (stat(folder.c_str(), &status) != 0) return errno;
  if (!S_ISDIR(status.st_mode)) return ENOTDIR;
  return access(folder.c_str(), W_OK | X_OK) == 0 ? 0 : errno;
}

}  // namespace

PetscErrorCode check_viewers(MPI_Comm comm) {
  std::vector<std::pair<std::string, std::string>> options;
  Error fault;
  PetscBool value = PETSC_FALSE;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  PetscCall(options_in_force(&options));
  for (const auto& [name, text] : options) {
    const std::string file = name.rfind("bs_", 0) == 0 ? "" : names_file(name) ? text : viewer_file(text);
    if (rank != 0 || file.empty()) continue;
    if (const int why = reason_against(file))
      fault.note(0, "option -" + name + " " + text + ": cannot write " + file + ": " + std::strerror(why), Exit::io);
  }
  fault.exit = Exit::io;
  PetscCall(fail_if_any(comm, fault));
  for (const char* name : {"-options_view", "-options_left"}) PetscCall(PetscOptionsGetBool(nullptr, nullptr, name, &value, nullptr));
  PetscFunctionReturn(0);
}

namespace {

/// What is to be given in the place of a tolerance; empty where it may be used, or PETSc has a word for it.
std::string fault_of_tolerance(const std::string& name, const std::string& value) {
  const std::string small = lower(name);
  const auto ends = [&small](const char* tail) { return ends_with(small, tail); };
  const bool relative = ends("_rtol");
  if (!relative && !ends("_atol") && !ends("_stol") && !ends("_divtol")) return {};
  char* end = nullptr;
  const double number = std::strtod(value.c_str(), &end);
  if (value.empty() || *end || (number >= 0 && !(relative && number >= 1))) return {};
  return relative ? "give a number >= 0 and below 1" : "give a number >= 0";
}

}  // namespace

PetscErrorCode check_tolerances(MPI_Comm comm) {
  std::vector<std::pair<std::string, std::string>> options;
  PetscFunctionBegin;
  PetscCall(options_in_force(&options));
  for (const auto& [name, value] : options) {
    const std::string fault = name.rfind("bs_", 0) == 0 ? "" : fault_of_tolerance(name, value);
    if (!fault.empty()) PetscCall(fail(comm, Exit::input, "option -" + name + ": " + value + ": " + fault));
  }
  PetscFunctionReturn(0);
}

bool is_listed(const std::set<std::string>& names, const std::string& name) {
  constexpr std::size_t WORD = 4;  // NAME
  const std::string given = lower(name);
  return std::any_of(names.begin(), names.end(), [&given](const std::string& one) {
    const std::size_t stem = one.size() - WORD;
    return lower(one) == given || (one.compare(stem, WORD, "NAME") == 0 && given.size() > stem && given.compare(0, stem, lower(one), 0, stem) == 0);
  });
}

PetscErrorCode reject_unknown_options(MPI_Comm comm, const std::set<std::string>& others) {
  std::map<std::string, std::string> unread;  // names as PETSc parsed them, so that values beginning with '-' are not taken for names
  std::set<std::string> known = known_options(comm);
  std::string unknown;
  PetscFunctionBegin;
  PetscCall(unread_options(&unread));
  known.insert(others.begin(), others.end());
  for (const auto& [name, value] : unread)
    if (unknown.empty() && strncasecmp(name.c_str(), "-bs_", 4) == 0 && !is_listed(others, name)) unknown = name;
  if (unknown.empty()) PetscFunctionReturn(0);
  // A third of the letters behind -bs_ may be wrong, or two; never all.
  const int letters = static_cast<int>(unknown.size()) - 4;
  const int most = std::min(std::max(2, letters / 3), letters - 1);
  const std::string meant = nearest(unknown, known, most);
  const std::string advice = meant.empty() ? "-help lists the options" : "did you mean " + meant + "?";
  PetscFunctionReturn(fail(comm, Exit::input, "option " + unknown + " does not exist: " + advice));
}

}  // namespace bs
