// Forces that a program on the library computes, with their tangent and their energy: products, matrices and changes of energy against formulas.
#include "systems/particles/callback_forces.hpp"
#include <algorithm>
#include <array>
#include "base/context.hpp"
#include "condensed_case.hpp"
#include "static_case.hpp"

using namespace bs;

namespace {

constexpr double A[2][2] = {{3, 1}, {-2, 4}}, B[2][2] = {{0.4, 0.3}, {-0.2, 0.6}}, C[2][2] = {{-1, 0.5}, {0.2, -2}};

/// f = A sin(B x + t) + C v in the plane, whose tangents are not symmetric; how often it was asked for them.
ForceCallback swirl(int* asked) {
  ForceCallback all;
  all.force = [](double t, const ForceCallback::Rows& row, const double* x, const double* v, double* f) {
    for (std::size_t k = 0; k < row.size(); ++k, x += 2, v += 2, f += 2)
      for (int r = 0; r < 2; ++r)
        for (int c = 0; c < 2; ++c) f[r] += A[r][c] * std::sin(B[c][0] * x[0] + B[c][1] * x[1] + t) + C[r][c] * v[c];
  };
  all.tangent = [asked](double t, const ForceCallback::Rows& row, const ForceCallback::Pairs&, const double* x, const double*,
                        const ForceCallback::Blocks& add) {
    ++*asked;
    double *K = add.K, *D = add.D;
    for (std::size_t k = 0; k < row.size(); ++k, x += 2, K += 4, D += 4)
      for (int r = 0; r < 2; ++r)
        for (int c = 0; c < 2; ++c) {
          D[2 * r + c] += C[r][c];
          for (int q = 0; q < 2; ++q) K[2 * r + c] += A[r][q] * std::cos(B[q][0] * x[0] + B[q][1] * x[1] + t) * B[q][c];
        }
  };
  return all;
}

/// The same of x_j - x_i and v_j - v_i as a force on i alone, for pairs of neighbours.
ForceCallback chase(int* asked) {
  ForceCallback all;
  all.between = {{3, 4}, {8, 9}, {9, 8}, {13, 14}, {20, 21}, {21, 22}};
  const ForceCallback one = swirl(asked);
  const auto apart = [](const double* x, std::int64_t i, std::int64_t j) {
    return std::array<double, 2>{x[2 * j] - x[2 * i], x[2 * j + 1] - x[2 * i + 1]};
  };
  all.force = [=](double t, const ForceCallback::Rows& row, const double* x, const double* v, double* f) {
    const auto find = [&](std::int64_t k) { return std::lower_bound(row.begin(), row.end(), k); };
    for (const auto& [a, b] : all.between) {
      const auto i = find(a), j = find(b);
      if (i == row.end() || j == row.end() || *i != a || *j != b) continue;
      one.force(t, {0}, apart(x, i - row.begin(), j - row.begin()).data(), apart(v, i - row.begin(), j - row.begin()).data(),
                f + 2 * (i - row.begin()));
    }
  };
  all.tangent = [=](double t, const ForceCallback::Rows&, const ForceCallback::Pairs& pair, const double* x, const double* v,
                    const ForceCallback::Blocks& add) {
    for (std::size_t k = 0; k < pair.size(); ++k) {
      const auto [i, j] = pair[k];
      double K[4] = {}, D[4] = {};
      one.tangent(t, {0}, {}, apart(x, i, j).data(), apart(v, i, j).data(), {K, D, nullptr, nullptr});
      for (int q = 0; q < 4; ++q) {
        add.K[4 * i + q] -= K[q];
        add.D[4 * i + q] -= D[q];
        add.K_between[4 * k + q] += K[q];
        add.D_between[4 * k + q] += D[q];
      }
    }
    *asked = 1;
  };
  return all;
}

/// f = -H x with E = x.Hx/2, H indefinite: its positive part is that of (1, 1).
ForceCallback saddle() {
  ForceCallback all;
  all.force = [](double, const ForceCallback::Rows& row, const double* x, const double*, double* f) {
    for (std::size_t k = 0; k < row.size(); ++k, x += 2, f += 2) {
      f[0] -= x[0] + 3 * x[1];
      f[1] -= 3 * x[0] + x[1];
    }
  };
  all.tangent = [](double, const ForceCallback::Rows& row, const ForceCallback::Pairs&, const double*, const double*,
                   const ForceCallback::Blocks& add) {
    double* K = add.K;
    for (std::size_t k = 0; k < row.size(); ++k, K += 4)
      for (int q = 0; q < 4; ++q) K[q] -= q == 0 || q == 3 ? 1 : 3;
  };
  all.energy = [](double, const ForceCallback::Rows& row, const double* x, double* E) {
    for (std::size_t k = 0; k < row.size(); ++k, x += 2) E[k] += 0.5 * (x[0] * x[0] + 6 * x[0] * x[1] + x[1] * x[1]);
  };
  return all;
}

/// A net in the plane on which such forces act, and a direction that leaves held particles.
struct Acted {
  Case c;
  CallbackForces forces;
  LocalState state, direction;
  VecHandle z;
  std::size_t size = 0;

