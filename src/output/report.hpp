// The closing report for scripts (-bs_report F.json): ordered keys and values, one JSON object.
#pragma once
#include <petscsys.h>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace bs {

/// Keys keep the order in which they were first set. Real numbers keep all digits; NaN and infinities become null.
class Report {
 public:
  void set(const std::string& key, double value);
  void set(const std::string& key, std::int64_t value);
  void set(const std::string& key, int value) { set(key, static_cast<std::int64_t>(value)); }
  void set(const std::string& key, bool value);
  void set(const std::string& key, const std::string& value);
  void set(const std::string& key, const char* value) { set(key, std::string(value)); }
  void set(const std::string& key, const std::vector<double>& values);
  void set(const std::string& key, const std::vector<std::vector<double>>& rows);
  void set(const std::string& key, const std::vector<std::string>& values);
  /// An object within the object.
  void set(const std::string& key, const Report& inner);
  /// All entries of `other`.
  void add(const Report& other);
  /// The object, indented by two blanks a level, without a newline at the end.
  std::string json() const;
  /// Collective. Written by rank 0 under a temporary name and renamed, so that a reader sees all or nothing. An existing file is
  /// replaced only if `overwrite`. A failure is reported with Exit::io. Nothing is done for an empty file name.
  PetscErrorCode write(MPI_Comm comm, const std::string& file, bool overwrite) const;

 private:
  void put(const std::string& key, std::string json_text);
  std::vector<std::pair<std::string, std::string>> entries_;
};

/// "text" in quotes, escaped as JSON requires; bytes that are not UTF-8 become "?".
std::string json_string(const std::string& text);

}  // namespace bs
