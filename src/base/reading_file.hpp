// Which file a library is reading, for the message of a program that crashes meanwhile: HDF5 1.10 crashes on some damaged files.
#pragma once
#include <string>

namespace bs {

/// While it exists, file_being_read() names `path`. Objects do not nest: the first one of the process counts.
class ReadingFile {
 public:
  ReadingFile() = default;
  ReadingFile(const ReadingFile&) = delete;
  ReadingFile& operator=(const ReadingFile&) = delete;
  ~ReadingFile() {
    if (mine_) *name_ = '\0';
  }
  void begin(const std::string& path) {
    if (mine_ || *name_) return;
    mine_ = true;
    const std::size_t length = path.copy(name_, sizeof name_ - 1);
    for (std::size_t k = 0; k < length; ++k)
      if (static_cast<unsigned char>(name_[k]) < ' ') name_[k] = '?';
    name_[length] = '\0';
  }

 private:
  friend const char* file_being_read();
  static inline char name_[512] = "";
  bool mine_ = false;
};

/// Safe in a signal handler; empty where no file is being read. A crash is the process's, and so is this.
inline const char* file_being_read() { return ReadingFile::name_; }

}  // namespace bs
