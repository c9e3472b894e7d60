// printf into a string. No PETSc.
#pragma once
#include <string>

namespace bs {

/// Formats like printf into a string.
std::string format(const char* pattern, ...) __attribute__((format(printf, 1, 2)));

}  // namespace bs
