// A kind of force that the program has not, a driven rigid sphere that repels, as one more term: what a user writes, and all uses made of it.
#include <array>

#include "condensed_case.hpp"
#include "systems/particles/terms.hpp"

using namespace bs;

namespace {

/// E = k/2 (R - r)^2 of every particle at a distance r < R from the centre C(t) = c + u t: force k (R - r) n, n = (x - C)/r,
///   df/dx = -k n n^T + k (R/r - 1) (I - n n^T)
template <int d>
class Sphere final : public Term {
 public:
  Sphere(const Network& net, double k, double R, std::array<double, 3> c, std::array<double, 3> u) : net_(net), k_(k), R_(R), c_(c), u_(u) {}
  void forces(Part part, double t, const LocalState& state, double* f, Singularity*, Energies* sum) const override {
    for (PetscInt i = 0; i < net_.n; ++i) {
      if (net_.boundary(i) != (part == Part::boundary)) continue;
      const Touch at(*this, t, state.at(i));
      if (sum) sum->elastic += 0.5 * k_ * at.depth * at.depth;
      for (int c = 0; c < d && !net_.fixed[i]; ++c) f[i * d + c] += k_ * at.depth * at.n[c];
    }
  }
  void forces_on(const std::vector<PetscInt>& which, double t, const LocalState& state, double* f) const override {
    for (std::size_t k = 0; k < which.size(); ++k) {
      const Touch at(*this, t, state.at(which[k]));
      for (int c = 0; c < d; ++c) f[k * d + c] += k_ * at.depth * at.n[c];
    }
  }
  void energies(double t, const LocalState& state, Energies* sum) const override {
    for (PetscInt i = 0; i < net_.n; ++i) sum->elastic += 0.5 * k_ * std::pow(Touch(*this, t, state.at(i)).depth, 2);
  }
  void multiply_tangent(double t, const LocalState& state, const LocalState& z, double* f) const override {
    each_block(t, state, false, [&](PetscInt i, const double* K) {
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c) f[i * d + r] += K[r * d + c] * z.at(i)[c];
    });
  }
  void join(std::vector<std::pair<PetscInt, PetscInt>>* joins) const override {
    for (PetscInt i = 0; i < net_.n; ++i)
      if (!net_.fixed[i]) joins->emplace_back(i, i);
  }
  void add_blocks(double t, const LocalState& state, bool positive, const Coefficients& abc, SparseBlocks* blocks) const override {
    each_block(t, state, positive, [&](PetscInt i, const double* K) {
      double* to = blocks->block(blocks->find(i, i));
      for (int k = 0; k < d * d; ++k) to[k] -= abc.stiffness * K[k];
    });
  }
  void beyond_slope(double t, const LocalState& state, const LocalState& line, double lambda, double sigma, PotentialChange* sum) const override {
    for (PetscInt i = 0; i < net_.n; ++i) {
      double there[d], slope = 0;
      const Touch at(*this, t, state.at(i));
      for (int c = 0; c < d; ++c) {
        there[c] = state.at(i)[c] + lambda * line.at(i)[c];
        slope -= k_ * at.depth * at.n[c] * lambda * line.at(i)[c];
      }
      sum->value += sigma * (0.5 * k_ * (std::pow(Touch(*this, t, there).depth, 2) - at.depth * at.depth) - slope);
    }
  }

 private:
  struct Touch {
    double n[d], r = 0, depth = 0;
    Touch(const Sphere& s, double t, const double* x) {
      for (int c = 0; c < d; ++c) {
        n[c] = x[c] - s.c_[static_cast<std::size_t>(c)] - s.u_[static_cast<std::size_t>(c)] * t;
        r += n[c] * n[c];
      }
      r = std::sqrt(r);
      for (double& one : n) one /= r;
      depth = std::max(0.0, s.R_ - r);
    }
  };
  template <class Use>
  void each_block(double t, const LocalState& state, bool positive, Use&& use) const {
    for (PetscInt i = 0; i < net_.n; ++i) {
      const Touch at(*this, t, state.at(i));
      if (net_.fixed[i] || at.depth == 0) continue;
      double K[d * d];
      for (int r = 0; r < d; ++r)
        for (int c = 0; c < d; ++c) K[r * d + c] = -k_ * at.n[r] * at.n[c] + (positive ? 0 : k_ * at.depth / at.r * ((r == c) - at.n[r] * at.n[c]));
      use(i, K);
    }
  }

  const Network& net_;
  double k_, R_;
  std::array<double, 3> c_, u_;
};

/// f - f' along z by central differences, f by use(y).
template <class Use>
std::vector<double> slope(Vec y, Vec z, double h, Use&& use) {
  VecHandle there;
  REQUIRE(VecDuplicate(y, there.out()) == 0);
  REQUIRE(VecWAXPY(there, h, z, y) == 0);
  std::vector<double> after = use(there.get());
  REQUIRE(VecWAXPY(there, -h, z, y) == 0);
  const std::vector<double> before = use(there.get());
  for (std::size_t k = 0; k < after.size(); ++k) after[k] = (after[k] - before[k]) / (2 * h);
  return after;
}

double largest(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  return most;
}