  static GeneratorSpec net() {
    GeneratorSpec spec;
    spec.type = LatticeType::square;
    spec.size = {5, 6};
    spec.dim = 2;
    spec.stiffness = {30, 20, 10};
    spec.fixed_particles = {0, 7};
    spec.damping = {0.5};  // velocities of other ranks' particles are known
    return spec;
  }
  explicit Acted(const ForceCallback& callback) : c(PETSC_COMM_WORLD, net(), 40.0) {
    held_by<ForceCallback>(c.net.comm) = callback;
    forces.create(c.net, c.pattern);
    held_by<ForceCallback>(c.net.comm) = {};
    size = static_cast<std::size_t>(c.net.n * 2);
    REQUIRE(state.create(c.net, c.y) == 0);
    REQUIRE(direction.create(c.net, c.y) == 0);
    REQUIRE(VecDuplicate(c.y, z.out()) == 0);
    PetscScalar* a = nullptr;
    REQUIRE(VecGetArray(z, &a) == 0);
    for (PetscInt k = 0; k < c.net.n * 4; ++k)
      a[k] = c.net.fixed[static_cast<std::size_t>(k / 4)]
                 ? 0
                 : std::sin(2.9 * static_cast<double>(c.net.row[static_cast<std::size_t>(k / 4)]) + static_cast<double>(k % 4));
    REQUIRE(VecRestoreArray(z, &a) == 0);
  }
  std::vector<double> force(double t, Vec y) {
    std::vector<double> f(size);
    Singularity fault;
    REQUIRE(state.gather(t, y) == 0);
    for (const Part part : {Part::interior, Part::boundary}) c.terms->forces(part, t, state, f.data(), &fault);
    return f;
  }
  std::vector<double> product(double t) {
    std::vector<double> f(size);
    REQUIRE(c.linearised.linearise(t, c.y) == 0);
    REQUIRE(c.linearised.change_of_force(z, f.data()) == 0);
    return f;
  }
  /// S z of the velocities of z.
  std::vector<double> condensed(CondensedStorage storage, double t, const Coefficients& abc, bool positive) {
    MatHandle S;
    VecHandle p, q;
    REQUIRE(c.linearised.linearise(t, c.y) == 0);
    REQUIRE(c.linearised.create(storage, S.out()) == 0);
    REQUIRE(c.linearised.assemble(abc, positive, S) == 0);
    REQUIRE(MatCreateVecs(S, p.out(), q.out()) == 0);
    {
      const ReadArray az(z);
      const WriteArray ap(p);
      for (PetscInt i = 0; i < c.net.n; ++i) std::copy_n(az.data() + i * 4 + 2, 2, ap.data() + i * 2);
    }
    REQUIRE(MatMult(S, p, q) == 0);
    const ReadArray aq(q);
    return {aq.data(), aq.data() + size};
  }
};

double largest(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most_of_ranks(most);
}

}  // namespace

