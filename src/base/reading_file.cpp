#include "base/reading_file.hpp"

namespace bs {

static char reading[512] = "";

const char* file_being_read() { return reading; }

void ReadingFile::begin(const std::string& path) {
  if (mine_ || *reading) return;
  mine_ = true;
  const std::size_t length = path.copy(reading, sizeof reading - 1);
  for (std::size_t k = 0; k < length; ++k)
    if (static_cast<unsigned char>(reading[k]) < ' ') reading[k] = '?';
  reading[length] = '\0';
}

ReadingFile::~ReadingFile() {
  if (mine_) *reading = '\0';
}

}  // namespace bs
