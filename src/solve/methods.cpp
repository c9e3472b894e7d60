#include "solve/methods.hpp"
#include <strings.h>
#include <algorithm>
#include <array>
#include <string_view>

namespace bs {
namespace {

constexpr auto EXPLICIT = Method::Kind::explicit_, IMPLICIT = Method::Kind::implicit;
constexpr auto MOMENTUM = Form::momentum, VELOCITY = Form::velocity;

constexpr const char* BDF_START = "its first steps are of order 1 and 2";
constexpr const char* LOOKS_BACK = "not where F depends on time";  // a stage at t - 2 h: refused

// Types with an explicit stage read F as y' - G: they need the velocity form, F divided by M or C, which a singular C
// does not allow.
constexpr Method METHODS[] = {
    // type       subtype        kind      form      order descriptor estimate remark
    {"beuler", "", IMPLICIT, MOMENTUM, 1, 1, true, ""},
    {"cn", "", IMPLICIT, MOMENTUM, 2, 2, true, ""},
    {"theta", "", IMPLICIT, MOMENTUM, 2, 2, true, ""},
    {"bdf", "1", IMPLICIT, MOMENTUM, 1, 1, true, ""},
    {"bdf", "2", IMPLICIT, MOMENTUM, 2, 2, true, ""},
    {"bdf", "3", IMPLICIT, MOMENTUM, 2, 2, true, BDF_START},
    {"bdf", "4", IMPLICIT, MOMENTUM, 2, 2, true, BDF_START},
    {"bdf", "5", IMPLICIT, MOMENTUM, 2, 2, true, BDF_START},
    {"bdf", "6", IMPLICIT, MOMENTUM, 2, 2, true, BDF_START},
    {"alpha", "", IMPLICIT, MOMENTUM, 2, 2, true, ""},
    {"rosw", "theta1", IMPLICIT, MOMENTUM, 1, 1, false, ""},
    {"rosw", "theta2", IMPLICIT, MOMENTUM, 2, 2, false, ""},
    {"rosw", "2m", IMPLICIT, MOMENTUM, 2, 2, true, ""},
    {"rosw", "2p", IMPLICIT, MOMENTUM, 2, 2, true, ""},
    {"rosw", "ra3pw", IMPLICIT, MOMENTUM, 3, 3, true, ""},
    {"rosw", "ra34pw2", IMPLICIT, MOMENTUM, 3, 3, true, ""},
    {"rosw", "rodas3", IMPLICIT, MOMENTUM, 3, 3, true, ""},
    {"rosw", "sandu3", IMPLICIT, MOMENTUM, 3, 3, true, ""},
    {"rosw", "assp3p3s1c", IMPLICIT, VELOCITY, 3, 0, true, ""},
    {"rosw", "lassp3p4s2c", IMPLICIT, VELOCITY, 3, 0, true, ""},
    {"rosw", "llssp3p4s2c", IMPLICIT, VELOCITY, 3, 0, true, ""},
    {"rosw", "ark3", IMPLICIT, VELOCITY, 3, 0, true, ""},
    {"rosw", "grk4t", IMPLICIT, MOMENTUM, 4, 4, true, LOOKS_BACK},
    {"rosw", "shamp4", IMPLICIT, MOMENTUM, 4, 4, true, LOOKS_BACK},
    {"rosw", "veldd4", IMPLICIT, MOMENTUM, 4, 4, true, LOOKS_BACK},
    {"rosw", "4l", IMPLICIT, MOMENTUM, 4, 4, true, LOOKS_BACK},
    {"arkimex", "1bee", IMPLICIT, MOMENTUM, 1, 1, true, "backward Euler over half steps"},
    {"arkimex", "l2", IMPLICIT, MOMENTUM, 2, 2, true, ""},
    {"arkimex", "prssp2", IMPLICIT, MOMENTUM, 2, 2, false, ""},
    {"arkimex", "a2", IMPLICIT, VELOCITY, 2, 0, true, ""},
    {"arkimex", "ars122", IMPLICIT, VELOCITY, 2, 0, true, ""},
    {"arkimex", "2c", IMPLICIT, VELOCITY, 2, 0, true, ""},
    {"arkimex", "2d", IMPLICIT, VELOCITY, 2, 0, true, ""},
    {"arkimex", "2e", IMPLICIT, VELOCITY, 2, 0, true, ""},
    {"arkimex", "3", IMPLICIT, VELOCITY, 3, 0, true, ""},
    {"arkimex", "bpr3", IMPLICIT, VELOCITY, 3, 0, false, ""},
    {"arkimex", "ars443", IMPLICIT, VELOCITY, 3, 0, false, ""},
    {"arkimex", "4", IMPLICIT, VELOCITY, 4, 0, true, ""},
    {"arkimex", "5", IMPLICIT, VELOCITY, 5, 0, true, ""},
    {"symplectic", "", EXPLICIT, VELOCITY, 1, 0, false, ""},
    {"euler", "", EXPLICIT, VELOCITY, 1, 0, false, ""},
    {"rk", "1fe", EXPLICIT, VELOCITY, 1, 0, false, ""},
    {"rk", "2a", EXPLICIT, VELOCITY, 2, 0, true, ""},
    {"rk", "2b", EXPLICIT, VELOCITY, 2, 0, false, ""},
    {"rk", "3", EXPLICIT, VELOCITY, 3, 0, false, ""},
    {"rk", "3bs", EXPLICIT, VELOCITY, 3, 0, true, ""},
    {"rk", "4", EXPLICIT, VELOCITY, 4, 0, false, ""},
    {"rk", "5f", EXPLICIT, VELOCITY, 5, 0, true, ""},
    {"rk", "5dp", EXPLICIT, VELOCITY, 5, 0, true, ""},
    {"rk", "5bs", EXPLICIT, VELOCITY, 5, 0, true, ""},
    {"rk", "6vr", EXPLICIT, VELOCITY, 6, 0, true, ""},
    {"rk", "7vr", EXPLICIT, VELOCITY, 7, 0, true, ""},
    {"rk", "8vr", EXPLICIT, VELOCITY, 8, 0, true, ""},
    {"ssp", "rks2", EXPLICIT, VELOCITY, 2, 0, false, ""},
    {"ssp", "rks3", EXPLICIT, VELOCITY, 3, 0, false, ""},
    {"ssp", "rk104", EXPLICIT, VELOCITY, 4, 0, false, ""},
};

constexpr std::array<const char*, 2> OPTIONS[] = {{"rosw", "-ts_rosw_type"}, {"arkimex", "-ts_arkimex_type"}, {"rk", "-ts_rk_type"},
                                                  {"ssp", "-ts_ssp_type"}, {"bdf", "-ts_bdf_order"}};

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

}  // namespace

const char* subtype_option(const std::string& type) {
  for (const auto& [name, option] : OPTIONS)
    if (type == name) return option;
  return "";
}

std::string Method::words() const {
  return std::string("-ts_type ") + type + (*subtype ? std::string(" ") + subtype_option(type) + " " + subtype : "");
}

PetscErrorCode asked_method(TS ts, const char* type, const Method** out) {
  const char* option = subtype_option(type);
  char given[64] = "";
  std::string subtype;
  PetscFunctionBegin;
  *out = nullptr;
  PetscCall(own_subtype(ts, type, &subtype));
  if (*option) PetscCall(PetscOptionsGetString(nullptr, nullptr, option, given, sizeof given, nullptr));
  if (*given) subtype = given;
  // PETSc takes the names of subtypes in any case
  for (const Method& method : METHODS)
    if (std::string_view(method.type) == type && strcasecmp(method.subtype, subtype.c_str()) == 0) *out = &method;
  PetscFunctionReturn(0);
}

PetscErrorCode observed_order(TS ts, const Method& method, PetscInt* order) {
  PetscReal theta = 0.5;
  PetscFunctionBegin;
  if (std::string_view(method.type) == TSTHETA) PetscCall(TSThetaGetTheta(ts, &theta));
  *order = theta == 0.5 ? method.order : 1;
  PetscFunctionReturn(0);
}

bool knows_type(const std::string& type) {
  return std::any_of(std::begin(METHODS), std::end(METHODS), [&](const Method& method) { return type == method.type; });
}

std::string types_of(Method::Kind kind) {
  std::string list, last;
  for (const Method& method : METHODS) {
    if (method.kind != kind || last == method.type) continue;
    last = method.type;
    list += (list.empty() ? "" : ", ") + last;
  }
  return list;
}

}  // namespace bs
