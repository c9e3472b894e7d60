#include "output/growing.hpp"

namespace bs {

namespace {

bool ends_in(const std::string& path, const std::string& tail) {
  return path.size() >= tail.size() && path.compare(path.size() - tail.size(), tail.size(), tail) == 0;
}

struct Links {
  std::vector<std::string> paths;
  std::string foreign;  ///< one that is no part of the file
};

/// Every link of the file, in the same order on every rank.
Links links_of(hid_t file) {
  Links links;
  const auto keep = [](hid_t, const char* name, const H5L_info_t* info, void* data) -> herr_t {
    Links& found = *static_cast<Links*>(data);
    if (info->type == H5L_TYPE_HARD) found.paths.push_back(std::string("/") + name);
    else found.foreign = std::string("/") + name;
    return 0;
  };
  (void)H5Lvisit(file, H5_INDEX_NAME, H5_ITER_INC, keep, &links);
  return links;
}

/// Whether a dataset's numbers lie in chunks of the file itself, as those of every growing dataset do.
bool in_chunks(hid_t file, const std::string& path) {
  const H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  if (set < 0) return false;
  const H5 list(H5Dget_create_plist(set), H5Pclose);
  return list >= 0 && H5Pget_layout(list) == H5D_CHUNKED && H5Pget_external_count(list) == 0;
}

}  // namespace

std::vector<Growing> growing_of(hid_t file, const TrajectoryMark& mark, std::string* fault) {
  std::vector<Growing> found;
  const Links links = links_of(file);
  fault->clear();
  if (!links.foreign.empty()) *fault = "has a link to elsewhere, " + links.foreign;
  for (const std::string& path : links.paths) {
    if (path.rfind("/events/", 0) == 0) continue;  // written at a run's end, as a whole
    const bool log = path.rfind("/backspring/log/", 0) == 0;
    const bool clock = !log && (ends_in(path, "/time") || ends_in(path, "/step"));
    if (!log && !clock && !ends_in(path, "/value")) continue;
    if (fault->empty() && !in_chunks(file, path)) *fault = "keeps " + path + " outside chunks of the file itself";
    found.push_back({path, log, clock, log ? mark.log_rows : mark.frames});
  }
  return found;
}

PetscErrorCode count_rows(hid_t file, const std::string& path, std::int64_t* rows) {
  hsize_t extent[H5S_MAX_RANK] = {0};

  PetscFunctionBegin;
  H5 set(H5Dopen2(file, path.c_str(), H5P_DEFAULT), H5Dclose);
  BS_H5(set);
  H5 space(H5Dget_space(set), H5Sclose);
  BS_H5(H5Sget_simple_extent_dims(space, extent, nullptr));
  *rows = static_cast<std::int64_t>(extent[0]);
  PetscFunctionReturn(0);
}

}  // namespace bs
