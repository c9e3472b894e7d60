// The answer to a misspelt -bs_ option.
#include <strings.h>

#include <algorithm>

#include "base/fault.hpp"
#include "base/options.hpp"
#include "base/words.hpp"

namespace bs {

PetscErrorCode reject_unknown_options(MPI_Comm comm) {
  PetscInt count = 0;
  char **names = nullptr, **values = nullptr;
  std::string unknown;

  PetscFunctionBegin;
  // Options that no reader knows: names as PETSc parsed them, so that values beginning with '-' are not taken for names.
  PetscCall(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  for (PetscInt i = 0; i < count && unknown.empty(); ++i)
    if (strncasecmp(names[i], "bs_", 3) == 0) unknown = std::string("-") + names[i];
  PetscCall(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  if (unknown.empty()) PetscFunctionReturn(0);
  // A third of the letters behind -bs_ may be wrong, or two; never all.
  const int letters = static_cast<int>(unknown.size()) - 4;
  const int most = std::min(std::max(2, letters / 3), letters - 1);
  const std::string meant = nearest(unknown, known_options(), most);
  const std::string advice = meant.empty() ? "-help lists the options" : "did you mean " + meant + "?";
  PetscFunctionReturn(tell(comm, Exit::input, "option " + unknown + " does not exist: " + advice));
}

}  // namespace bs
