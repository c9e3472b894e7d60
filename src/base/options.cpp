#include "base/options.hpp"
#include <strings.h>
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/option_names.hpp"
#include "base/recalled_options.hpp"
#include "base/text.hpp"

namespace bs {

namespace {

struct Known {
  std::set<std::string> names;
  std::set<std::string> described;  ///< by -help: an option that two laws read is listed once
};

/// " [kg]" from "mass of a particle [kg]"; empty where the help names no unit ("along x[,y]" names none).
std::string unit_of(const std::string& help) {
  const auto open = help.rfind(" ["), close = help.rfind(']');
  if (open == std::string::npos || close == std::string::npos || close < open) return {};
  return help.substr(open, close - open + 1);
}

template <class T, class Print>
std::string list(const T* values, std::size_t count, Print print) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += (i ? "," : "") + print(values[i]);
  return text;
}

std::string shown(double x) { return format("%g", x); }

}  // namespace

const std::set<std::string>& known_options(MPI_Comm comm) { return held_by<Known>(comm).names; }

void Section::fail(const std::string& text) {
  if (!status_) status_ = bs::fail(comm_, Exit::input, text);
}

void Section::refuse(const char* name, const std::string& value, const std::string& why, const std::string& remedy) {
  fail(format("option %s: %s %s: %s", name, value.empty() ? "an empty value" : value.c_str(), why.c_str(), remedy.c_str()));
}

/// Registers and explains the option; true and `value` if it is given. `bare`: it may come without a value.
bool Section::find(const char* name, const char* help, const std::string& present, std::string* value, bool* bare) {
  Known& known = held_by<Known>(comm_);
  known.names.insert(name);
  if (items_->printhelp && items_->count == 1 && !items_->alreadyprinted && known.described.insert(name).second) {
    const PetscErrorCode code = (*PetscHelpPrintf)(comm_, "  %s: <%s>: %s\n", name, present.c_str(), help);
    if (code && !status_) status_ = code;
  }
  const char* text = nullptr;
  PetscBool set = PETSC_FALSE;
  const PetscErrorCode code = PetscOptionsFindPair(items_->options, nullptr, name, &text, &set);
  if (code && !status_) status_ = code;
  if (status_ || !set) return false;
  if (bare) *bare = !text;
  if (!text && !bare) {
    fail(format("option %s needs a value: %s", name, help));
    return false;
  }
  *value = text ? trim(text) : "";
  return true;
}

bool Section::real_of(const char* name, const char* help, const std::string& word, double* value) {
  char* end = nullptr;
  const double x = std::strtod(word.c_str(), &end);
  const bool whole = !word.empty() && *end == '\0';
  if (whole && std::isfinite(x)) {
    *value = x;
    return true;
  }
  refuse(name, word, whole ? "is not finite" : "is not a number", "give a number" + unit_of(help));
  return false;
}

bool Section::integer_of(const char* name, const char* help, const std::string& word, std::int64_t* value) {
  char* end = nullptr;
  errno = 0;
  const long long x = std::strtoll(word.c_str(), &end, 10);
  const bool whole = !word.empty() && *end == '\0';
  if (whole && errno != ERANGE) {
    *value = x;
    return true;
  }
  refuse(name, word, whole ? "is too large" : "is not a whole number", "give a whole number" + unit_of(help));
  return false;
}

bool Section::real(const char* name, const char* help, double& value, Range range) {
  std::string text;
  double x = 0;
  if (!find(name, help, shown(value), &text) || !real_of(name, help, text, &x)) return false;
  if (range == Range::positive && x <= 0) refuse(name, text, "is not positive", "give a number > 0" + unit_of(help));
  if (range == Range::nonnegative && x < 0) refuse(name, text, "is negative", "give a number >= 0" + unit_of(help));
  if (status_) return false;
  value = x;
  return true;
}

bool Section::reals(const char* name, const char* help, double* values, int max, int* count) {
  std::string text;
  if (!find(name, help, list(values, static_cast<std::size_t>(max), shown), &text)) return false;
  const std::vector<std::string> words = split(text, ',');
  if (words.size() > static_cast<std::size_t>(max)) {
    refuse(name, text, format("are %zu numbers", words.size()), format("give at most %d, separated by commas", max) + unit_of(help));
    return false;
  }
  std::vector<double> read(words.size());
  for (std::size_t i = 0; i < words.size(); ++i)
    if (!real_of(name, help, words[i], &read[i])) return false;
  std::copy(read.begin(), read.end(), values);
  if (count) *count = static_cast<int>(read.size());
  return true;
}

