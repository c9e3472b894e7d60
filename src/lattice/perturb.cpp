// Particles moved by random displacements.
#include "lattice/generator.hpp"
#include "lattice/random.hpp"

namespace bs {

void perturb(const GeneratorSpec& spec, Lattice* lattice) {
  const std::size_t d = static_cast<std::size_t>(lattice->dim);
  if (spec.perturbation <= 0) return;
  for (std::size_t i = 0; i < lattice->fixed.size(); ++i) {
    if (lattice->fixed[i]) continue;
    const std::int64_t row = lattice->particles.first + static_cast<std::int64_t>(i);
    for (std::size_t k = 0; k < d; ++k)
      lattice->position[i * d + k] += spec.perturbation * (2 * hash_uniform(spec.seed, Stream::perturbation, row, static_cast<std::int64_t>(k)) - 1);
  }
}

}  // namespace bs
