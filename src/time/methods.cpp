#include "time/methods.hpp"
#include <strings.h>
#include <cstring>
#include <string>
#include "base/option_names.hpp"
#include "linalg/condensed/condensed.hpp"
#include "time/own_type.hpp"

namespace bs {

namespace {

constexpr auto EXPLICIT = Method::Kind::explicit_, IMPLICIT = Method::Kind::implicit;
constexpr auto MOMENTUM = Form::momentum, VELOCITY = Form::velocity;
// Runge-Kutta types of three and four stages bear that part of 2/omega along the imaginary axis at the least; those of two
// bear nothing without damping, but grow by (h omega)^4/8 a step only.
constexpr double SOME = 0.85;

//                       name      kind      memory         option of the subtype  affine second-order oscillation damping
constexpr TypeTraits BEULER{"beuler", IMPLICIT, Memory::theta, "", true, false, 0, 0};
constexpr TypeTraits CN{"cn", IMPLICIT, Memory::theta, "", true, false, 0, 0};
constexpr TypeTraits THETA{"theta", IMPLICIT, Memory::theta, "", true, false, 0, 0};
constexpr TypeTraits BDF{"bdf", IMPLICIT, Memory::bdf, "-ts_bdf_order", true, false, 0, 0};
constexpr TypeTraits ALPHA2{"alpha2", IMPLICIT, Memory::acceleration, "", false, true, 0, 0};
constexpr TypeTraits ROSW{"rosw", IMPLICIT, Memory::none, "-ts_rosw_type", false, false, 0, 0};
constexpr TypeTraits ARKIMEX{"arkimex", IMPLICIT, Memory::none, "-ts_arkimex_type", false, false, 0, 0};
constexpr TypeTraits SYMPLECTIC{"symplectic", EXPLICIT, Memory::none, "", false, true, 1, 2};
constexpr TypeTraits VERLET{"verlet", EXPLICIT, Memory::acceleration, "", false, true, 1, 4};
constexpr TypeTraits EULER{"euler", EXPLICIT, Memory::none, "", false, false, 0, 0};
constexpr TypeTraits RK{"rk", EXPLICIT, Memory::none, "-ts_rk_type", false, false, SOME, 0};
constexpr TypeTraits SSP{"ssp", EXPLICIT, Memory::none, "-ts_ssp_type", false, false, SOME, 0};

constexpr const char* EXTRAPOLATED = "its first steps by extrapolated backward Euler";
constexpr const char* LOOKS_BACK = "not where F depends on time";  // a stage at t - 2 h: refused

// Types with an explicit stage read F as y' - G: they need the velocity form, F divided by M or C, which a singular C
// does not allow. The estimates of ra3pw and lassp3p4s2c are 0 where F is linear, which makes them none.
constexpr Method METHODS[] = {
    // type  subtype   form  order descriptor estimate remark
    {&BEULER, "", MOMENTUM, 1, 1, true, ""},
    {&CN, "", MOMENTUM, 2, 2, true, ""},
    {&THETA, "", MOMENTUM, 2, 2, true, ""},
    {&BDF, "1", MOMENTUM, 1, 1, true, ""},
    {&BDF, "2", MOMENTUM, 2, 2, true, ""},
    {&BDF, "3", MOMENTUM, 3, 3, true, EXTRAPOLATED},
    {&BDF, "4", MOMENTUM, 4, 4, true, EXTRAPOLATED},
    {&BDF, "5", MOMENTUM, 5, 5, true, EXTRAPOLATED},
    {&BDF, "6", MOMENTUM, 6, 6, true, EXTRAPOLATED},
    {&ALPHA2, "", MOMENTUM, 2, 0, false, ""},
    {&ROSW, "theta1", MOMENTUM, 1, 1, false, ""},
    {&ROSW, "theta2", MOMENTUM, 2, 2, false, ""},
    {&ROSW, "2m", MOMENTUM, 2, 2, true, ""},
    {&ROSW, "2p", MOMENTUM, 2, 2, true, ""},
    {&ROSW, "ra3pw", MOMENTUM, 3, 3, false, ""},
    {&ROSW, "ra34pw2", MOMENTUM, 3, 3, true, ""},
    {&ROSW, "rodas3", MOMENTUM, 3, 3, true, ""},
    {&ROSW, "sandu3", MOMENTUM, 3, 3, true, ""},
    {&ROSW, "assp3p3s1c", VELOCITY, 3, 0, true, ""},
    {&ROSW, "lassp3p4s2c", VELOCITY, 3, 0, false, ""},
    {&ROSW, "llssp3p4s2c", VELOCITY, 3, 0, true, ""},
    {&ROSW, "ark3", VELOCITY, 3, 0, true, ""},
    {&ROSW, "grk4t", MOMENTUM, 4, 4, true, LOOKS_BACK},
    {&ROSW, "shamp4", MOMENTUM, 4, 4, true, LOOKS_BACK},
    {&ROSW, "veldd4", MOMENTUM, 4, 4, true, LOOKS_BACK},
    {&ROSW, "4l", MOMENTUM, 4, 4, true, LOOKS_BACK},
    {&ARKIMEX, "1bee", MOMENTUM, 1, 1, true, "backward Euler over half steps"},
    {&ARKIMEX, "l2", MOMENTUM, 2, 2, true, ""},
    {&ARKIMEX, "prssp2", MOMENTUM, 2, 2, false, ""},
    {&ARKIMEX, "a2", VELOCITY, 2, 0, true, ""},
    {&ARKIMEX, "ars122", VELOCITY, 2, 0, true, ""},
    {&ARKIMEX, "2c", VELOCITY, 2, 0, true, ""},
    {&ARKIMEX, "2d", VELOCITY, 2, 0, true, ""},
    {&ARKIMEX, "2e", VELOCITY, 2, 0, true, ""},
    {&ARKIMEX, "3", VELOCITY, 3, 0, true, ""},
    {&ARKIMEX, "bpr3", VELOCITY, 3, 0, false, ""},
    {&ARKIMEX, "ars443", VELOCITY, 3, 0, false, ""},
    {&ARKIMEX, "4", VELOCITY, 4, 0, true, ""},
    {&ARKIMEX, "5", VELOCITY, 5, 0, true, ""},
    {&SYMPLECTIC, "", VELOCITY, 1, 0, false, ""},
    {&VERLET, "", VELOCITY, 2, 0, false, ""},
    {&EULER, "", VELOCITY, 1, 0, false, ""},
    {&RK, "1fe", VELOCITY, 1, 0, false, ""},
    {&RK, "2a", VELOCITY, 2, 0, true, ""},
    {&RK, "2b", VELOCITY, 2, 0, false, ""},
    {&RK, "3", VELOCITY, 3, 0, false, ""},
    {&RK, "3bs", VELOCITY, 3, 0, true, ""},
    {&RK, "4", VELOCITY, 4, 0, false, ""},
    {&RK, "5f", VELOCITY, 5, 0, true, ""},
    {&RK, "5dp", VELOCITY, 5, 0, true, ""},
    {&RK, "5bs", VELOCITY, 5, 0, true, ""},
    {&RK, "6vr", VELOCITY, 6, 0, true, ""},
    {&RK, "7vr", VELOCITY, 7, 0, true, ""},
    {&RK, "8vr", VELOCITY, 8, 0, true, ""},
    {&SSP, "rks2", VELOCITY, 2, 0, false, ""},
    {&SSP, "rks3", VELOCITY, 3, 0, false, ""},
    {&SSP, "rk104", VELOCITY, 4, 0, false, ""},
};

struct Refusal {
  const char *type, *reason, *instead;
};

constexpr const char* NOT_BUILT = "is not part of this PETSc";

// The types of PETSc that are not in the table, and what keeps each out.
constexpr Refusal REFUSED[] = {
    {"alpha", "starts with twice the rate of change, which leaves order 1", "alpha2 for particles, cn or bdf for linear systems"},
    {"basicsymplectic", "splits the state into two vectors and gives the forces no velocity, which drag and dampers need", "symplectic or verlet"},
    {"dirk", "starts each step from the slope at the end of the one before, which no checkpoint has", "arkimex or bdf"},
    {"discgrad", "needs the motion as y' = S(y) grad H(y), which drag, dampers and driven anchors do not allow, and sets up S for one rank only",
     "cn"},
    {"eimex", "continues after a failed solve, with a step of another length", "bdf or rosw"},
    {"glee", "treats every attempt as a new step, and keeps a second solution that no checkpoint can hold", "rk"},
    {"glle", "chooses steps and orders itself, past output times, and accepts failed solves", "bdf"},
    {"irk", "accepts the result of a step without checking that Newton converged", "rosw or arkimex"},
    {"mimex", "needs fields of a PetscDS, some implicit and some explicit, which a lattice does not have", "arkimex"},
    {"mprk", "needs the state split into parts with separate fast and slow forces", "rk"},
    {"pseudo", "chooses its steps by the decrease of the residual toward a steady state, so that its times have no meaning", "beuler with drag"},
    {"python", "runs a Python script inside the program, which is built without Python", "another type"},
    {"radau5", NOT_BUILT, "bdf or rosw"},
    {"sundials", NOT_BUILT, "bdf"},
};

/// The subtype `ts` has without an option.
PetscErrorCode own_subtype(TS ts, const std::string& type, std::string* out) {
  const char* name = "";
  PetscFunctionBegin;
  if (type == TSROSW) PetscCall(TSRosWGetType(ts, &name));
  if (type == TSARKIMEX) PetscCall(TSARKIMEXGetType(ts, &name));
  if (type == TSRK) PetscCall(TSRKGetType(ts, &name));
  if (type == TSSSP) PetscCall(TSSSPGetType(ts, &name));
  *out = name;
  if (type == TSBDF) {
    PetscInt order;
    PetscCall(TSBDFGetOrder(ts, &order));
    *out = std::to_string(order);
  }
  PetscFunctionReturn(0);
}

const TypeTraits* traits_of(const std::string& type) {
  for (const Method& method : METHODS)
    if (method.is(type.c_str())) return method.traits;
  return nullptr;
}

/// The row of a type and subtype. PETSc takes the names of subtypes in any case.
const Method* find(const std::string& type, const std::string& subtype) {
  for (const Method& method : METHODS)
    if (method.is(type.c_str()) && strcasecmp(method.subtype, subtype.c_str()) == 0) return &method;
  return nullptr;
}

}  // namespace

bool Method::is(const char* type) const { return std::strcmp(traits->name, type) == 0; }

std::string Method::words() const { return std::string("-ts_type ") + type() + (*subtype ? std::string(" ") + traits->option + " " + subtype : ""); }

PetscErrorCode asked_method(TS ts, const char* type, const Method** out) {
  const char* option = subtype_option(type);
  std::string subtype;
  PetscFunctionBegin;
  PetscCall(own_subtype(ts, type, &subtype));
  const std::string given = *option ? value_of(option) : "";
  *out = find(type, given.empty() ? subtype : given);
  PetscFunctionReturn(0);
}

PetscErrorCode method_of(TS ts, const Method** out) {
  TSType type;
  std::string subtype;
  PetscFunctionBegin;
  PetscCall(TSGetType(ts, &type));
  PetscCall(own_subtype(ts, type, &subtype));
  *out = find(type, subtype);
  PetscCheck(*out, PETSC_COMM_SELF, PETSC_ERR_PLIB, "no row for %s %s", type, subtype.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode theta_of(TS ts, PetscReal* theta) {
  const Method* method;
  PetscFunctionBegin;
  *theta = 1;
  PetscCall(method_of(ts, &method));
  if (method->remembers(Memory::theta)) PetscCall(TSThetaGetTheta(ts, theta));
  if (method->traits == &ALPHA2) *theta = alpha2_parameters(ts).beta / alpha2_parameters(ts).gamma;
  PetscFunctionReturn(0);
}

PetscErrorCode observed_order(TS ts, const Method& method, PetscInt* order) {
  PetscReal theta;
  PetscFunctionBegin;
  PetscCall(theta_of(ts, &theta));
  *order = !method.remembers(Memory::theta) || theta == 0.5 ? method.order : 1;
  PetscFunctionReturn(0);
}

const char* subtype_option(const std::string& type) {
  const TypeTraits* traits = traits_of(type);
  return traits ? traits->option : "";
}

std::string fault_of_type(const std::string& type) {
  if (traits_of(type)) return {};
  for (const Refusal& refusal : REFUSED)
    if (type == refusal.type) return "-ts_type " + type + " " + refusal.reason + ": use " + refusal.instead;
  return "-ts_type " + type + " is not one this program knows: use " + types_of(IMPLICIT) + " (implicit) or " + types_of(EXPLICIT) + " (explicit)";
}

std::string types_of(Method::Kind kind) {
  std::string list;
  const TypeTraits* last = nullptr;
  for (const Method& method : METHODS) {
    if (method.traits->kind != kind || last == method.traits) continue;
    last = method.traits;
    list += (list.empty() ? "" : ", ") + std::string(last->name);
  }
  return list;
}

PetscErrorCode is_adaptive(TS ts, bool* yes) {
  TSAdapt adapt;
  TSAdaptType type = nullptr;
  PetscFunctionBegin;
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptGetType(adapt, &type));
  *yes = type && std::string(type) != TSADAPTNONE;
  PetscFunctionReturn(0);
}

PetscErrorCode linear_solver_of(TS ts, KSP* ksp, PC* pc) {
  SNES snes;
  KSP found;
  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetKSP(snes, &found));
  if (ksp) *ksp = found;
  if (pc) PetscCall(KSPGetPC(found, pc));
  PetscFunctionReturn(0);
}

PetscErrorCode krylov_iterations(TS ts, bool implicit, PetscInt* count) {
  PC pc;
  CondensedCounts inner;
  bool condensed = false;
  PetscFunctionBegin;
  PetscCall(TSGetKSPIterations(ts, count));
  if (!implicit) PetscFunctionReturn(0);
  PetscCall(linear_solver_of(ts, nullptr, &pc));
  PetscCall(condensed_counts(pc, &condensed, &inner));
  if (condensed) *count = inner.iterations;
  PetscFunctionReturn(0);
}

}  // namespace bs
