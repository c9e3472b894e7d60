// Named numbers and texts that a checkpoint holds besides its vectors.
#pragma once
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>

namespace bs {

struct Facts {
  std::map<std::string, double> real;
  std::map<std::string, std::int64_t> whole;
  std::map<std::string, std::string> text;
  /// The number of that name; `otherwise` where there is none.
  double real_of(const std::string& name, double otherwise = 0) const { return real.count(name) ? real.at(name) : otherwise; }
  std::int64_t whole_of(const std::string& name, std::int64_t otherwise = 0) const { return whole.count(name) ? whole.at(name) : otherwise; }
};

/// Numbers by name on their way into a checkpoint or out of it: what remembers some calls keep(name, number) once for both ways.
class Keeper {
 public:
  explicit Keeper(std::map<std::string, double>* into) : into_(into) {}
  explicit Keeper(const std::map<std::string, double>& from) : from_(&from) {}
  bool restores() const { return from_ != nullptr; }
  /// On the way out the number becomes `otherwise` where there is none of that name.
  template <class Number>
  void operator()(const std::string& name, Number& number, double otherwise = 0) const {
    if (into_) (*into_)[name] = static_cast<double>(number);
    else number = static_cast<Number>(from_->count(name) ? from_->at(name) : otherwise);
  }

 private:
  std::map<std::string, double>* into_ = nullptr;
  const std::map<std::string, double>* from_ = nullptr;
};

/// A hash (FNV-1a) of all names and values, bit for bit.
inline std::int64_t checksum(const Facts& facts) {
  std::uint64_t sum = 0xcbf29ce484222325u;
  const auto add = [&sum](std::string_view bytes) {
    for (const char byte : bytes) sum = (sum ^ static_cast<unsigned char>(byte)) * 0x100000001b3u;
    sum = (sum ^ 0x100u) * 0x100000001b3u;  // the end of a piece: no byte is it
  };
  const auto add_number = [&add](const auto& number) {
    char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    add({bytes, sizeof bytes});
  };
  for (const auto& [name, value] : facts.real) add(name), add_number(value);
  for (const auto& [name, value] : facts.whole) add(name), add_number(value);
  for (const auto& [name, value] : facts.text) add(name), add(value);
  return static_cast<std::int64_t>(sum);
}

}  // namespace bs