template <int d>
void check_spheres() {
  GeneratorSpec spec;
  spec.type = d == 2 ? LatticeType::square : LatticeType::cubic;
  spec.size = d == 2 ? std::vector<std::int64_t>{6, 7} : std::vector<std::int64_t>{4, 3, 4};
  spec.dim = d;
  spec.stiffness = {30, 20, 10};
  spec.fixed_particles = {0, 4};
  const double t = 0.7;
  Case c(PETSC_COMM_WORLD, spec, 40.0);
  Sphere<d> low(c.net, 25, 1.6, {0.3, 0.4, -0.4}, {0.5, 0.1, 0.2}), high(c.net, 40, 1.2, {3.1, 2.2, 1.9}, {-0.2, 0.3, 0});
  LocalState state, direction;
  REQUIRE(state.create(c.net, c.y) == 0);
  REQUIRE(direction.create(c.net, c.y) == 0);
  const std::size_t size = static_cast<std::size_t>(c.net.n * d);
  const auto force = [&](Vec y) {
    std::vector<double> f(size);
    Singularity fault;
    REQUIRE(state.gather(t, y) == 0);
    for (const Part part : {Part::interior, Part::boundary}) c.terms->forces(part, t, state, f.data(), &fault);
    return f;
  };
  const auto energy = [&](Vec y) {
    REQUIRE(state.gather(t, y) == 0);
    std::vector<double> sum{c.terms->energies(t, state).elastic};
    MPI_Allreduce(MPI_IN_PLACE, sum.data(), 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return sum;
  };
  const std::vector<double> without = force(c.y);
  c.terms->add(low);
  c.terms->add(high);
  const std::vector<double> f = force(c.y);
  CHECK(largest(f, without) > 1);

  // a direction that holds fixed particles and has no velocity
  VecHandle z;
  REQUIRE(VecDuplicate(c.y, z.out()) == 0);
  PetscScalar* a = nullptr;
  REQUIRE(VecGetArray(z, &a) == 0);
  double work = 0;
  for (PetscInt i = 0; i < c.net.n; ++i)
    for (int k = 0; k < d; ++k) {
      a[i * 2 * d + k] = c.net.fixed[i] ? 0 : std::sin(2.9 * static_cast<double>(c.net.row[i]) + k);
      a[i * 2 * d + d + k] = 0;
      work += f[static_cast<std::size_t>(i * d + k)] * a[i * 2 * d + k];
    }
  REQUIRE(VecRestoreArray(z, &a) == 0);
  MPI_Allreduce(MPI_IN_PLACE, &work, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(slope(c.y, z, 1e-5, energy)[0] == Approx(-work).epsilon(1e-8));

  // the energies that come with forces, and the change along the line
  Energies sum;
  std::vector<double> again(size);
  Singularity fault;
  REQUIRE(state.gather(t, c.y) == 0);
  for (const Part part : {Part::interior, Part::boundary}) c.terms->forces(part, t, state, again.data(), &fault, &sum);
  CHECK(largest(again, f) == 0);
  CHECK(sum.elastic == Approx(c.terms->energies(t, state).elastic).epsilon(1e-13));
  REQUIRE(direction.gather_direction(z) == 0);
  double change = c.terms->beyond_slope(t, state, direction, 0.1, 1.0).value;
  MPI_Allreduce(MPI_IN_PLACE, &change, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  VecHandle there;
  REQUIRE(VecDuplicate(c.y, there.out()) == 0);
  REQUIRE(VecWAXPY(there, 0.1, z, c.y) == 0);
  CHECK(change == Approx(energy(there)[0] - energy(c.y)[0] + 0.1 * work).epsilon(1e-10));

  // K z by products, by differences, and by matrices of both kinds of storage
  const std::vector<double> expected = slope(c.y, z, 1e-5, force);
  std::vector<double> Kz(size);
  REQUIRE(c.linearised.linearise(t, c.y) == 0);
  REQUIRE(c.linearised.change_of_force(z, Kz.data()) == 0);
  CHECK(largest(Kz, expected) < 1e-6);
  for (const CondensedStorage storage : {CondensedStorage::springs, CondensedStorage::baij}) {
    MatHandle S;
    VecHandle p, q;
    const PetscScalar *az = nullptr, *aq = nullptr;
    REQUIRE(c.linearised.create(storage, S.out()) == 0);
    REQUIRE(c.linearised.assemble({0, 0, 1}, false, S) == 0);
    REQUIRE(MatCreateVecs(S, p.out(), q.out()) == 0);
    REQUIRE(VecGetArrayRead(z, &az) == 0);
    REQUIRE(VecGetArray(p, &a) == 0);
    for (PetscInt i = 0; i < c.net.n; ++i) std::copy_n(az + i * 2 * d, d, a + i * d);
    REQUIRE(VecRestoreArray(p, &a) == 0);
    REQUIRE(VecRestoreArrayRead(z, &az) == 0);
    REQUIRE(MatMult(S, p, q) == 0);
    REQUIRE(VecGetArrayRead(q, &aq) == 0);
    std::vector<double> found(aq, aq + size);
    for (double& one : found) one = -one;
    REQUIRE(VecRestoreArrayRead(q, &aq) == 0);
    CHECK(largest(found, Kz) < (storage == CondensedStorage::springs ? 1e-4 : 1e-11));  // springs: single precision
  }
}

}  // namespace

TEST_CASE("driven spheres that repel are terms like others: forces, energies, tangents, matrices") {
  check_spheres<2>();
  check_spheres<3>();
}
