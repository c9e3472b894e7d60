// The numbers of a Gmsh file, as text or in binary.
#pragma once
#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

namespace bs {

/// Numbers one after the other, as text or in binary. Past the end, or where there is no number, it goes bad for good.
class GmshNumbers {
 public:
  GmshNumbers(const std::string& text, bool binary, bool wide) : text_(text), binary_(binary), wide_(wide) {}
  bool good() const { return good_; }
  std::size_t left() const { return good_ ? text_.size() - at_ : 0; }
  /// Goes behind the line `name`; false if there is none.
  bool section(const char* name) {
    const std::size_t found = text_.find(std::string("\n") + name, at_);
    if (found == std::string::npos) return false;
    const std::size_t line = text_.find('\n', found + 1);
    at_ = line == std::string::npos ? text_.size() : line + 1;
    return true;
  }
  /// An int; in binary 4 bytes.
  std::int64_t small() {
    std::int32_t value = 0;
    return binary_ ? (take(&value, sizeof value), value) : word();
  }
  /// A number of nodes or elements; in binary 8 bytes from format 4 on.
  std::int64_t large() {
    std::int64_t value = 0;
    return binary_ && wide_ ? (take(&value, sizeof value), value) : small();
  }
  void skip_reals(std::int64_t count) {
    double value;
    for (std::int64_t k = 0; k < count && good_; ++k) {
      if (binary_) {
        take(&value, sizeof value);
        continue;
      }
      char* end = nullptr;
      (void)std::strtod(text_.c_str() + at_, &end);
      advance(end);
    }
  }
  /// In text the counts of 2.2 files stand on a line of their own; in binary, too.
  std::int64_t count_line() {
    const bool was = binary_;
    binary_ = false;
    const std::int64_t count = word();
    binary_ = was;
    if (was && good_) at_ = std::min(text_.find('\n', at_), text_.size() - 1) + 1;
    return count;
  }

 private:
  void take(void* value, std::size_t bytes) {
    good_ = good_ && bytes <= text_.size() - at_;
    if (!good_) return;
    std::memcpy(value, text_.data() + at_, bytes);
    at_ += bytes;
  }
  std::int64_t word() {
    char* end = nullptr;
    errno = 0;
    const long long value = good_ ? std::strtoll(text_.c_str() + at_, &end, 10) : 0;
    if (good_) advance(errno ? nullptr : end);
    return good_ ? value : 0;
  }
  void advance(const char* end) {
    good_ = end && end != text_.c_str() + at_;
    if (good_) at_ = static_cast<std::size_t>(end - text_.c_str());
  }
  const std::string& text_;
  std::size_t at_ = 0;
  bool binary_, wide_, good_ = true;
};

}  // namespace bs
