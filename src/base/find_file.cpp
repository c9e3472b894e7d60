#include "base/find_file.hpp"
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <climits>
#include <set>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/recalled.hpp"
#include "base/text.hpp"

namespace bs {

namespace {

struct Found {
  std::vector<std::string> option_folders;                       ///< of the option files given, in their order
  std::vector<std::pair<std::string, std::string>> input_files;  ///< option and path
};

bool is_folder(const std::string& name) {
  struct stat status;
  return stat(name.c_str(), &status) == 0 && S_ISDIR(status.st_mode);
}

}  // namespace

bool is_file(const std::string& name) {
  struct stat status;
  return stat(name.c_str(), &status) == 0 && !S_ISDIR(status.st_mode);
}

std::string folder_of(const std::string& file) {
  const auto slash = file.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : file.substr(0, slash);
}

std::vector<std::string> shared_folders() {
  char path[PATH_MAX];
  const ssize_t length = readlink("/proc/self/exe", path, sizeof path);
  if (length <= 0 || length == static_cast<ssize_t>(sizeof path)) return {};
  const std::string bin = folder_of(std::string(path, static_cast<std::size_t>(length)));
  std::vector<std::string> found;
  for (const std::string& folder : {bin.substr(0, bin.rfind('/')) + "/share/backspring", bin + "/share/backspring"})
    if (is_folder(folder)) found.push_back(folder);
  return found;
}

const std::vector<std::pair<std::string, std::string>>& input_files(MPI_Comm comm) { return held_by<Found>(comm).input_files; }

void set_option_folders(MPI_Comm comm, const std::vector<std::string>& folders) { held_by<Found>(comm).option_folders = folders; }

std::string input_places(MPI_Comm comm, const std::string& name) {
  if (!name.empty() && name[0] == '/') return "check the path";
  std::string text = "looked for in this folder";
  if (!held_by<Found>(comm).option_folders.empty()) text += ", beside the option files";
  for (const std::string& folder : shared_folders()) text += ", in " + folder + " and its meshes/";
  return text;
}

PetscErrorCode find_input(MPI_Comm comm, const std::string& option, std::string* name) {
  Error fault;
  std::string found = *name;
  Found& all = held_by<Found>(comm);
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0 && !name->empty() && (*name)[0] != '/' && !is_file(*name)) {
    std::vector<std::string> places = all.option_folders;
    for (const std::string& folder : shared_folders()) places.insert(places.end(), {folder, folder + "/meshes"});
    for (auto place = places.rbegin(); place != places.rend(); ++place)
      if (is_file(*place + "/" + *name)) found = *place + "/" + *name;
  }
  PetscCall(share_text(comm, &found));
  *name = found;
  if (rank == 0) fault.text = fault_of_recalled_input(comm, option, found);
  PetscCall(fail_if_any(comm, fault));
  const std::pair<std::string, std::string> one(option, found);
  if (std::find(all.input_files.begin(), all.input_files.end(), one) == all.input_files.end()) all.input_files.push_back(one);
  PetscFunctionReturn(0);
}

}  // namespace bs