TEST_CASE("the tangent of forces computed outside is that of differences, in products and in the full Jacobian") {
  constexpr double t = 0.3, h = 1e-5, sigma = 40;
  int asked = 0;
  const bool between = GENERATE(false, true);
  Acted with(between ? chase(&asked) : swirl(&asked));
  const std::vector<double> without = with.product(t);
  with.c.terms->add(with.forces);
  CHECK_FALSE(with.c.terms->symmetric());
  CHECK_FALSE(with.c.linearised.exact_symmetric());
  const std::vector<double> f = with.product(t);
  CHECK(largest(f, without) > 1);
  (void)with.product(t);
  CHECK(asked == (with.c.net.n > 0 ? 1 : 0));  // once for a state
  VecHandle there;
  REQUIRE(VecDuplicate(with.c.y, there.out()) == 0);
  REQUIRE(VecWAXPY(there, h, with.z, with.c.y) == 0);
  std::vector<double> slope = with.force(t, there);
  REQUIRE(VecWAXPY(there, -h, with.z, with.c.y) == 0);
  const std::vector<double> before = with.force(t, there);
  for (std::size_t k = 0; k < slope.size(); ++k) slope[k] = with.c.net.fixed[k / 2] ? 0 : (slope[k] - before[k]) / (2 * h);
  CHECK(largest(f, slope) < 1e-6);

  // rows of v: sigma M z_v - K z_x - D z_v
  MatHandle J;
  with.c.pattern.create(with.c.net);
  REQUIRE(with.c.pattern.create_matrix(with.c.net, J.out()) == 0);
  RowWriter writer(with.c.net, with.c.pattern);
  REQUIRE(writer.begin(J) == 0);
  REQUIRE(with.state.gather(t, with.c.y) == 0);
  REQUIRE(with.c.terms->jacobian(t, with.state, sigma, true, &writer) == 0);
  REQUIRE(writer.end() == 0);
  REQUIRE(MatMult(J, with.z, there) == 0);
  const ReadArray product(there), direction(with.z);
  std::vector<double> rows(with.size), expected(with.size);
  for (std::size_t k = 0; k < with.size; ++k) {
    const std::size_t at = k / 2 * 4 + 2 + k % 2;
    rows[k] = product.data()[at];
    expected[k] = sigma * with.c.net.inertia[k / 2] * direction.data()[at] - f[k];
  }
  CHECK(largest(rows, expected) < 1e-11);
}

TEST_CASE("matrices hold the symmetric part of the tangent of forces computed outside, and its definite part where that is asked for") {
  constexpr double t = 0.3;
  const Coefficients abc{0, 0.7, 1.3};
  for (const CondensedStorage storage : {CondensedStorage::springs, CondensedStorage::baij}) {
    int asked = 0;
    const ForceCallback callback = swirl(&asked);
    Acted with(callback), without({});
    with.c.terms->add(with.forces);
    const std::vector<double> more = with.condensed(storage, t, abc, false);
    std::vector<double> expected = without.condensed(storage, t, abc, false);
    const ReadArray y(with.c.y), z(with.z);
    for (PetscInt i = 0; i < with.c.net.n; ++i) {
      if (with.c.net.fixed[static_cast<std::size_t>(i)]) continue;
      double K[4] = {}, D[4] = {};
      callback.tangent(t, {0}, {}, y.data() + i * 4, y.data() + i * 4 + 2, {K, D, nullptr, nullptr});
      for (int r = 0; r < 2; ++r)
        for (int c = 0; c < 2; ++c)
          expected[static_cast<std::size_t>(i * 2 + r)] -=
              0.5 * (abc.damping * (D[2 * r + c] + D[2 * c + r]) + abc.stiffness * (K[2 * r + c] + K[2 * c + r])) * z.data()[i * 4 + 2 + c];
    }
    CHECK(largest(more, expected) < 1e-11);
  }
  Acted with(saddle()), without({});
  with.c.terms->add(with.forces);
  const std::vector<double> more = with.condensed(CondensedStorage::springs, t, {0, 0, 1}, true);
  std::vector<double> expected = without.condensed(CondensedStorage::springs, t, {0, 0, 1}, true);
  const ReadArray z(with.z);
  for (PetscInt i = 0; i < with.c.net.n; ++i)  // of H = ((1, 3), (3, 1)): 4 along (1, 1)
    for (int r = 0; r < 2 && !with.c.net.fixed[static_cast<std::size_t>(i)]; ++r)
      expected[static_cast<std::size_t>(i * 2 + r)] += 2 * (z.data()[i * 4 + 2] + z.data()[i * 4 + 3]);
  CHECK(largest(more, expected) < 1e-11);
}

