// The table of time-stepping methods, those of PETSc and the program's own: one row per type, and one per type and subtype; what else is asked
// of a TS; the program's own types.
#pragma once
#include <petscts.h>
#include <string>
#include "systems/model.hpp"

namespace bs {

/// What a type carries from step to step beside the state.
enum class Memory {
  none,
  theta,        ///< the state before the last, from which it estimates its error
  bdf,          ///< as many states as its order
  acceleration  ///< x'', or its approximation
};

/// What all subtypes of a type have in common.
struct TypeTraits {
  /// Whether F is solved for: an explicit type evaluates y' = G(t, y).
  enum class Kind { explicit_, implicit };
  const char* name;  ///< -ts_type
  Kind kind;
  Memory memory;
  const char* option;  ///< that names a subtype; "": there is none
  bool affine;         ///< every solve is for F(t, y, sigma y + c) = b at the end of a step or stage, in momentum form
  bool second_order;   ///< needs positions and velocities
  double oscillation;  ///< explicit types: largest h omega on x'' = -omega^2 x, of that of symplectic (2)
  double damping;      ///< explicit types of second order: k in (h omega)^2 + k h c < 4 on x'' = -omega^2 x - c x'
};

struct Method {
  using Kind = TypeTraits::Kind;
  const TypeTraits* traits;
  const char* subtype;  ///< -ts_rk_type, -ts_ssp_type, -ts_arkimex_type, -ts_rosw_type, -ts_bdf_order; "": there is none
  Form form;            ///< how an implicit type must be given F
  int order;            ///< observed on particle systems, driven and not
  int descriptor;       ///< observed on systems G x + C x' = B u(t) with a singular C; 0: no such systems
  bool estimate;        ///< whether it estimates the error of its step: -ts_adapt_type works
  const char* remark;   ///< remark for the header; "": none
  const char* type() const { return traits->name; }
  bool implicit() const { return traits->kind == Kind::implicit; }
  bool remembers(Memory memory) const { return traits->memory == memory; }
  bool is(const char* type) const;
  /// "-ts_type rosw -ts_rosw_type ark3"
  std::string words() const;
};

/// The method the options ask for; null if the subtype is not in the table. `type` is that of `ts`, whose subtype is
/// looked up where no option names one.
PetscErrorCode asked_method(TS ts, const char* type, const Method** out);

/// The method `ts` is of: its row in the table.
PetscErrorCode method_of(TS ts, const Method** out);

/// 1/(sigma h) of the first matrix of a step of h: theta of the theta family, beta/gamma of alpha2, 1 of other types.
PetscErrorCode theta_of(TS ts, PetscReal* theta);

/// The order of `method` with the parameters `ts` has: theta is of order 1 but for theta = 1/2.
PetscErrorCode observed_order(TS ts, const Method& method, PetscInt* order);

/// Why the type cannot be taken, in one line that says what to write instead; empty if it can.
std::string fault_of_type(const std::string& type);

/// The option that names a type's subtype, "" if it has none.
const char* subtype_option(const std::string& type);

/// "beuler, cn, ...": the types of a kind, each once.
std::string types_of(Method::Kind kind);

/// The data of a TS whose type has Memory::acceleration begins with it.
struct KeptAcceleration {
  Vec kept = nullptr;  ///< (., a_n) at the present state, of the type; a failed step leaves its entries unchanged
  bool known = false;  ///< whether it is: not before the first step
};

/// Of a TS of such a type; borrowed.
PetscErrorCode kept_acceleration(TS ts, KeptAcceleration** out);

/// Whether steps follow an error estimate (-ts_adapt_type other than none).
PetscErrorCode is_adaptive(TS ts, bool* yes);

/// The linear solver of an implicit type and its preconditioner, both borrowed; either may be null.
PetscErrorCode linear_solver_of(TS ts, KSP* ksp, PC* pc);

/// Iterations on the linear systems so far; of a condensed solve those inside it.
PetscErrorCode krylov_iterations(TS ts, bool implicit, PetscInt* count);

/// Symplectic Euler: registers `-ts_type symplectic`, velocity first, then position with the new velocity. State blocks are (x, v) of 2d numbers,
/// RHSFunction is G = (v, M^-1 f); PETSc's own TSBASICSYMPLECTIC passes no velocity to the force, so drag and dampers need this one.
PetscErrorCode register_symplectic();

/// Velocity Verlet: registers `-ts_type verlet`, half a kick, a drift, the other half of the kick. State blocks are (x, v) of 2d numbers, RHSFunction
/// is G = (v, a), a = M^-1 f(t, x, v):
///   v_h = v_n + h/2 a_n,  x_{n+1} = x_n + h v_h,
///   a_{n+1} = M^-1 f(t_{n+1}, x_{n+1}, v_h + h/2 a_n),  v_{n+1} = v_h + h/2 a_{n+1}
/// One evaluation of the forces a step: a_{n+1} is kept for the next one. Without forces that depend on velocities it is
/// time-reversible and symplectic. With them, a_{n+1} is taken at the velocity v_n + h a_n, which is off by h^2 and makes an
/// error of h^3 in a step: order 2 either way. On x'' = -w^2 x - c x' it is stable while (h w)^2 + 4 h c < 4.
PetscErrorCode register_verlet();

}  // namespace bs
