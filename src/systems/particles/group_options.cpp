#include "systems/particles/group_options.hpp"
#include <algorithm>
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"

namespace bs {

PetscErrorCode read_options_of_groups(MPI_Comm comm, const Lattice& lattice, const std::string& begin, const char* title, const char* help,
                                      GroupOptions* out) {
  std::vector<std::string> given;
  std::string known, none;

  PetscFunctionBegin;
  for (const Group& group : lattice.groups) known += (known.empty() ? "" : ", ") + group.name;
  PetscCall(option_endings(begin, &given));
  for (const std::string& name : given)
    if (std::none_of(lattice.groups.begin(), lattice.groups.end(), [&](const Group& one) { return lower(one.name) == lower(name); }))
      PetscCall(fail(comm, Exit::input,
                     "option -" + begin + name + ": there is no group " + name + ": choose its particles by -bs_group_" + name +
                         (known.empty() ? "" : ", or name one of " + known)));
  PetscCall(read_section(comm, title, [&](Section& o) {
    o.text(("-" + begin + "NAME").c_str(), help, none);
    for (std::size_t g = 0; g < lattice.groups.size(); ++g) {
      std::string text;
      if (o.text(("-" + begin + lattice.groups[g].name).c_str(), help, text)) out->emplace_back(g, text);
    }
  }));
  PetscFunctionReturn(0);
}

}  // namespace bs
