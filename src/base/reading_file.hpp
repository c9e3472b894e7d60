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
  ~ReadingFile();
  void begin(const std::string& path);

 private:
  bool mine_ = false;
};

/// Safe in a signal handler; empty where no file is being read. A crash is the process's, and so is this.
const char* file_being_read();

}  // namespace bs
