// Search for option files by name: those installed with the program are found from any folder.
#include <dirent.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <set>

#include "base/find_file.hpp"
#include "base/text.hpp"
#include "cli/command_line.hpp"

namespace bs {

namespace {

bool is_file(const std::string& name) {
  struct stat status;
  return stat(name.c_str(), &status) == 0 && !S_ISDIR(status.st_mode);
}

bool exists(const std::string& name) { return access(name.c_str(), F_OK) == 0; }

std::string folder_of(const std::string& name) {
  const auto slash = name.rfind('/');
  return slash == std::string::npos ? "." : name.substr(0, slash + 1);
}

std::vector<std::string> option_places() {
  std::vector<std::string> places;
  for (const std::string& folder : shared_folders())
    for (const char* part : {"", "/options", "/options/problems", "/options/solvers"}) places.push_back(folder + part);
  return places;
}

/// Names without .yaml of the option files that come with the program.
std::set<std::string> shipped() {
  std::set<std::string> names;
  for (const std::string& place : option_places())
    if (DIR* folder = opendir(place.c_str())) {
      while (const dirent* entry = readdir(folder)) {
        const std::string name = entry->d_name;
        if (name.size() > 5 && name.compare(name.size() - 5, 5, ".yaml") == 0) names.insert(name.substr(0, name.size() - 5));
      }
      closedir(folder);
    }
  return names;
}

/// The file meant by `name`; empty if there is none.
std::string find_options(const std::string& name) {
  if (exists(name)) return name;
  if (name.empty() || name[0] == '/') return {};
  for (const std::string& place : option_places())
    for (const char* ending : {"", ".yaml"})
      if (is_file(place + "/" + name + ending)) return place + "/" + name + ending;
  return {};
}

std::string not_found(const std::string& name) {
  std::string text = "option file " + name + ": no such file";
  if (!name.empty() && name[0] != '/') {
    text += "; looked for in this folder";
    for (const std::string& folder : shared_folders()) text += " and in " + folder + "/options (problems, solvers)";
  }
  const std::set<std::string> names = shipped();
  const std::string stem = split(name.substr(name.rfind('/') + 1), '.')[0];
  const std::string meant = nearest(stem, names, std::min(3, static_cast<int>(stem.size() + 1) / 2));
  if (!meant.empty()) return text + ": did you mean " + meant + ".yaml?";
  std::string all;
  for (const std::string& one : names) all += (all.empty() ? "" : ", ") + one;
  return text + (all.empty() ? ": give the path of a file" : ": give the path of a file, or one of " + all);
}

}  // namespace

std::string find_option_files(int argc, char** argv, std::vector<std::string>* folders) {
  static std::vector<std::string> kept;  // argv points into it
  kept.reserve(static_cast<std::size_t>(argc));
  for (int k = 1; k + 1 < argc; ++k) {
    if (strcasecmp(argv[k], "-options_file") != 0 && strcasecmp(argv[k], "-options_file_yaml") != 0) continue;
    const std::string name = argv[++k];
    const std::string found = find_options(name);
    if (found.empty()) return not_found(name);
    folders->push_back(folder_of(found));
    kept.push_back(found);
    argv[k] = &kept.back()[0];
  }
  return {};
}

}  // namespace bs