TEST_CASE("matrices hold the symmetric part of what acts between particles") {
  constexpr double t = 0.3;
  int asked = 0;
  for (const CondensedStorage storage : {CondensedStorage::springs, CondensedStorage::baij}) {
    Acted with(chase(&asked)), without({});
    with.c.terms->add(with.forces);
    const auto quadratic = [&](Acted& one, const std::vector<double>& product) {  // w.P w of the velocities of z
      const ReadArray z(one.z);
      double sum = 0;
      for (std::size_t k = 0; k < one.size; ++k)
        if (!one.c.net.fixed[k / 2]) sum += z.data()[k / 2 * 4 + 2 + k % 2] * product[k];
      MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
      return sum;
    };
    // K alone: its product with (w, 0), w being the velocities of z
    VecHandle shifted;
    REQUIRE(VecDuplicate(with.z, shifted.out()) == 0);
    REQUIRE(VecZeroEntries(shifted) == 0);
    {
      const ReadArray z(with.z);
      const WriteArray s(shifted);
      for (std::size_t k = 0; k < with.size; ++k) s[static_cast<PetscInt>(k / 2 * 4 + k % 2)] = z.data()[k / 2 * 4 + 2 + k % 2];
    }
    const auto stiffness = [&](Acted& one) {
      std::vector<double> f(one.size);
      REQUIRE(one.c.linearised.linearise(t, one.c.y) == 0);
      REQUIRE(one.c.linearised.change_of_force(shifted, f.data()) == 0);
      return f;
    };
    const double assembled =
        quadratic(with, with.condensed(storage, t, {0, 0, 1}, false)) - quadratic(without, without.condensed(storage, t, {0, 0, 1}, false));
    const double expected = -quadratic(with, stiffness(with)) + quadratic(without, stiffness(without));
    CHECK(std::abs(expected) > 0.1);
    CHECK(assembled == Approx(expected).epsilon(1e-9));
  }
}

TEST_CASE("energies that come with forces computed outside are counted and searched along") {
  constexpr double t = 0.3, lambda = 0.2, sigma = 3;
  Acted with(saddle());
  const auto energy = [&](Vec y) {
    Energies sum;
    REQUIRE(with.state.gather(t, y) == 0);
    with.forces.energies(t, with.state, &sum);
    MPI_Allreduce(MPI_IN_PLACE, &sum.field, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    return sum.field;
  };
  CHECK(with.forces.lacks_potential().empty());
  VecHandle there;
  REQUIRE(VecDuplicate(with.c.y, there.out()) == 0);
  REQUIRE(VecWAXPY(there, lambda, with.z, with.c.y) == 0);
  const double after = energy(there), before = energy(with.c.y);
  std::vector<double> f(with.size);
  PotentialChange change;
  Singularity fault;
  for (const Part part : {Part::interior, Part::boundary}) with.forces.forces(part, t, with.state, f.data(), &fault, nullptr);
  REQUIRE(with.direction.gather_direction(with.z) == 0);
  with.forces.beyond_slope(t, with.state, with.direction, lambda, sigma, &change);
  const ReadArray z(with.z);
  double sums[3] = {change.value, change.noise, 0};
  for (std::size_t k = 0; k < with.size; ++k) sums[2] += f[k] * z.data()[k / 2 * 4 + k % 2];
  MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
  CHECK(sums[0] == Approx(sigma * (after - before + lambda * sums[2])).epsilon(1e-11));
  CHECK(sums[1] > 0);
  CHECK(sums[1] < 1e-10);
}
