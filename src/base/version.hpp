// The version of the program, library and Python package, as CMakeLists.txt has it.
#pragma once

namespace bs {

const char* version();

}  // namespace bs
