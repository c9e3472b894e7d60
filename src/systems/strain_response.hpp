// What a homogeneous strain of a periodic box does to a mechanical system at one state.
#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace bs {

/// For each of the q = d(d+1)/2 strains e_a (xx; xx, yy, xy; xx, yy, zz, yz, xz, xy, engineering shears) that carry all particles and their
/// images along, x -> (I + e) x.
struct StrainResponse {
  int count = 0;               ///< q; 0: the system has no periodic box
  double volume = 0;           ///< of the box
  std::vector<double> force;   ///< (q, n, d): d f_i/d e_a of the owned particles [N]
  std::vector<double> affine;  ///< (q, q): d2 E/(d e_a d e_b), of all ranks [J]
  std::vector<double> size;    ///< (q): root of the sum of squares of what single springs add to the force, of all ranks [N]
  std::vector<double> stress;  ///< (q): dE/d e_a / volume, of all ranks
  double gradient[9] = {0};    ///< F of the box, (d, d) row by row
  std::string held;            ///< what keeps particles from following; empty: nothing does
};

/// A component of the strain F - I of a periodic box that is free under a given stress.
struct FreeStrain {
  int row = 0, column = 0;
  double strain = 0;  ///< now
  double stress = 0;  ///< given, component (row, column) [N/m^(d-1)]
};

/// "xy" of (0, 1).
inline std::string component_name(int row, int column) { return {static_cast<char>('x' + row), static_cast<char>('x' + column)}; }

/// Place of the component (row, column) of a symmetric tensor among xx; xx, yy, xy; or xx, yy, zz, yz, xz, xy.
inline int component_place(int d, int row, int column) { return row == column ? row : d == 2 ? 2 : 6 - row - column; }

/// Their names in that order.
inline std::vector<std::string> component_names(int d) {
  std::vector<std::string> names(static_cast<std::size_t>(d * (d + 1) / 2));
  for (int r = 0; r < d; ++r)
    for (int c = r; c < d; ++c) names[static_cast<std::size_t>(component_place(d, r, c))] = component_name(r, c);
  return names;
}

/// What is missing to given stresses is measured by the largest of them, or, where all are 0, by the largest there is: a component that is held may
/// be large beyond all measure in a box that has given way.
inline double stress_measure(const StrainResponse& at, const std::vector<FreeStrain>& free) {
  double given = 0, largest = 0;
  for (const FreeStrain& one : free) given = std::max(given, std::abs(one.stress));
  for (const double stress : at.stress) largest = std::max(largest, std::abs(stress));
  return given > 0 ? given : largest;
}

/// The largest stiffness of the box along its free strains, the particles carried along.
inline double stiffness_along(const StrainResponse& at, const std::vector<FreeStrain>& free, int d) {
  double largest = 0;
  for (const FreeStrain& one : free)
    largest = std::max(largest, std::abs(at.affine[static_cast<std::size_t>(component_place(d, one.row, one.column) * (at.count + 1))]) / at.volume);
  return largest;
}

/// Strain a of dimension d as a symmetric matrix, row by row.
inline void unit_strain(int d, int a, double* e) {
  for (int k = 0; k < d * d; ++k) e[k] = 0;
  if (a < d) {
    e[a * (d + 1)] = 1;
    return;
  }
  const int k = d == 2 ? 2 : a - d, r = (k + 1) % 3, c = (k + 2) % 3;  // yz, xz, xy
  e[r * d + c] = e[c * d + r] = 0.5;
}

/// The same components of a symmetric tensor (d, d), divided by `volume`: e_a : T / V.
inline std::vector<double> stress_components(int d, const double* tensor, double volume) {
  std::vector<double> out;
  double e[9];
  for (int a = 0; a < d * (d + 1) / 2; ++a) {
    double sum = 0;
    unit_strain(d, a, e);
    for (int k = 0; k < d * d; ++k) sum += e[k] * tensor[k];
    out.push_back(sum / volume);
  }
  return out;
}

}  // namespace bs
