// Motion of a group of particles that is given, not computed.
#pragma once
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "base/knots.hpp"
#include "lattice/csv_table.hpp"
#include "physics/whole/expression.hpp"

namespace bs {

/// Where the held components of a particle are that starts at x0, how fast they move, and with what acceleration. As a whole:
///   fixed                             X = x0
///   velocity:VX,VY,VZ                 X = x0 + V t
///   rotation:W,CX,CY                  about a point of the plane, W in rad/s; in space rotation:W,CX,CY,CZ,AX,AY,AZ, about the axis A through C
///   table:FILE                        X = x0 + s(t), rows t,x,y,z of a CSV file, linear between them
///   given                             what a program on the library says: here at x0, at rest
/// or component by component, x=...,y=...,z=...; those left out are free:
///   free                              not held
///   fixed, given, velocity:V, table:FILE   as above, for one component (rows t,s)
///   sinusoid:A,F[,PHASE]              X = x0 + A sin(2 pi F t + PHASE)
///   expression:TEXT                   X = x0 + u(t, x0, y0, z0)
class Drive {
 public:
  enum class Kind { free, fixed, velocity, sinusoid, table, expression, given };

  /// False, and one line in `error` without the option's name, for a text in d = `dim` dimensions that is none of these. `placed`: expressions may
  /// depend on the initial position.
  bool parse(const std::string& text, int dim, std::string* error, bool placed = true);
  /// Tables that are to be read and handed to set_table, in this order: file and number of columns beside the time.
  const std::vector<std::pair<std::string, int>>& tables() const { return tables_; }
  /// False, and one line in `error`, for a table that cannot be followed.
  bool set_table(std::size_t k, const CsvTable& table, std::string* error);

  /// Bit c: component c is held.
  std::uint8_t held() const { return held_; }
  /// Bit c: component c moves.
  std::uint8_t moving() const { return moving_; }
  /// Bit c: component c is where a program on the library says.
  std::uint8_t given() const { return given_; }
  /// The held components of position [m], velocity [m/s] and acceleration [m/s^2] at time t; the others are left alone. x0: `dim` numbers. At a
  /// row of a table the slope to its right, unless set_sides() says otherwise, beyond its ends at rest.
  void at(double t, const double* x0, double* x, double* v, double* a) const;
  /// The displacements alone, of what is given component by component, without what x0 rounds off them; the others are left alone.
  void displacement(double t, const double* x0, double* u) const;
  /// From now on what jumps or bends has these sides, in place of those to the right.
  void set_sides(const Sides& sides) { sides_ = sides; }
  /// The first time in (from, to] at which a row of a table stands, or an expression has a knot.
  Knot next_knot(double from, double to) const;
  /// Why tables do not serve a run that ends at t, in words that follow "the table of ..."; empty: they do, but for rounding.
  std::string misses(double t) const;
  /// A time in (from, to] at which what starts at x0 jumps, or grows beyond all bounds; NaN: none is seen. Every step asks for its own.
  double jump(double from, double to, const double* x0) const;
  /// Whether jump() can find anything; and whether where it starts matters to it.
  bool may_jump() const;
  bool jumps_by_place() const;
  const std::string& text() const { return text_; }

 private:
  struct Component {
    Kind kind = Kind::free;
    double rate = 0, amplitude = 0, frequency = 0, phase = 0;
    std::vector<double> time, shift;  ///< of the table
    Expression expression;
  };
  bool parse_whole(const std::string& kind, const std::vector<double>& numbers, std::string* error);
  bool parse_component(const std::string& text, Component* out, std::string* error);
  bool parse_rotation(const std::vector<double>& n, std::string* error);
  void note_held();
  void rotate(double t, const double* x0, double* x, double* v, double* a) const;
  void follow(const Component& one, double t, const double* x0, double* s) const;

  std::string text_;
  int dim_ = 3;
  bool placed_ = true;
  Sides sides_;
  std::uint8_t held_ = 0, moving_ = 0, given_ = 0;
  bool rotation_ = false;
  double omega_ = 0, center_[3] = {0, 0, 0}, axis_[3] = {0, 0, 1};
  Component component_[3];
  std::vector<std::pair<std::string, int>> tables_;
  std::vector<int> table_of_;  ///< component of each table; -1: all
};

}  // namespace bs