bool Section::integer(const char* name, const char* help, std::int64_t& value, Range range) {
  std::string text;
  std::int64_t n = 0;
  if (!find(name, help, std::to_string(value), &text) || !integer_of(name, help, text, &n)) return false;
  if (range == Range::positive && n <= 0) refuse(name, text, "is not positive", "give a whole number > 0" + unit_of(help));
  if (range == Range::nonnegative && n < 0) refuse(name, text, "is negative", "give a whole number >= 0" + unit_of(help));
  if (status_) return false;
  value = n;
  return true;
}

bool Section::integers(const char* name, const char* help, std::vector<std::int64_t>& values) {
  std::string text;
  const std::string present = list(values.data(), values.size(), [](std::int64_t n) { return std::to_string(n); });
  if (!find(name, help, present, &text)) return false;
  std::vector<std::int64_t> read;
  for (const std::string& word : split(text, ',')) {
    read.push_back(0);
    if (!integer_of(name, help, word, &read.back())) return false;
  }
  values = read;
  return true;
}

bool Section::flag(const char* name, const char* help, bool& value) {
  static const char* const yes[] = {"true", "yes", "on", "1"};
  static const char* const no[] = {"false", "no", "off", "0"};
  std::string text;
  bool bare = false;
  if (!find(name, help, value ? "true" : "false", &text, &bare)) return false;
  const auto same = [&text](const char* word) { return strcasecmp(text.c_str(), word) == 0; };
  if (bare || std::any_of(std::begin(yes), std::end(yes), same)) {
    value = true;
  } else if (std::any_of(std::begin(no), std::end(no), same)) {
    value = false;
  } else {
    refuse(name, text, "is neither true nor false", "give true, false or nothing (true)");
    return false;
  }
  return true;
}

std::vector<std::string> Section::names(const std::string& name, const char* help) {
  std::vector<std::string> all;
  std::string none;
  (void)find(name.c_str(), help, none, &none);
  const PetscErrorCode code = option_endings(name.substr(1, name.size() - std::strlen("-NAME")), &all);
  if (code && !status_) status_ = code;
  return all;
}

bool Section::text(const char* name, const char* help, std::string& value) {
  std::string given;
  if (!find(name, help, value, &given)) return false;
  if (given.empty()) fail(format("option %s: an empty value: give a word, or leave the option out", name));
  if (status_) return false;
  value = given;
  return true;
}

bool Section::path(const char* name, const char* help, std::string& value) {
  const PetscErrorCode code = withdraw_recalled(comm_, name);
  if (code && !status_) status_ = code;
  return text(name, help, value);
}

bool Section::file(const char* name, const char* help, std::string& value) {
  if (!text(name, help, value)) return false;
  const PetscErrorCode code = find_input(comm_, name, &value);
  if (code && !status_) status_ = code;
  return !code;
}

bool Section::texts(const char* name, const char* help, std::vector<std::string>& values) {
  std::string given;
  if (!find(name, help, list(values.data(), values.size(), [](const std::string& s) { return s; }), &given)) return false;
  values = given.empty() ? std::vector<std::string>() : split(given, ',');
  return true;
}

bool Section::choice(const char* name, const char* help, const std::vector<std::string>& choices, int& index) {
  std::string all, given;
  for (const std::string& word : choices) all += (all.empty() ? "" : ", ") + word;
  const std::string explained = std::string(help) + " (one of " + all + ")";
  const bool set = index >= 0 && index < static_cast<int>(choices.size());
  if (!find(name, explained.c_str(), set ? choices[static_cast<std::size_t>(index)] : "", &given)) return false;
  const auto is = [&given](const std::string& word) { return !strcasecmp(word.c_str(), given.c_str()); };
  const auto begins = [&given](const std::string& word) { return given.size() >= 3 && !strncasecmp(word.c_str(), given.c_str(), given.size()); };
  auto at = std::find_if(choices.begin(), choices.end(), is);
  if (at == choices.end() && std::count_if(choices.begin(), choices.end(), begins) == 1) at = std::find_if(choices.begin(), choices.end(), begins);
  if (at == choices.end()) {
    refuse(name, given, "does not exist", "give one of " + all);
    return false;
  }
  index = static_cast<int>(at - choices.begin());
  return true;
}

}  // namespace bs
