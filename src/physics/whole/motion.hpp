// Motion of the points that anchors (springs to given points) are tied to.
#pragma once
#include <algorithm>
#include <string>
#include "base/text.hpp"
#include "physics/body/law.hpp"
#include "physics/whole/drive.hpp"

namespace bs {

/// Every anchor point moves alike: at time t it is at the lattice's anchor point + s(t), with velocity s'(t).
///   fixed:     s = 0
///   velocity:  s = c t
///   sinusoid:  s = A sin(2 pi f t + phase)
///   table:     s linear in t between the rows of a table, equal to them at their times
/// s(0) need not be 0: with a phase or a table the run starts from displaced anchor points, while a rest length that is
/// to be "the initial distance" is that from the lattice's anchor point. A phase of 0 starts from s = 0.
struct Motion {
  enum class Kind { fixed, velocity, sinusoid, table };
  static constexpr const char* title = "motion of anchor points";
  Kind kind = Kind::fixed;
  double c[3] = {0, 0, 0};    ///< velocity [m/s]
  double A[3] = {0, 0, 0};    ///< amplitude [m]
  double frequency = 0;       ///< f [Hz]
  double phase = 0;           ///< [rad]
  int components = 1;         ///< how many of c or A were given
  bool at_rest = false;       ///< statics: displacements as at t, velocities 0
  bool at_full_load = false;  ///< statics that does not scale them: displacements as at t = 1, whatever t is
  std::string table_file;
  Drive drive;  ///< s(t), of what starts at 0: to be made of text()

  template <class V>
  void options(V& o);
  bool active() const noexcept { return kind != Kind::fixed; }
  std::string describe() const;

  /// What Drive::parse reads in `dim` dimensions; not of Kind::fixed.
  std::string text(int dim) const;
  /// s(t) and s'(t), three numbers each (Drive::at).
  void at(double t, double* s, double* ds) const {
    const double zero[3] = {0, 0, 0};
    double a[3];
    std::fill_n(s, 3, 0.0);
    std::fill_n(ds, 3, 0.0);
    drive.at(at_full_load ? 1.0 : t, zero, s, ds, a);
    if (at_rest) std::fill_n(ds, 3, 0.0);
  }
};

inline std::string Motion::text(int dim) const {
  if (kind == Kind::table) return "table:" + table_file;
  std::string all;
  for (int i = 0; i < dim; ++i) {
    all += std::string(i ? "," : "") + static_cast<char>('x' + i);
    if (kind == Kind::velocity) all += "=velocity:" + plain_number(c[i]);
    else all += "=sinusoid:" + plain_number(A[i]) + "," + plain_number(frequency) + "," + plain_number(phase);
  }
  return all;
}

inline std::string Motion::describe() const {
  if (kind == Kind::velocity) return "anchor points move at " + vector_text(c, components) + " m/s";
  if (kind == Kind::sinusoid)
    return "anchor points oscillate by " + vector_text(A, components) + " m at " + short_number(frequency) + " Hz, phase " + short_number(phase) +
           " rad";
  if (kind == Kind::table) return "anchor points move as in " + table_file;
  return "anchor points fixed";
}

template <class V>
void Motion::options(V& o) {
  using R = RangeOf<V>;
  int index = static_cast<int>(kind);
  const bool said =
      o.choice("-bs_anchor_motion", "how anchor points move from their positions in the lattice", {"fixed", "velocity", "sinusoid", "table"}, index);
  kind = static_cast<Kind>(index);
  int of_c = components, of_A = components;
  const bool rate = read_vector(o, "-bs_anchor_velocity", "anchor motion velocity: components x[,y[,z]] [m/s]", c, of_c);
  const bool width =
      read_vector(o, "-bs_anchor_amplitude", "anchor motion sinusoid: amplitude A, x[,y[,z]], of A sin(2 pi f t + phase) [m]", A, of_A);
  const bool pace = o.real("-bs_anchor_frequency", "anchor motion sinusoid: frequency f, >= 0 [Hz]", frequency, R::nonnegative);
  const bool angle = o.real("-bs_anchor_phase", "anchor motion sinusoid: phase; with 0 the motion starts at zero displacement [rad]", phase);
  const bool file =
      o.text("-bs_anchor_table", "anchor motion table: CSV file with a time and a displacement in each row, t,x[,y[,z]] [s, m]", table_file);
  components = kind == Kind::velocity ? of_c : of_A;
  if (rate) require(o, said, "-bs_anchor_velocity", "-bs_anchor_motion velocity");
  if (width) require(o, said, "-bs_anchor_amplitude", "-bs_anchor_motion sinusoid");
  if (pace) require(o, said, "-bs_anchor_frequency", "-bs_anchor_motion sinusoid");
  if (angle) require(o, said, "-bs_anchor_phase", "-bs_anchor_motion sinusoid");
  if (file) require(o, said, "-bs_anchor_table", "-bs_anchor_motion table");
  if (kind == Kind::velocity) require(o, rate, "-bs_anchor_motion velocity", "-bs_anchor_velocity [m/s]");
  if (kind == Kind::sinusoid) require(o, width, "-bs_anchor_motion sinusoid", "-bs_anchor_amplitude [m]");
  if (kind == Kind::sinusoid) require(o, pace, "-bs_anchor_motion sinusoid", "-bs_anchor_frequency [Hz]");
  if (kind == Kind::table) require(o, file, "-bs_anchor_motion table", "-bs_anchor_table, a CSV file");
}

}  // namespace bs
