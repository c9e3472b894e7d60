// What the program knows of every time-stepping method of PETSc that it runs: one row a type and subtype.
#pragma once
#include <petscts.h>
#include <string>
#include "model/model.hpp"

namespace bs {

struct Method {
  /// Whether F is solved for: an explicit type evaluates y' = G(t, y).
  enum class Kind { explicit_, implicit };
  const char* type;     ///< -ts_type
  const char* subtype;  ///< -ts_rk_type, -ts_ssp_type, -ts_arkimex_type, -ts_rosw_type, -ts_bdf_order; "": there is none
  Kind kind;
  Form form;            ///< how an implicit type must be given F
  int order;            ///< observed on particle systems, driven and not
  int descriptor;       ///< observed on systems G x + C x' = B u(t) with a singular C; 0: no such systems
  bool estimate;        ///< whether it estimates the error of its step: -ts_adapt_type works
  const char* remark;   ///< what the header says of it; "": nothing
  bool implicit() const { return kind == Kind::implicit; }
  /// "-ts_type rosw -ts_rosw_type ark3"
  std::string words() const;
};

/// The method the options ask for; null if the type or its subtype is not in the table. `type` is that of `ts`, whose
/// subtype is looked up where no option names one.
PetscErrorCode asked_method(TS ts, const char* type, const Method** out);

/// The order of `method` with the parameters `ts` has: theta is of order 1 but for theta = 1/2.
PetscErrorCode observed_order(TS ts, const Method& method, PetscInt* order);

bool knows_type(const std::string& type);

/// "beuler, cn, ...": the types of a kind, each once.
std::string types_of(Method::Kind kind);

/// Not collective. The option that names a type's subtype, "" if it has none.
const char* subtype_option(const std::string& type);

}  // namespace bs
