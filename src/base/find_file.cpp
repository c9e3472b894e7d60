#include "base/find_file.hpp"

#include <dirent.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <climits>
#include <set>

#include "base/fault.hpp"
#include "base/recalled.hpp"
#include "base/text.hpp"

namespace bs {

namespace {

/// Folders of the option files given, in their order; and the text of replaced arguments, which argv points into.
std::vector<std::string>& option_folders() {
  static std::vector<std::string> folders;
  return folders;
}

std::vector<std::pair<std::string, std::string>>& inputs() {
  static std::vector<std::pair<std::string, std::string>> files;
  return files;
}

bool is_file(const std::string& name) {
  struct stat status;
  return stat(name.c_str(), &status) == 0 && !S_ISDIR(status.st_mode);
}

bool exists(const std::string& name) { return access(name.c_str(), F_OK) == 0; }

bool is_folder(const std::string& name) {
  struct stat status;
  return stat(name.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

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

std::vector<std::string> shared_folders() {
  char path[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", path, sizeof path);
  if (length <= 0 || length == static_cast<ssize_t>(sizeof path)) return {};
  std::string bin = folder_of(std::string(path, static_cast<std::size_t>(length)));
  bin.pop_back();
  std::vector<std::string> found;
  for (const std::string& folder : {bin.substr(0, bin.rfind('/')) + "/share/backspring", bin + "/share/backspring"})
    if (is_folder(folder)) found.push_back(folder);
  return found;
}

std::string find_option_files(int argc, char** argv) {
  static std::vector<std::string> kept;
  kept.reserve(static_cast<std::size_t>(argc));
  for (int k = 1; k + 1 < argc; ++k) {
    if (strcasecmp(argv[k], "-options_file") != 0 && strcasecmp(argv[k], "-options_file_yaml") != 0) continue;
    const std::string name = argv[++k];
    const std::string found = find_options(name);
    if (found.empty()) return not_found(name);
    option_folders().push_back(folder_of(found));
    kept.push_back(found);
    argv[k] = &kept.back()[0];
  }
  return {};
}

const std::vector<std::pair<std::string, std::string>>& input_files() { return inputs(); }

std::string input_places(const std::string& name) {
  if (!name.empty() && name[0] == '/') return "check the path";
  std::string text = "looked for in this folder";
  if (!option_folders().empty()) text += ", beside the option files";
  for (const std::string& folder : shared_folders()) text += ", in " + folder + " and its meshes/";
  return text;
}

PetscErrorCode find_input(MPI_Comm comm, const std::string& option, std::string* name) {
  PetscMPIInt rank;
  Fault fault;
  std::string found = *name;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0 && !name->empty() && (*name)[0] != '/' && !is_file(*name)) {
    std::vector<std::string> places = option_folders();
    for (const std::string& folder : shared_folders()) places.insert(places.end(), {folder, folder + "/meshes"});
    for (auto place = places.rbegin(); place != places.rend(); ++place)
      if (is_file(*place + "/" + *name)) found = *place + "/" + *name;
  }
  PetscMPIInt length = static_cast<PetscMPIInt>(found.size());
  PetscCallMPI(MPI_Bcast(&length, 1, MPI_INT, 0, comm));
  found.resize(static_cast<std::size_t>(length));
  PetscCallMPI(MPI_Bcast(&found[0], length, MPI_CHAR, 0, comm));
  *name = found;
  if (rank == 0) fault.text = fault_of_recalled_input(option, found);
  PetscCall(agree(comm, fault));
  const std::pair<std::string, std::string> one(option, found);
  if (std::find(inputs().begin(), inputs().end(), one) == inputs().end()) inputs().push_back(one);
  PetscFunctionReturn(0);
}

}  // namespace bs
