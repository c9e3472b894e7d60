#include "base/option_names.hpp"

#include <sstream>

namespace bs {

PetscErrorCode option_endings(const std::string& begin, std::vector<std::string>* endings) {
  char* all = nullptr;

  PetscFunctionBegin;
  endings->clear();
  PetscCall(PetscOptionsGetAll(nullptr, &all));
  std::istringstream words(all);
  PetscCall(PetscFree(all));
  for (std::string word; words >> word;) {
    PetscBool name = PETSC_FALSE;
    PetscCall(PetscOptionsValidKey(word.c_str(), &name));
    if (name && word.rfind("-" + begin, 0) == 0) endings->push_back(word.substr(1 + begin.size()));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
