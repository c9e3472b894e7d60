// Backward Euler with Newton on the condensed velocity system, solved by Eigen's conjugate gradients with Jacobi
// (--ic 0) or IncompleteCholesky (--ic 1).
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <cmath>
#include <cstdio>
#include "cube.hpp"

using peers::Cube;
using peers::Values;
using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;
using Vector = Eigen::VectorXd;

/// S = M/h + h K, pattern fixed at construction; rows and columns of fixed particles hold M/h alone.
class Tangent {
 public:
  explicit Tangent(const Cube& cube) : cube_(cube) {
    std::vector<Eigen::Triplet<double>> entries;
    const auto block = [&](int a, int b) {
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) entries.emplace_back(3 * a + r, 3 * b + c, 0.0);
    };
    for (std::size_t p = 0; p < cube.particles; ++p) block(static_cast<int>(p), static_cast<int>(p));
    for (std::size_t s = 0; s < cube.i.size(); ++s) {
      block(cube.i[s], cube.j[s]);
      block(cube.j[s], cube.i[s]);
    }
    const int rows = static_cast<int>(3 * cube.particles);
    S.resize(rows, rows);
    S.setFromTriplets(entries.begin(), entries.end());
    S.makeCompressed();
    for (std::size_t p = 0; p < cube.particles; ++p) diagonal_.push_back(place(static_cast<int>(p), static_cast<int>(p)));
    for (std::size_t s = 0; s < cube.i.size(); ++s) upper_.push_back(place(cube.i[s], cube.j[s]));
    for (std::size_t s = 0; s < cube.i.size(); ++s) lower_.push_back(place(cube.j[s], cube.i[s]));
  }

  // K of a strain spring: (K/L) u u^T + K (1/L - 1/l) (I - u u^T)
  void fill(const Vector& x, double h) {
    double* a = S.valuePtr();
    std::fill_n(a, S.nonZeros(), 0.0);
    for (std::size_t p = 0; p < cube_.particles; ++p) add(static_cast<int>(p), diagonal_[p], identity(cube_.mass / h), 1);
    for (std::size_t s = 0; s < cube_.i.size(); ++s) {
      const int i = cube_.i[s], j = cube_.j[s];
      const Eigen::Vector3d d = x.segment<3>(3 * i) - x.segment<3>(3 * j);
      const double l = d.norm(), across = cube_.K[s] * (1 / cube_.L[s] - 1 / l), along = cube_.K[s] / cube_.L[s] - across;
      const Eigen::Matrix3d k = h * (identity(across) + along / (l * l) * d * d.transpose());
      if (!cube_.fixed[i]) add(i, diagonal_[i], k, 1);
      if (!cube_.fixed[j]) add(j, diagonal_[j], k, 1);
      if (cube_.fixed[i] || cube_.fixed[j]) continue;
      add(i, upper_[s], k, -1);
      add(j, lower_[s], k, -1);
    }
  }
  Matrix S;

 private:
  static Eigen::Matrix3d identity(double a) { return a * Eigen::Matrix3d::Identity(); }
  /// Offset of block (a, b) within row 3a; the same in its three rows.
  int place(int a, int b) const {
    const int *first = S.innerIndexPtr() + S.outerIndexPtr()[3 * a], *last = S.innerIndexPtr() + S.outerIndexPtr()[3 * a + 1];
    return static_cast<int>(std::lower_bound(first, last, 3 * b) - first);
  }
  void add(int row, int offset, const Eigen::Matrix3d& k, double sign) {
    for (int r = 0; r < 3; ++r) {
      double* at = S.valuePtr() + S.outerIndexPtr()[3 * row + r] + offset;
      for (int c = 0; c < 3; ++c) at[c] += sign * k(r, c);
    }
  }
  const Cube& cube_;
  std::vector<int> diagonal_, upper_, lower_;
};

struct Counts {
  int newton = 0, krylov = 0;
  bool converged = true;
};

/// One step: F_x = (x - x_n)/h - v, F_v = M (v - v_n)/h - f(x), both to fall by rtol; Newton starts from (x_n, v_n).
template <class Solver>
void step(const Cube& cube, Tangent& tangent, Solver& solver, double h, double rtol, Vector& x, Vector& v, Counts& counts) {
  const Vector x0 = x, v0 = v;
  Vector f(x.size());
  double first = 0;
  for (int it = 0; it < 20; ++it) {
    forces(cube, x.data(), f.data());
    const Vector Fx = (x - x0) / h - v;
    const Vector Fv = cube.mass / h * (v - v0) - f;
    if (it == 0) first = Fv.norm();
    if (it > 0 && Fv.norm() <= rtol * first && Fx.norm() <= rtol * v0.norm()) return;
    ++counts.newton;
    // S dv = -F_v + h K F_x,  dx = h (dv - F_x)
    tangent.fill(x, h);
    const Vector right = tangent.S * Fx - cube.mass / h * Fx - Fv;
    solver.factorize(tangent.S);
    if (solver.info() != Eigen::Success) break;
    const Vector dv = solver.solve(right);
    counts.krylov += static_cast<int>(solver.iterations());
    v += dv;
    x += h * (dv - Fx);
  }
  counts.converged = false;
}

template <class Solver>
int run(const peers::Arguments& given, const Cube& cube) {
  Tangent tangent(cube);
  Solver solver;
  solver.setTolerance(given["linear"]);
  solver.setMaxIterations(20000);
  Vector x = Eigen::Map<const Vector>(cube.x.data(), static_cast<Eigen::Index>(cube.x.size()));
  Vector v = Eigen::Map<const Vector>(cube.v.data(), static_cast<Eigen::Index>(cube.v.size()));
  tangent.fill(x, given["h"]);
  solver.analyzePattern(tangent.S);
  Counts counts;
  Values seconds;
  const double start = peers::now();
  for (int k = 0; k < given.whole("steps") && counts.converged && peers::now() - start < given["limit"]; ++k) {
    const double before = peers::now();
    step(cube, tangent, solver, given["h"], given["rtol"], x, v, counts);
    seconds.push_back(peers::now() - before);
  }
  peers::print_json({{"s_per_step", peers::median(seconds)},
                     {"steps", static_cast<double>(seconds.size())},
                     {"newton", static_cast<double>(counts.newton)},
                     {"krylov", static_cast<double>(counts.krylov)},
                     {"converged", counts.converged}},
                    x.data() + x.size() - 3);
  return 0;
}

int main(int argc, char** argv) {
  const peers::Arguments given(argc, argv,
                               {{"n", 12}, {"h", 0.01}, {"steps", 5}, {"stiff", 0}, {"ic", 0}, {"rtol", 1e-6}, {"linear", 1e-4}, {"limit", 1e9}});
  const Cube cube = peers::make_cube(given.whole("n"), given["stiff"] != 0);
  constexpr int BOTH = Eigen::Lower | Eigen::Upper;
  if (given["ic"] != 0) return run<Eigen::ConjugateGradient<Matrix, BOTH, Eigen::IncompleteCholesky<double>>>(given, cube);
  return run<Eigen::ConjugateGradient<Matrix, BOTH>>(given, cube);
}
