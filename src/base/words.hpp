// Words: trimming, splitting, and the name nearest to a misspelt one.
#pragma once
#include <set>
#include <string>
#include <vector>

namespace bs {

/// Without blanks at both ends.
std::string trim(const std::string& text);

/// The trimmed parts between separators; "" gives one empty part.
std::vector<std::string> split(const std::string& text, char separator);

/// Least number of letters inserted, removed or replaced to turn `a` into `b`; case does not matter.
int edit_distance(const std::string& a, const std::string& b);

/// The nearest of `names`, the first of equals; empty if none is within `most` changes.
std::string nearest(const std::string& word, const std::set<std::string>& names, int most);

}  // namespace bs
