#include "input/adjust.hpp"

#include <algorithm>
#include <cmath>

#include "base/fault.hpp"

namespace bs {

/// Smallest box around the particles of all ranks.
static PetscErrorCode bounding_box(MPI_Comm comm, const Lattice& l, Box* box) {
  const std::size_t d = static_cast<std::size_t>(l.dim);

  PetscFunctionBegin;
  std::fill(box->lo, box->lo + d, INFINITY);
  std::fill(box->hi, box->hi + d, -INFINITY);
  for (std::size_t p = 0; p < l.position.size(); ++p) {
    box->lo[p % d] = std::min(box->lo[p % d], l.position[p]);
    box->hi[p % d] = std::max(box->hi[p % d], l.position[p]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, box->lo, l.dim, MPI_DOUBLE, MPI_MIN, comm));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, box->hi, l.dim, MPI_DOUBLE, MPI_MAX, comm));
  PetscFunctionReturn(0);
}

PetscErrorCode adjust_lattice(MPI_Comm comm, const GeneratorSpec& spec, Lattice* l) {
  Faces faces = 0;
  Box box;

  PetscFunctionBegin;
  std::string fault = check_particle_data(spec, l->dim, l->dim, l->particles.total);
  if (fault.empty()) fault = parse_faces(spec.fixed, l->dim, &faces);
  if (!fault.empty()) PetscCall(tell(comm, Exit::input, l->source + ": " + fault));
  if (l->fixed.empty()) l->fixed.assign(static_cast<std::size_t>(l->particles.count), 0);
  if (faces || !spec.groups.empty()) PetscCall(bounding_box(comm, *l, &box));
  if (faces) apply_faces(faces, box, 0, l->dim, l->position, &l->fixed);
  choose_groups(spec.groups, box, 0, l);
  apply_fixed_particles(spec.fixed_particles, l->particles, &l->fixed);
  fix_groups(spec.fixed_groups, l);
  if (spec.radius > 0)
    set_column(&l->particle_columns,
               {"radius", "-bs_lattice_radius", std::vector<double>(static_cast<std::size_t>(l->particles.count), spec.radius)});
  if (!spec.velocity.empty() || !spec.velocity_gradient.empty())
    apply_velocity(spec.velocity, spec.velocity_gradient, l->dim, l->position, l->fixed, &l->velocity);
  const std::size_t d = static_cast<std::size_t>(l->dim);
  for (std::size_t p = 0; p < l->velocity.size(); ++p)
    if (l->fixed[p / d]) l->velocity[p] = 0;  // whatever the file says
  PetscFunctionReturn(0);
}

PetscErrorCode warn_of_idle_options(MPI_Comm comm, const std::string& source) {
  static const char* const names[] = {
      "-bs_lattice_size",          "-bs_lattice_spacing",   "-bs_lattice_neighbors",      "-bs_lattice_perturbation",
      "-bs_lattice_seed",          "-bs_lattice_origin",    "-bs_lattice_stiff_fraction", "-bs_lattice_stiff_factor",
      "-bs_angle_stiffness",       "-bs_rest_angle",        "-bs_lattice_periodic",       "-bs_lattice_total_mass",
      "-bs_lattice_particle_mass", "-bs_lattice_stiffness", "-bs_lattice_damping",        "-bs_lattice_rest_length_factor"};
  std::string idle;
  PetscBool set;

  PetscFunctionBegin;
  for (const char* name : names) {
    PetscCall(PetscOptionsHasName(nullptr, nullptr, name, &set));
    if (set) idle += (idle.empty() ? "" : ", ") + std::string(name);
  }
  if (!idle.empty()) PetscCall(warn(comm, source + ": the file has its own values; ignored: " + idle));
  PetscFunctionReturn(0);
}

}  // namespace bs
