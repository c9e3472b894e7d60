// What the tests of force laws share: random states, and derivatives by differences to check the exact ones against.
#pragma once
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "physics/body/law.hpp"

namespace law_tests {

/// Random numbers, the same in every run.
class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  double normal() { return std::normal_distribution<double>()(engine_); }
  /// A vector of length `length`, its direction uniform; both signs for d = 1.
  template <int d>
  void direction(double length, double* v) {
    double square = 0;
    do {
      square = 0;
      for (int i = 0; i < d; ++i) {
        v[i] = normal();
        square += v[i] * v[i];
      }
    } while (square < 1e-6);
    for (int i = 0; i < d; ++i) v[i] *= length / std::sqrt(square);
  }

 private:
  std::mt19937_64 engine_;
};

/// A lattice has every column of the list, in its order.
inline const bs::ColumnPlaces& all_columns() {
  static const bs::ColumnPlaces places = [] {
    bs::ColumnPlaces all{};
    for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
    return all;
  }();
  return places;
}
/// A lattice has radii alone.
inline const bs::ColumnPlaces& radius_alone() {
  static const bs::ColumnPlaces places = [] {
    bs::ColumnPlaces one = bs::no_columns;
    one[bs::particle_parameter("radius")] = 0;
    return one;
  }();
  return places;
}

/// Random particle: |v| from 0.2 to 3, x anywhere within `box` of the origin.
template <int d>
struct State {
  double x[d] = {}, v[d] = {}, m, a;
  std::array<double, std::size(bs::particle_parameters)> own{};  ///< its other numbers; the radius is `a`
  State(Dice& dice, double box) : m(dice.between(0.1, 5)), a(dice.between(0.01, 0.2)) {
    for (double& c : x) c = dice.between(-box, box);
    dice.direction<d>(dice.between(0.2, 3), v);
    for (double& number : own) number = 0.1 + std::abs(x[0]);
    own[bs::particle_parameter("radius")] = a;
  }
  bs::Point<d> point() const { return {0.25, m, {own.data(), &all_columns()}, x, v}; }
};

/// df/dz_j by central differences of fourth order: (8 (f(+h) - f(-h)) - (f(+2h) - f(-2h)))/(12 h).
/// `f(out)` evaluates `rows` numbers at the present z; `J` is rows x columns, row-major.
template <class F>
std::vector<double> differences(double* z, int columns, int rows, double h, F&& f) {
  std::vector<double> J(static_cast<std::size_t>(rows * columns)), out(static_cast<std::size_t>(rows));
  for (int j = 0; j < columns; ++j) {
    const double z0 = z[j];
    for (const auto& [step, weight] : {std::pair{1, 8.0}, {-1, -8.0}, {2, -1.0}, {-2, 1.0}}) {
      z[j] = z0 + step * h;
      std::fill(out.begin(), out.end(), 0.0);
      f(out.data());
      for (int i = 0; i < rows; ++i) J[static_cast<std::size_t>(i * columns + j)] += weight * out[i] / (12 * h);
    }
    z[j] = z0;
  }
  return J;
}

inline double largest(const double* a, std::size_t n) {
  double most = 0;
  for (std::size_t i = 0; i < n; ++i) most = std::max(most, std::abs(a[i]));
  return most;
}

/// Every entry agrees to `tolerance` times the larger of the largest entry and `scale`.
inline void require_close(const double* found, const std::vector<double>& wanted, double tolerance, double scale = 0) {
  const double size = std::max(scale, largest(wanted.data(), wanted.size()));
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    INFO("entry " << i << ": found " << found[i] << ", wanted " << wanted[i] << ", size " << size);
    REQUIRE(std::abs(found[i] - wanted[i]) <= tolerance * size);
  }
}

/// At one state: df/dx and df/dv against differences of the force, all three adding to what is there, and, if
/// `conservative`, the force against differences of the energy. h: step for x and v.
template <int d, class Law>
void check_law(const Law& law, State<d> s, bool conservative, double h = 1e-3, double tolerance = 1e-9) {
  const auto force = [&](double* f) { REQUIRE(law.template force<d>(s.point(), f)); };
  double f[d] = {}, more[d];
  force(f);
  for (double& c : more) c = 3;
  force(more);
  for (int i = 0; i < d; ++i) REQUIRE(more[i] - 3 == Approx(f[i]).epsilon(1e-12).margin(1e-14));
  double K[d * d] = {}, D[d * d] = {};
  law.template dfdx<d>(s.point(), K);
  law.template dfdv<d>(s.point(), D);
  const double size = largest(f, d);
  require_close(K, differences(s.x, d, d, h, force), tolerance, size);
  require_close(D, differences(s.v, d, d, h, force), tolerance, size);
  law.template dfdx<d>(s.point(), K);
  law.template dfdv<d>(s.point(), D);
  for (double& k : K) k /= 2;
  for (double& k : D) k /= 2;
  require_close(K, differences(s.x, d, d, h, force), tolerance, size);
  require_close(D, differences(s.v, d, d, h, force), tolerance, size);
  const auto energy = [&](double* e) { *e = -law.template energy<d>(s.point()); };
  // differences of a large energy round: 1e-2 E times the tolerance is some 10 eps E/h
  const double E = std::abs(law.template energy<d>(s.point()));
  if (conservative) require_close(f, differences(s.x, d, 1, h, energy), tolerance, 1e-2 * E);
  if (!conservative) REQUIRE(law.template energy<d>(s.point()) == 0);
}

/// The numbers of a CSV file of the oracles, row by row; empty where the folder is absent (a test then says so).
inline std::vector<std::vector<double>> oracle(const std::string& file) {
  std::ifstream in(std::string(BS_SOURCE_DIR) + "/../shared/oracles/" + file);
  std::vector<std::vector<double>> rows;
  std::string line, word;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream words(line);
    rows.emplace_back();
    while (std::getline(words, word, ',')) rows.back().push_back(std::stod(word));
  }
  return rows;
}

}  // namespace law_tests
