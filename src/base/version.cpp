#include "base/version.hpp"

namespace bs {

const char* version() { return BS_VERSION; }

}  // namespace bs
