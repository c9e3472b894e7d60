// Shared by fault.cpp, error_handler.cpp and their tests: the voice of the program.
#pragma once
#include <string>

#include "base/fault.hpp"

namespace bs {

/// "backspring: KIND: TEXT" on stderr as one line, control characters blanked.
void print_line(const char* kind, const std::string& text);

/// Remembers that a fault with this exit code has been told.
void mark_told(Exit exit);

/// As if nothing had happened yet: for tests.
void forget_faults();

}  // namespace bs
