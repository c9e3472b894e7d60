// The stiffness of springs across their directions by tensions predicted for a change of places: against the formula, in products and in matrices.
#include "systems/particles/linearised_forces.hpp"
#include "condensed_case.hpp"
#include "static_case.hpp"

using namespace bs;

namespace {

VecHandle waves(const Case& c, double size, double phase) {
  VecHandle z;
  PetscScalar* a = nullptr;
  REQUIRE(VecDuplicate(c.y, z.out()) == 0);
  REQUIRE(VecGetArray(z, &a) == 0);
  for (PetscInt k = 0; k < c.net.n * 2 * c.net.dim; ++k)
    a[k] = size * std::sin(phase + 2.3 * static_cast<double>(c.net.row[static_cast<std::size_t>(k / (2 * c.net.dim))]) +
                           static_cast<double>(k % (2 * c.net.dim)));
  REQUIRE(VecRestoreArray(z, &a) == 0);
  return z;
}

/// f_i = -sum over springs of k u (u.dw) + T/l (dw - u (u.dw)), T = k (l - L) + part k u.dz: the largest difference from f.
double error_of(const Case& c, const std::vector<double>& f, Vec z, Vec w, double part) {
  const int d = c.net.dim;
  LocalState at, dz, dw;
  REQUIRE(at.create(c.net, c.y) == 0);
  REQUIRE(dz.create(c.net, c.y) == 0);
  REQUIRE(dw.create(c.net, c.y) == 0);
  REQUIRE(at.gather(0, c.y) == 0);
  REQUIRE(dz.gather_direction(z) == 0);
  REQUIRE(dw.gather_direction(w) == 0);
  double worst = 0;
  for (PetscInt i = 0; i < c.net.n; ++i) {
    double sum[3] = {0, 0, 0}, l, u[3], k;
    for (PetscInt e = c.net.links.start[i]; e < c.net.links.start[i + 1]; ++e) {
      const PetscInt j = c.net.links.other[e];
      k = c.net.links.stiffness[e];
      l = 0;
      for (int x = 0; x < d; ++x) l += (at.at(i)[x] - at.at(j)[x]) * (at.at(i)[x] - at.at(j)[x]);
      l = std::sqrt(l);
      double along_z = 0, along_w = 0;
      for (int x = 0; x < d; ++x) {
        u[x] = (at.at(i)[x] - at.at(j)[x]) / l;
        along_z += u[x] * (dz.at(i)[x] - dz.at(j)[x]);
        along_w += u[x] * (dw.at(i)[x] - dw.at(j)[x]);
      }
      const double T = k * (l - c.net.links.rest_length[e]) + part * k * along_z;
      for (int x = 0; x < d; ++x) sum[x] -= k * u[x] * along_w + T / l * (dw.at(i)[x] - dw.at(j)[x] - u[x] * along_w);
    }
    for (int x = 0; x < d; ++x)
      if (!c.net.fixed[static_cast<std::size_t>(i)]) worst = std::max(worst, std::abs(f[static_cast<std::size_t>(i * d + x)] - sum[x]));
  }
  return most_of_ranks(worst);
}

}  // namespace

TEST_CASE("tangents take predicted tensions until they are forgotten, and changes are shortened so that springs turn little") {
  for (const int d : {2, 3}) {
    GeneratorSpec spec;
    spec.type = d == 2 ? LatticeType::square : LatticeType::cubic;
    spec.size = d == 2 ? std::vector<std::int64_t>{6, 5} : std::vector<std::int64_t>{4, 3, 3};
    spec.dim = d;
    spec.stiffness = {60, 40, 30};
    spec.fixed_particles = {0, 4};
    Case c(PETSC_COMM_WORLD, spec, 7);
    const VecHandle z = waves(c, 0.1, 0.4), w = waves(c, 1, 1.9);
    std::vector<double> f(static_cast<std::size_t>(c.net.n * d));
    double part = 0, half = 0;
    REQUIRE(c.linearised.linearise(0, c.y) == 0);
    REQUIRE(c.linearised.predict_tensions(z, 10, &part) == 0);
    CHECK(part == 1);
    REQUIRE(c.linearised.change_of_force(w, f.data()) == 0);
    CHECK(error_of(c, f, z, w, 1) < 1e-12);
    CHECK(error_of(c, f, z, w, 0) > 1e-2);
    c.linearised.forget_tensions();
    REQUIRE(c.linearised.predict_tensions(z, 0.05, &half) == 0);
    CHECK(half < 0.6);
    REQUIRE(c.linearised.change_of_force(w, f.data()) == 0);
    CHECK(error_of(c, f, z, w, half) < 1e-12);
    for (const CondensedStorage storage : {CondensedStorage::aij, CondensedStorage::springs}) {  // S = -K, the latter in single precision
      MatHandle S;
      VecHandle x, y;
      const PetscScalar *aw = nullptr, *ay = nullptr;
      PetscScalar* ax = nullptr;
      REQUIRE(c.linearised.create(storage, S.out()) == 0);
      REQUIRE(c.linearised.assemble({0, 0, 1}, false, S) == 0);
      REQUIRE(MatCreateVecs(S, x.out(), y.out()) == 0);
      REQUIRE(VecGetArrayRead(w, &aw) == 0);
      REQUIRE(VecGetArray(x, &ax) == 0);
      for (PetscInt i = 0; i < c.net.n; ++i)
        for (int k = 0; k < d; ++k) ax[i * d + k] = c.net.fixed[static_cast<std::size_t>(i)] ? 0 : aw[i * 2 * d + k];
      REQUIRE(VecRestoreArray(x, &ax) == 0);
      REQUIRE(VecRestoreArrayRead(w, &aw) == 0);
      REQUIRE(MatMult(S, x, y) == 0);
      REQUIRE(VecGetArrayRead(y, &ay) == 0);
      double worst = 0;
      for (PetscInt i = 0; i < c.net.n; ++i)
        for (int k = 0; k < d && !c.net.fixed[static_cast<std::size_t>(i)]; ++k)
          worst = std::max(worst, std::abs(ay[i * d + k] + f[static_cast<std::size_t>(i * d + k)]));
      REQUIRE(VecRestoreArrayRead(y, &ay) == 0);
      CHECK(most_of_ranks(worst) < (storage == CondensedStorage::aij ? 1e-12 : 1e-3));
    }
    c.linearised.forget_tensions();
    REQUIRE(c.linearised.change_of_force(w, f.data()) == 0);
    CHECK(error_of(c, f, z, w, 0) < 1e-12);
  }
}
