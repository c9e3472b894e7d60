#include "base/recalled_options.hpp"
#include <algorithm>
#include <filesystem>
#include <map>
#include <vector>
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/text.hpp"

namespace bs {

namespace {

using RecalledOptions = std::map<std::string, RecalledOption>;

struct LeftOut {
  std::string from, options;
  bool warned = false;
};

std::string shown(const std::string& option, const std::string& value) {
  constexpr std::size_t most = 60;
  return option.substr(0, most + 1) + (value.empty() ? "" : " " + (value.size() > most ? value.substr(0, most) + "..." : value));
}

/// Whether `path` lies in `folder` or below it, after links were followed.
bool lies_below(const std::filesystem::path& path, const std::filesystem::path& folder) {
  std::error_code none;
  const auto top = std::filesystem::canonical(folder, none);
  if (none) return false;
  const auto [end, rest] = std::mismatch(top.begin(), top.end(), path.begin(), path.end());
  return end == top.end() && rest != path.end();
}

}  // namespace

void note_recalled(MPI_Comm comm, const std::string& option, const RecalledOption& of) { held_by<RecalledOptions>(comm)[lower(option)] = of; }

std::string value_to_save(MPI_Comm comm, const std::string& option, const std::string& value) {
  const RecalledOptions& recalled = held_by<RecalledOptions>(comm);
  const auto at = recalled.find(lower(option));
  return at != recalled.end() && at->second.own ? at->second.value : value;
}

bool is_recalled(MPI_Comm comm, const std::string& option) { return held_by<RecalledOptions>(comm).count(lower(option)) > 0; }

std::string folder_of_recalled(MPI_Comm comm, const std::string& option) {
  const RecalledOptions& recalled = held_by<RecalledOptions>(comm);
  const auto at = recalled.find(lower(option));
  return at == recalled.end() ? std::string() : at->second.folder;
}

PetscErrorCode withdraw_recalled(MPI_Comm comm, const std::string& option) {
  RecalledOptions& recalled = held_by<RecalledOptions>(comm);
  const auto at = recalled.find(lower(option));
  const char* value = nullptr;
  PetscBool set = PETSC_FALSE;
  PetscFunctionBegin;
  if (at == recalled.end() || at->second.own) PetscFunctionReturn(0);
  PetscCall(PetscOptionsFindPair(nullptr, nullptr, option.c_str(), &value, &set));
  const std::string text = set && value ? value : "";
  PetscCall(PetscOptionsClearValue(nullptr, option.c_str()));
  PetscCall(leave_out(comm, at->second.from, at->second.written, text));
  recalled.erase(at);
  PetscFunctionReturn(0);
}

PetscErrorCode leave_out(MPI_Comm comm, const std::string& from, const std::string& option, const std::string& value) {
  LeftOut& all = held_by<LeftOut>(comm);
  PetscFunctionBegin;
  all.from = from;
  all.options += (all.options.empty() ? "" : ", ") + shown(option, value);
  if (all.warned) PetscCall(warn_left_out(comm));
  PetscFunctionReturn(0);
}

PetscErrorCode warn_left_out(MPI_Comm comm) {
  LeftOut& all = held_by<LeftOut>(comm);
  PetscFunctionBegin;
  all.warned = true;
  if (all.options.empty()) PetscFunctionReturn(0);
  PetscCall(warn(comm, "options_left_out",
                 all.from + ": not taken over from it: " + all.options +
                     ": options that write files or load libraries apply only if they are given again; those of the trajectory and the "
                     "checkpoint also if these lie beside it"));
  all.options.clear();
  PetscFunctionReturn(0);
}

std::string fault_of_recalled_input(MPI_Comm comm, const std::string& option, const std::string& path) {
  const RecalledOptions& recalled = held_by<RecalledOptions>(comm);
  const auto at = recalled.find(lower(option));
  if (at == recalled.end()) return {};
  const std::string& from = at->second.from;
  const std::string begin =
      "option " + option + " " + path + ": it stands in the checkpoint " + from + ", which may be somebody else's, and the file ";
  const std::string remedy = ": give " + option + " again to read it all the same";
  std::error_code none;
  const auto place = std::filesystem::canonical(path, none);
  if (none) return {};  // the file does not exist: its reader reports that
  if (!std::filesystem::is_regular_file(place, none)) return begin + "is no regular file" + remedy;
  std::vector<std::string> folders;
  for (const std::string& own : shared_folders())  // in a build folder these subfolders are links
    for (const char* part : {"", "/meshes", "/options"}) folders.push_back(own + part);
  folders.push_back(".");
  folders.push_back(std::filesystem::absolute(from, none).parent_path().string());
  if (std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) { return lies_below(place, folder); })) return {};
  return begin + "lies neither below this folder nor below the checkpoint's" + remedy;
}

}  // namespace bs
