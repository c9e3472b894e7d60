#include "solve/method_check.hpp"
namespace bs {
PetscErrorCode check_method(TS, const TSContext&) { return 0; }
}
