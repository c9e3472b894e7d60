// Where the numbers of an HDF5 file are: in the file itself, or they are refused. A link or a dataset that leads to another file
// can make the content of whatever this user may read into masses or positions.

#include "base/error.hpp"
#include "input/hdf5_file.hpp"

namespace bs {

namespace {

/// HDF5 asks before it follows a link to another file: it must not.
herr_t stop_at_link(const char*, const char*, const char* file, const char*, unsigned*, hid_t, void* data) {
  auto* elsewhere = static_cast<std::pair<std::string, bool>*>(data);
  *elsewhere = {file ? file : "", true};
  return -1;
}

/// The names of filters that this HDF5 has not got, of those that packed `list`.
std::string missing_filter(hid_t list) {
  const int count = H5Pget_nfilters(list);
  for (int k = 0; k < count; ++k) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    char name[64] = "";
    const H5Z_filter_t filter = H5Pget_filter2(list, static_cast<unsigned>(k), &flags, &values, nullptr, sizeof name - 1, name, &config);
    if (filter < 0 || H5Zfilter_avail(filter) <= 0) return *name ? std::string(name) : "number " + std::to_string(filter);
  }
  return {};
}

}  // namespace

bool Hdf5File::stay_within() {
  links_ = H5(H5Pcreate(H5P_LINK_ACCESS), H5Pclose);
  sets_ = H5(H5Pcreate(H5P_DATASET_ACCESS), H5Pclose);
  groups_ = H5(H5Pcreate(H5P_GROUP_ACCESS), H5Pclose);
  bool good = true;
  for (const hid_t list : {hid_t(links_), hid_t(sets_), hid_t(groups_)}) good = H5Pset_elink_cb(list, stop_at_link, &elsewhere_) >= 0 && good;
  return good;
}

H5 Hdf5File::group(const std::string& path) const { return H5(H5Gopen2(file_, path.c_str(), groups_), H5Gclose); }

std::string Hdf5File::fault_of_link(const std::string& path) const {
  return format("%s: %s is a link to another file (%s): refused; copy the data it points to into the file", name_.c_str(), path.c_str(),
                elsewhere_.first.c_str());
}

/// Numbers that lie in other files, or packed in a way that cannot be read.
std::string Hdf5File::fault_of_place(hid_t dataset, const std::string& path) const {
  const std::string begin = name_ + ": " + path;
  const H5 list(H5Dget_create_plist(dataset), H5Pclose);
  if (!list) return begin + ": damaged; write it again";
  char other[256] = "";
  if (H5Pget_external_count(list) > 0) {
    (void)H5Pget_external(list, 0, sizeof other - 1, other, nullptr, nullptr);
    return begin + ": its data are stored in another file (external storage, " + other + "): refused; write them into the file";
  }
  if (H5Pget_layout(list) == H5D_VIRTUAL) {
    std::size_t sources = 0;
    (void)H5Pget_virtual_count(list, &sources);
    for (std::size_t k = 0; k < sources; ++k)
      if (H5Pget_virtual_filename(list, k, other, sizeof other - 1) < 0 || std::string(other) != ".")
        return begin + ": is a virtual dataset with a source in another file (" + other + "): refused; write the numbers into the file";
  }
  const std::string filter = missing_filter(list);
  if (!filter.empty())
    return begin + ": is compressed by the filter " + filter + ", which cannot be read here; write it with gzip, or without compression";
  return {};
}

}  // namespace bs
