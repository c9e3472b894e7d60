// The owner of an HDF5 identifier, what HDF5 says of a failure, and which file it is reading, for the message of a program that crashes meanwhile:
// HDF5 1.10 crashes on some damaged files.
#pragma once
#include <hdf5.h>
#include <string>
#include <utility>

namespace bs {

/// Owns an HDF5 identifier, closed by `close` when it goes out of scope. A file cannot be closed while any is open.
class H5 {
 public:
  H5() = default;
  H5(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  H5(const H5&) = delete;
  H5& operator=(const H5&) = delete;
  H5(H5&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  H5& operator=(H5&& other) noexcept {
    std::swap(id_, other.id_);
    std::swap(close_, other.close_);
    return *this;
  }
  ~H5() { reset(); }
  void reset() {
    if (id_ >= 0) close_(id_);
    id_ = -1;
  }
  operator hid_t() const { return id_; }
  explicit operator bool() const { return id_ >= 0; }

 private:
  hid_t id_ = -1;
  herr_t (*close_)(hid_t) = nullptr;
};

/// HDF5's own words for the innermost cause of the last failed call; empty: it gives none.
inline std::string h5_words() {
  std::string text;
  const auto keep = [](unsigned, const H5E_error2_t* entry, void* data) -> herr_t {
    if (entry->desc && *entry->desc) *static_cast<std::string*>(data) = entry->desc;
    return 0;
  };
  (void)H5Ewalk2(H5E_DEFAULT, H5E_WALK_DOWNWARD, keep, &text);
  return text;
}

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
