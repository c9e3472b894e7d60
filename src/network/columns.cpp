#include <petscsf.h>
#include <algorithm>
#include "base/collective.hpp"
#include "lattice/spring_laws.hpp"
#include "network/migrate.hpp"

namespace bs {

SpringRows::SpringRows(const Lattice& lattice) : lattice_(lattice) {
  const auto column = [&](const char* name) -> const double* {
    const Column* found = find_column(lattice.spring_columns, name);
    return found ? found->value.data() : nullptr;
  };
  for (const SpringLawInfo& law : spring_laws()) {
    columns_.emplace_back();
    for (const SpringParameter& one : law.parameters) columns_.back().push_back(column(one.name));
    for (const SpringHistory& one : law.history) columns_.back().push_back(column(one.name));
  }
}

void SpringRows::fill(std::size_t k, double* more) const {
  for (const double* column : columns_[static_cast<std::size_t>(law(k))]) *more++ = column ? column[k] : 0.0;
}

double SpringRows::rate(std::size_t k) const {
  double more[SPRING_WIDTH] = {};
  fill(k, more);
  return spring_rate_at_rest(static_cast<std::size_t>(law(k)), lattice_.stiffness[k], lattice_.rest_length[k], more);
}

int anchor_law(const Lattice& lattice) {
  const int law = static_cast<int>(lattice.spring_law);
  return spring_laws()[static_cast<std::size_t>(law)].width() == 0 ? law : static_cast<int>(SpringLaw::hooke);
}

namespace {

/// What one spring's row is in transit: its law, then what that takes.
PetscErrorCode fetch(MPI_Comm comm, const Lattice& lattice, Network* net) {
  Links& links = net->links;
  const SpringRows rows(lattice);
  constexpr std::size_t unit = SPRING_WIDTH + 1;
  const std::size_t chunk = static_cast<std::size_t>(lattice.springs.count);
  std::vector<double> given(chunk * unit, 0.0), got(links.spring.size() * unit, 0.0);
  std::vector<PetscInt> here, there;
  LayoutHandle layout;
  SFHandle sf;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < chunk; ++k) {
    given[k * unit] = rows.law(k);
    rows.fill(k, &given[k * unit + 1]);
  }
  for (std::size_t e = 0; e < links.spring.size(); ++e)
    if (links.spring[e] >= 0) {
      here.push_back(static_cast<PetscInt>(e));
      there.push_back(static_cast<PetscInt>(links.spring[e]));
    }
  PetscCall(PetscLayoutCreateFromSizes(comm, static_cast<PetscInt>(chunk), PETSC_DECIDE, 1, layout.out()));
  PetscCall(PetscSFCreate(comm, sf.out()));
  PetscCall(PetscSFSetGraphLayout(sf, layout, static_cast<PetscInt>(here.size()), here.data(), PETSC_COPY_VALUES, there.data()));
  PetscCall(fetch_roots(sf, static_cast<int>(unit), given, &got));
  net->laws.assign(spring_laws().size(), 0);
  for (std::size_t e = 0; e < links.spring.size(); ++e) {
    links.law.push_back(static_cast<std::uint8_t>(got[e * unit]));
    if (links.spring[e] >= 0) net->laws[links.law.back()] = 1;
  }
  PetscCall(max_over_ranks(comm, net->laws.data(), net->laws.size()));
  for (std::size_t law = 0; law < net->laws.size(); ++law) {
    if (!net->laws[law]) continue;
    links.width = std::max(links.width, static_cast<int>(spring_laws()[law].width()));
    net->softens = net->softens || spring_laws()[law].softens;
    net->relaxes = net->relaxes || spring_laws()[law].relaxes;
  }
  const std::size_t width = static_cast<std::size_t>(links.width);
  links.more.reserve(links.spring.size() * width);
  for (std::size_t e = 0; e < links.spring.size(); ++e)
    links.more.insert(links.more.end(), got.begin() + static_cast<std::ptrdiff_t>(e * unit + 1),
                      got.begin() + static_cast<std::ptrdiff_t>(e * unit + 1 + width));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode give_laws(MPI_Comm comm, const Lattice& lattice, Network* net) {
  PetscFunctionBegin;
  net->mixed = lattice.law_by_row || (lattice.spring_law != SpringLaw::hooke && lattice.spring_law != SpringLaw::strain);
  if (!net->mixed) PetscFunctionReturn(0);
  PetscCall(fetch(comm, lattice, net));
  net->anchors.law.assign(net->anchors.particle.size(), static_cast<std::uint8_t>(anchor_law(lattice)));
  PetscFunctionReturn(0);
}

// One column at a time: what is in transit stays small beside what is kept.
PetscErrorCode give_columns(MPI_Comm comm, const Lattice& lattice, Network* net) {
  ParticleColumns& columns = net->columns;
  const std::size_t n = static_cast<std::size_t>(net->n);
  std::vector<double> received;
  std::size_t c = 0;
  PetscFunctionBegin;
  columns = {};
  for (const Column& column : lattice.particle_columns)
    columns.width += static_cast<std::size_t>(particle_parameters[particle_parameter(column.name)].width(lattice.dim));
  if (columns.width == 0) PetscFunctionReturn(0);
  columns.given.resize(n * columns.width);
  for (const Column& column : lattice.particle_columns) {
    const std::size_t parameter = particle_parameter(column.name),
                      width = static_cast<std::size_t>(particle_parameters[parameter].width(lattice.dim));
    columns.places[parameter] = static_cast<int>(c);
    PetscCall(fetch_rows(comm, lattice.particles, column.value, static_cast<int>(width), net->row, &received));
    for (std::size_t i = 0; i < n; ++i) std::copy_n(&received[i * width], width, &columns.given[i * columns.width + c]);
    c += width;
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
