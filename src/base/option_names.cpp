#include "base/option_names.hpp"

#include <map>

namespace bs {

namespace {

/// The value of the option `name` (with its dash). PETSc's own look at an option that nothing has read yet would count as one.
PetscErrorCode value_of(const std::string& name, const std::map<std::string, std::string>& unread, std::string* value) {
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
    PetscCall(value_of(name, unread, &value));  // not by the words: a value may hold some that look like options, as 0.1*t -sin(t)
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
    if (name.rfind(begin, 0) == 0) endings->push_back(name.substr(begin.size()));
  PetscFunctionReturn(0);
}

}  // namespace bs
