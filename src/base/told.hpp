// Shared by fault.cpp and error_handler.cpp only: the voice of the program.
#pragma once
#include <string>

#include "base/fault.hpp"

namespace bs {

/// "backspring: KIND: TEXT" on stderr as one line, control characters blanked.
void print_line(const char* kind, const std::string& text);

/// Remembers that a fault with this exit code has been told.
void mark_told(Exit exit);

}  // namespace bs
