// Shared by fault.cpp, error_handler.cpp and their tests: how messages are printed.
#pragma once
#include <string>

#include "base/fault.hpp"

namespace bs {

/// "backspring: KIND: TEXT" on stderr as one line, control characters blanked.
void print_line(const char* kind, const std::string& text);

/// Records that a fault with this exit code has been reported.
void mark_told(Exit exit);

/// Resets that record, for tests.
void forget_faults();

}  // namespace bs
