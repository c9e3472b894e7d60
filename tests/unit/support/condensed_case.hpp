// Lattices moved out of shape, and their tangents, for the tests of the condensed matrix.
#pragma once
#include <petsc/private/petscimpl.h>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "linalg/block_icc.hpp"
#include "small_network.hpp"
#include "systems/first_order.hpp"
#include "systems/particles/constraints/constraints.hpp"
#include "systems/particles/linearised_forces.hpp"

namespace bs {

/// A lattice of its own kind, moved out of shape so that springs are stretched and squeezed.
struct Case {
  Network net;
  ParticleLaws laws;
  Constraints constraints;
  RowPattern pattern;
  std::unique_ptr<Terms> terms;
  LinearisedForces linearised;
  FirstOrderTangent tangent{linearised};
  VecHandle y;

  /// `rolling`: particles of the group "rolling", which -bs_motion_rolling holds.
  Case(MPI_Comm comm, const GeneratorSpec& spec, double sigma, double axial_damping = 0, bool (*rolling)(std::int64_t row) = nullptr) {
    int rank, size;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &size);
    Lattice lattice = generate(spec, rank, size);
    if (axial_damping > 0) {
      lattice.damping_law = DampingLaw::axial;
      lattice.damping.assign(static_cast<std::size_t>(lattice.springs.count), axial_damping);
    }
    for (InteractionRows& kind : lattice.interactions) REQUIRE(number_rows(comm, &kind.rows) == 0);
    if (rolling) {
      Group group{"rolling", std::vector<std::uint8_t>(static_cast<std::size_t>(lattice.particles.count), 0)};
      for (std::int64_t k = 0; k < lattice.particles.count; ++k) group.member[static_cast<std::size_t>(k)] = rolling(lattice.particles.first + k);
      lattice.groups.push_back(group);
      REQUIRE(constraints.read(comm, &lattice) == 0);
    }
    NetworkOptions options;
    options.partition = 1;
    REQUIRE(build_network(comm, lattice, options, &net) == 0);
    REQUIRE(constraints.create(&net) == 0);
    terms = std::make_unique<Terms>(net, laws, constraints.anchors(), pattern);
    const PetscInt d = net.dim;
    REQUIRE(VecCreateMPI(comm, net.n * 2 * d, PETSC_DETERMINE, y.out()) == 0);
    REQUIRE(VecSetBlockSize(y, 2 * d) == 0);
    PetscScalar* a = nullptr;
    REQUIRE(VecGetArray(y, &a) == 0);
    for (PetscInt i = 0; i < net.n; ++i)
      for (PetscInt c = 0; c < d; ++c) {
        const double row = static_cast<double>(net.row[i]);
        a[i * 2 * d + c] = net.held[i * d + c] + 0.05 * std::sin(1.7 * row + static_cast<double>(c));
        a[i * 2 * d + d + c] = std::cos(0.9 * row - static_cast<double>(c));
      }
    REQUIRE(VecRestoreArray(y, &a) == 0);
    REQUIRE(linearised.create(net, *terms, pattern, y, false) == 0);
    REQUIRE(tangent.linearise(0.0, y, sigma, Form::momentum) == 0);
  }
};

/// S of the case's tangent, its definite part, kept by `own`.
inline PairMatrix& assembled(Case* c, MatHandle* own) {
  REQUIRE(c->tangent.create(CondensedStorage::springs, own->out()) == 0);
  REQUIRE(c->tangent.assemble(true, *own) == 0);
  return *PairMatrix::from(*own);
}

/// What was made of S is to be made anew.
inline void mark_changed(Mat S) { REQUIRE(PetscObjectStateIncrease(reinterpret_cast<PetscObject>(S)) == 0); }

/// A PC "bicc" of S that has read its options under the prefix "unit_": `options` are given to it alone.
inline void create_bicc(Mat S, const char* options, PC* pc) {
  PetscOptions own;
  MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(S));
  REQUIRE(register_block_icc() == 0);
  REQUIRE(PetscOptionsCreate(&own) == 0);
  REQUIRE(PetscOptionsInsertString(own, options) == 0);
  REQUIRE(PCCreate(comm, pc) == 0);
  REQUIRE(PetscObjectSetOptions(reinterpret_cast<PetscObject>(*pc), own) == 0);
  REQUIRE(PCSetOptionsPrefix(*pc, "unit_") == 0);
  REQUIRE(PCSetType(*pc, "bicc") == 0);
  REQUIRE(PCSetFromOptions(*pc) == 0);
  REQUIRE(PetscObjectSetOptions(reinterpret_cast<PetscObject>(*pc), nullptr) == 0);
  REQUIRE(PetscOptionsDestroy(&own) == 0);
  REQUIRE(PCSetOperators(*pc, S, S) == 0);
}

inline double relative_difference(Vec a, Vec b) {
  PetscReal size, difference;
  REQUIRE(VecNorm(b, NORM_2, &size) == 0);
  REQUIRE(VecAXPY(a, -1.0, b) == 0);
  REQUIRE(VecNorm(a, NORM_2, &difference) == 0);
  return difference / size;
}

/// A vector of numbers that depend on the particle, not on where it lives.
inline void fill(const Network& net, Vec v) {
  PetscScalar* a = nullptr;
  REQUIRE(VecGetArray(v, &a) == 0);
  for (PetscInt i = 0; i < net.n; ++i)
    for (PetscInt c = 0; c < net.dim; ++c) a[i * net.dim + c] = std::sin(3.1 * static_cast<double>(net.row[i]) + 2.3 * static_cast<double>(c));
  REQUIRE(VecRestoreArray(v, &a) == 0);
}

}  // namespace bs
