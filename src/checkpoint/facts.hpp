// Named numbers and words: what a checkpoint says besides its vectors.
#pragma once
#include <cstdint>
#include <map>
#include <string>

namespace bs {

struct Facts {
  std::map<std::string, double> real;
  std::map<std::string, std::int64_t> whole;
  std::map<std::string, std::string> text;
};

}  // namespace bs
