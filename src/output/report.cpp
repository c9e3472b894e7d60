#include "output/report.hpp"
#include <cmath>
#include <cstring>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "output/fresh_file.hpp"

namespace bs {

std::string json_string(const std::string& text) {
  std::string out = "\"";
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const char c = text[i];
    if (length == 0) {
      out += '?';
    } else if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += format("\\u%04x", static_cast<unsigned>(c));
    } else {
      out += text.substr(i, length);
    }
    i += length ? length : 1;
  }
  return out + "\"";
}

/// 17 significant digits, so that the same number is read back; null unless finite.
static std::string json_number(double value) { return std::isfinite(value) ? format("%.17g", value) : "null"; }

template <class T, class Print>
static std::string array_of(const std::vector<T>& values, Print print) {
  std::string out = "[";
  for (const T& value : values) out += (out.size() > 1 ? ", " : "") + print(value);
  return out + "]";
}

void Report::put(const std::string& key, std::string json_text) {
  for (auto& entry : entries_)
    if (entry.first == key) {
      entry.second = std::move(json_text);
      return;
    }
  entries_.emplace_back(key, std::move(json_text));
}

void Report::set(const std::string& key, double value) { put(key, json_number(value)); }
void Report::set(const std::string& key, std::int64_t value) { put(key, std::to_string(value)); }
void Report::set(const std::string& key, bool value) { put(key, value ? "true" : "false"); }
void Report::set(const std::string& key, const std::string& value) { put(key, json_string(value)); }
void Report::set(const std::string& key, const std::vector<double>& values) { put(key, array_of(values, json_number)); }
void Report::set(const std::string& key, const std::vector<std::vector<double>>& rows) {
  put(key, array_of(rows, [](const std::vector<double>& row) { return array_of(row, json_number); }));
}
void Report::set(const std::string& key, const std::vector<std::string>& values) { put(key, array_of(values, json_string)); }

void Report::set(const std::string& key, const Report& inner) {
  std::string text = inner.json();
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 3)) text.insert(at + 1, "  ");
  put(key, text);
}

void Report::add(const Report& other) {
  for (const auto& [key, text] : other.entries_) put(key, text);
}

std::string Report::json() const {
  std::string out = "{";
  for (const auto& entry : entries_) out += (out.size() > 1 ? ",\n  " : "\n  ") + json_string(entry.first) + ": " + entry.second;
  return out + (entries_.empty() ? "}" : "\n}");
}

PetscErrorCode Report::write(MPI_Comm comm, const std::string& file, bool overwrite) const {
  Error fault;
  PetscFunctionBegin;
  if (file.empty()) PetscFunctionReturn(0);
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0) {
    const int result = write_whole(real_name(file), json() + "\n", overwrite);
    if (result) fault.note(0, "cannot write the report " + file + ": " + std::strerror(result), Exit::io);
  }
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
