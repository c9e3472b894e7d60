#include "base/warnings.hpp"
#include <algorithm>
#include <sstream>
#include "base/error.hpp"

namespace bs {

bool Warnings::has(const std::string& key) const { return std::find(keys_.begin(), keys_.end(), key) != keys_.end(); }

PetscErrorCode Warnings::add(const std::string& key, const std::string& text) {
  PetscFunctionBegin;
  if (has(key)) PetscFunctionReturn(0);
  keys_.push_back(key);
  PetscCall(warn(comm_, text));
  PetscFunctionReturn(0);
}

void Warnings::save(Facts* facts) const {
  std::string all;
  for (const std::string& key : keys_) all += (all.empty() ? "" : " ") + key;
  if (!all.empty()) facts->text["warnings"] = all;
}

void Warnings::restore(const Facts& facts) {
  const auto saved = facts.text.find("warnings");
  if (saved == facts.text.end()) return;
  std::istringstream words(saved->second);
  for (std::string key; words >> key;)
    if (!has(key)) keys_.push_back(key);
}

}  // namespace bs
