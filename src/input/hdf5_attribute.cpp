// String attributes, of fixed or variable length.
#include "base/error.hpp"
#include "input/hdf5_file.hpp"

namespace bs {

namespace {

constexpr std::size_t longest_text = 65536;

/// Reads all strings of `attribute`, one behind the other; false if it holds none or cannot be read.
bool read_strings(hid_t attribute, std::vector<std::string>* out) {
  // the memory type copies the file's: HDF5 converts no character sets
  const H5 type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (!type || !space || H5Tget_class(type) != H5T_STRING) return false;
  const hssize_t count = H5Sget_simple_extent_npoints(space);
  if (count < 1 || count > 256) return false;
  const std::size_t many = static_cast<std::size_t>(count);
  if (H5Tis_variable_str(type) > 0) {
    std::vector<char*> texts(many, nullptr);
    if (H5Aread(attribute, type, texts.data()) < 0) return false;
    for (const char* text : texts) out->emplace_back(text ? text : "");
    (void)H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data());
    return true;
  }
  const std::size_t length = H5Tget_size(type);
  if (length > longest_text / many) return false;
  std::string all(length * many, '\0');
  if (H5Aread(attribute, type, all.data()) < 0) return false;
  for (std::size_t k = 0; k < many; ++k) out->emplace_back(all.substr(k * length, length).c_str());
  return true;
}

}  // namespace

PetscErrorCode Hdf5File::strings(const std::string& path, const std::string& name, bool one, std::vector<std::string>* out) const {
  Error fault;
  PetscFunctionBegin;
  out->clear();
  if ((path == "/" || has(path)) && H5Aexists_by_name(file_, path.c_str(), name.c_str(), links_) > 0) {
    const H5 attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, links_), H5Aclose);
    if (!attribute || !read_strings(attribute, out) || (one && out->size() != 1))
      fault.note(0, format("%s: attribute %s of %s is not %s", name_.c_str(), name.c_str(), path.c_str(),
                           one ? "one string; write it as a string" : "a list of strings; write it as one"));
  } else if (elsewhere_.second) {
    fault.note(0, fault_of_link(path));
  }
  PetscCall(fail_if_any(comm_, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Hdf5File::text_attribute(const std::string& path, const std::string& name, std::string* out) const {
  std::vector<std::string> texts;
  PetscFunctionBegin;
  PetscCall(strings(path, name, true, &texts));
  *out = texts.empty() ? "" : texts[0].substr(0, texts[0].find_last_not_of(' ') + 1);
  PetscFunctionReturn(0);
}

PetscErrorCode Hdf5File::words_attribute(const std::string& path, const std::string& name, std::vector<std::string>* out) const {
  std::vector<std::string> texts;
  PetscFunctionBegin;
  out->clear();
  PetscCall(strings(path, name, false, &texts));
  for (const std::string& text : texts)
    for (const std::string& word : split(text, ',')) out->push_back(word);
  PetscFunctionReturn(0);
}

// Where the numbers of an HDF5 file are: in the file itself, or they are refused. A link or a dataset that leads to another file
// can make the content of whatever this user may read into masses or positions.

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
