// String attributes, of fixed or variable length.
#include <cstring>

#include "base/fault.hpp"
#include "input/hdf5_file.hpp"

namespace bs {

namespace {

constexpr std::size_t longest_text = 65536;

/// Reads one string of `attribute`; false if it is not one string or cannot be read.
bool read_text(hid_t attribute, std::string* out) {
  const H5 type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  if (!type || !space || H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1) return false;
  // The memory type copies the file's: HDF5 converts no character sets.
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    if (H5Aread(attribute, type, &text) < 0) return false;
    if (text) *out = text;
    (void)H5Dvlen_reclaim(type, space, H5P_DEFAULT, &text);
  } else {
    const std::size_t length = H5Tget_size(type);
    if (length > longest_text) return false;
    std::string text(length, '\0');
    if (H5Aread(attribute, type, text.data()) < 0) return false;
    text.resize(std::strlen(text.c_str()));  // ends at the first NUL
    *out = text;
  }
  while (!out->empty() && out->back() == ' ') out->pop_back();
  return true;
}

}  // namespace

PetscErrorCode Hdf5File::text_attribute(const std::string& path, const std::string& name, std::string* out) const {
  Fault fault;

  PetscFunctionBegin;
  out->clear();
  if ((path == "/" || has(path)) && H5Aexists_by_name(file_, path.c_str(), name.c_str(), links_) > 0) {
    const H5 attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, links_), H5Aclose);
    if (!attribute || !read_text(attribute, out))
      fault.note(0, format("%s: attribute %s of %s is not one string; write it as a string", name_.c_str(), name.c_str(),
                           path.c_str()));
  } else if (elsewhere_.second) {
    fault.note(0, fault_of_link(path));
  }
  PetscCall(agree(comm_, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
