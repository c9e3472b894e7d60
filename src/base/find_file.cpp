#include "base/find_file.hpp"
#include <sys/stat.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <fstream>
#include <new>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/recalled_options.hpp"
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
  const std::string begun = folder_of_recalled(comm, option);
  const bool moved = !begun.empty() && begun != ".";
  if (rank == 0 && !name->empty() && (*name)[0] != '/' && (moved || !is_file(*name))) {
    std::vector<std::string> places = all.option_folders;
    places.insert(places.begin(), ".");
    if (moved) places.insert(places.begin(), begun);
    for (const std::string& folder : shared_folders()) places.insert(places.end(), {folder, folder + "/meshes"});
    for (auto place = places.rbegin(); place != places.rend(); ++place)
      if (const std::string there = *place == "." ? *name : *place + "/" + *name; is_file(there)) found = there;
  }
  PetscCall(share_text(comm, &found));
  *name = found;
  if (rank == 0) fault.text = fault_of_recalled_input(comm, option, found);
  PetscCall(fail_if_any(comm, fault));
  const std::pair<std::string, std::string> one(option, found);
  if (std::find(all.input_files.begin(), all.input_files.end(), one) == all.input_files.end()) all.input_files.push_back(one);
  PetscFunctionReturn(0);
}

namespace {

constexpr long long max_text_bytes = 1000000000;

/// On rank 0: reads the file that all ranks are to get; an error goes to `fault`.
void read_here(MPI_Comm comm, const std::string& path, std::string* text, Error* fault) {
  const FileStatus look = examine_file(comm, path);
  if (!look.error.empty()) return fault->note(0, look.error);
  if (look.bytes > max_text_bytes)
    return fault->note(0,
                       format("%s: %lld bytes, more than the 1 GB a text file may have; write the lattice as HDF5 (.h5)", path.c_str(), look.bytes));
  try {
    text->resize(static_cast<std::size_t>(look.bytes));
  } catch (const std::bad_alloc&) {
    return fault->note(0, path + ": not enough memory for its " + how_many(look.bytes, "byte"));
  }
  std::ifstream in(path, std::ios::binary);
  in.read(text->data(), look.bytes);
  if (in.gcount() != look.bytes)
    fault->note(0, format("%s: read %lld of its %s; check the disk", path.c_str(), static_cast<long long>(in.gcount()),
                          how_many(look.bytes, "byte").c_str()));
}

}  // namespace

FileStatus examine_file(MPI_Comm comm, const std::string& path) {
  FileStatus look;
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0)
    look.error = errno == ENOENT ? path + ": no such file; " + input_places(comm, path)
                                 : format("%s: cannot be read (%s)", path.c_str(), std::strerror(errno));
  else if (S_ISDIR(info.st_mode)) look.error = format("%s: is a folder; name a file in it", path.c_str());
  else if (!S_ISREG(info.st_mode)) look.error = format("%s: is not a regular file", path.c_str());
  else if (!std::ifstream(path)) look.error = format("%s: cannot be opened; check its permissions (chmod +r)", path.c_str());
  look.bytes = static_cast<long long>(info.st_size);
  return look;
}

PetscErrorCode read_text_file(MPI_Comm comm, const std::string& path, std::string* text) {
  Error fault;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  text->clear();
  if (rank == 0) read_here(comm, path, text, &fault);
  PetscCall(fail_if_any(comm, fault));
  PetscCall(share_text(comm, text));
  PetscFunctionReturn(0);
}

}  // namespace bs
