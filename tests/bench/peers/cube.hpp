// The benchmark's lattice for the peers, and the plain loop over its springs.
#pragma once
#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace peers {

using Values = std::vector<double>;

/// B1 (stiff = false) or B2 (true) at n^3 particles: strain springs of K = 250 N on 18 neighbours.
struct Cube {
  int n = 0;
  std::size_t particles = 0;
  double mass = 0;        ///< of each particle [kg]
  std::vector<int> i, j;  ///< ends of each spring
  Values K, L;            ///< [N], rest length [m]
  std::vector<std::uint8_t> fixed;
  Values x, v;  ///< (particles, 3) at the start
};

constexpr double GRAVITY = -9.81;  // along z [m/s^2]

Cube make_cube(int n, bool stiff);

/// f = sum of K (l/L - 1) along the springs + m g; 0 on fixed particles.
void forces(const Cube& cube, const double* x, double* f);

/// Command line "--name value ...": numbers by name, with defaults.
class Arguments {
 public:
  Arguments(int argc, char** argv, std::map<std::string, double> defaults);
  double operator[](const std::string& name) const { return values_.at(name); }
  int whole(const std::string& name) const { return static_cast<int>(values_.at(name)); }

 private:
  std::map<std::string, double> values_;
};

/// Seconds since some moment.
inline double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double median(Values values);

/// One line of JSON on stdout: the figures, then "last": position of the last particle.
void print_json(const std::vector<std::pair<std::string, double>>& figures, const double* last);

}  // namespace peers
