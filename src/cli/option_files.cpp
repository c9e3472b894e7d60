// Option files: found by name, those installed with the program from any folder. They are read here first as PETSc will read them, including the
// files that they name, so that a file which PETSc would read for ever or crash on is refused.
#include <dirent.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include "base/find_file.hpp"
#include "base/option_names.hpp"
#include "base/text.hpp"
#include "cli/command_line.hpp"

namespace bs {

namespace {

bool exists(const std::string& name) { return access(name.c_str(), F_OK) == 0; }

std::vector<std::string> option_places() {
  std::vector<std::string> places;
  for (const std::string& folder : shared_folders())
    for (const char* part : {"", "/options", "/options/problems", "/options/solvers"}) places.push_back(folder + part);
  return places;
}

/// Names, without .yaml, of the option files that come with the program.
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
  static std::vector<std::string> kept;  // argv points into these texts
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

namespace {

constexpr off_t most_bytes = off_t{1} << 26;

struct OptionFile {
  std::string path, place;  ///< place: "file line n: " of the file that names it
  bool yaml = false;
};

/// Replaces ${NAME} in a path by the variable of the environment, as PETSc does.
std::string expanded(std::string path) {
  for (std::size_t at = 0; (at = path.find("${", at)) != std::string::npos; ++at) {
    const std::size_t end = path.find('}', at);
    if (end == std::string::npos) break;
    if (const char* value = std::getenv(path.substr(at + 2, end - at - 2).c_str())) path.replace(at, end - at + 1, value);
  }
  return path;
}

bool names_file(const std::string& word, bool* yaml) {
  *yaml = strcasecmp(word.c_str(), "-options_file_yaml") == 0;
  return *yaml || strcasecmp(word.c_str(), "-options_file") == 0;
}

OptionFile named(const std::string& given, bool yaml, const std::string& place) {
  std::string path = expanded(given);
  if (!yaml && ends_with(path, ":yaml")) {
    yaml = true;
    path.resize(path.size() - 5);
  }
  for (const char* ending : {".yaml", ".yml", ".json"}) yaml = yaml || ends_with(path, ending);
  return {path, place, yaml};
}

/// The option files that a plain option file names: it has a name and a value on each line, and # begins a comment.
std::vector<OptionFile> named_in(const std::string& text, const std::string& path) {
  std::vector<OptionFile> files;
  std::istringstream in(text);
  std::string line, name, value;
  bool yaml = false;
  for (int number = 1; std::getline(in, line); ++number) {
    std::istringstream words(line.substr(0, line.find('#')));
    if (!(words >> name >> value) || !names_file(name, &yaml)) continue;
    if (value.size() > 1 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
    files.push_back(named(value, yaml, format("option file %s line %d: ", path.c_str(), number)));
  }
  return files;
}

std::string fault_of_kind(const std::string& name, const struct stat& info) {
  if (S_ISDIR(info.st_mode)) return name + ": is a folder; name a file in it";
  if (!S_ISREG(info.st_mode)) return name + ": is a device or a pipe, which may never end; write the options to a file and name that";
  if (info.st_size > most_bytes)
    return name + format(": has %.0f MB, which no options need; at most %.0f MB are read", 1e-6 * static_cast<double>(info.st_size),
                         1e-6 * static_cast<double>(most_bytes));
  return {};
}

/// `above`: the files by which this one is named, directly or indirectly, to detect a cycle.
std::string fault_of_file(const OptionFile& file, std::vector<struct stat>* above) {
  struct stat info = {};
  const std::string name = file.place + "option file " + file.path;
  if (stat(file.path.c_str(), &info) != 0) {
    if (errno == ENOENT) return name + ": no such file; check the path, which is relative to the folder in which the run starts";
    return name + ": cannot be read (" + std::strerror(errno) + ")";
  }
  const std::string fault = fault_of_kind(name, info);
  if (!fault.empty()) return fault;
  for (const struct stat& one : *above)
    if (one.st_dev == info.st_dev && one.st_ino == info.st_ino)
      return name + ": is already being read, so it would be read without end; leave the line out";
  std::ifstream in(file.path, std::ios::binary);
  if (!in) return name + ": cannot be opened; check its permissions (chmod +r)";
  const std::string text(std::istreambuf_iterator<char>(in), {});
  if (file.yaml || text.compare(0, 5, "%YAML") == 0) return fault_of_yaml(text, name);
  above->push_back(info);
  for (const OptionFile& next : named_in(text, file.path)) {
    const std::string deeper = fault_of_file(next, above);
    if (!deeper.empty()) return deeper;
  }
  above->pop_back();
  return {};
}

}  // namespace

std::string fault_of_option_files(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  const std::vector<std::string> more = words_of_environment();
  words.insert(words.end(), more.begin(), more.end());
  bool yaml = false;
  for (std::size_t k = 0; k + 1 < words.size(); ++k) {
    if (!names_file(words[k], &yaml)) continue;
    std::vector<struct stat> above;
    const std::string fault = fault_of_file(named(words[++k], yaml, ""), &above);
    if (!fault.empty()) return fault;
  }
  return {};
}

}  // namespace bs
