#include "output/h5.hpp"
#include <algorithm>
#include <cstring>
#include "base/error.hpp"
#include "base/memory.hpp"

namespace bs {

std::string h5_reason() {
  const std::string text = h5_words();
  return text.empty() ? "HDF5 gives no reason" : text;
}

/// H5Lexists takes one level at a time.
bool h5_exists(hid_t file, const std::string& path) {
  for (std::size_t at = path.find('/', 1); at != std::string::npos; at = path.find('/', at + 1))
    if (H5Lexists(file, path.substr(0, at).c_str(), H5P_DEFAULT) <= 0) return false;
  return H5Lexists(file, path.c_str(), H5P_DEFAULT) > 0;
}

// From 1.12 on in two steps.
herr_t find_h5_header(hid_t object, haddr_t* at) {
#if H5_VERSION_GE(1, 12, 0)
  H5O_info2_t info;
  return H5Oget_info3(object, &info, H5O_INFO_BASIC) < 0 ? -1 : H5VLnative_token_to_addr(object, info.token, at);
#else
  H5O_info_t info;
  if (H5Oget_info2(object, &info, H5O_INFO_BASIC) < 0) return -1;
  *at = info.addr;
  return 0;
#endif
}

std::string fixed_text(hid_t file, const char* object, const char* name) {
  if (H5Aexists_by_name(file, object, name, H5P_DEFAULT) <= 0) return {};
  const H5 attribute(H5Aopen_by_name(file, object, name, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  const H5 type(attribute >= 0 ? H5Aget_type(attribute) : -1, H5Tclose), space(attribute >= 0 ? H5Aget_space(attribute) : -1, H5Sclose);
  if (type < 0 || space < 0 || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || H5Sget_simple_extent_npoints(space) != 1)
    return {};
  std::string text(std::min<std::size_t>(H5Tget_size(type), 65536), '\0');
  if (H5Tget_size(type) > text.size() || H5Aread(attribute, type, text.data()) < 0) return {};
  return text.substr(0, text.find('\0'));
}

PetscErrorCode open_group(hid_t file, const std::string& path, H5* group) {
  PetscFunctionBegin;
  // H5Lexists takes one level at a time; "/" is always there.
  for (std::size_t at = path.find('/', 1); path.size() > 1; at = path.find('/', at + 1)) {
    const std::string part = path.substr(0, at);
    const htri_t exists = H5Lexists(file, part.c_str(), H5P_DEFAULT);
    BS_H5(exists);
    if (!exists) {
      H5 made(H5Gcreate2(file, part.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
      BS_H5(made);
    }
    if (at == std::string::npos) break;
  }
  *group = H5(H5Gopen2(file, path.c_str(), H5P_DEFAULT), H5Gclose);
  BS_H5(*group);
  PetscFunctionReturn(0);
}

/// `count` values of one attribute; 0: a single one, without axes.
static PetscErrorCode put(hid_t object, const char* name, hid_t type, hid_t memory, const void* data, hsize_t count = 0) {
  PetscFunctionBegin;
  H5 space(count > 0 ? H5Screate_simple(1, &count, nullptr) : H5Screate(H5S_SCALAR), H5Sclose);
  H5 attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  BS_H5(attribute);
  BS_H5(H5Awrite(attribute, memory, data));
  PetscFunctionReturn(0);
}

PetscErrorCode put_attribute(hid_t object, const char* name, const std::vector<std::int32_t>& values) {
  return put(object, name, H5T_STD_I32LE, H5T_NATIVE_INT32, values.data(), values.size());
}

PetscErrorCode put_attribute(hid_t object, const char* name, std::int64_t value) {
  return put(object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
}

PetscErrorCode put_attribute(hid_t object, const char* name, double value) { return put(object, name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value); }

PetscErrorCode put_attribute(hid_t object, const char* name, const std::string& value) {
  const char* text = value.c_str();
  PetscFunctionBegin;
  H5 type(H5Tcopy(H5T_C_S1), H5Tclose);
  BS_H5(H5Tset_size(type, H5T_VARIABLE));
  BS_H5(H5Tset_cset(type, H5T_CSET_UTF8));
  PetscCall(put(object, name, type, type, &text));
  PetscFunctionReturn(0);
}

PetscErrorCode put_text(hid_t object, const char* name, const std::string& value) {
  PetscFunctionBegin;
  H5 type(H5Tcopy(H5T_C_S1), H5Tclose);
  BS_H5(H5Tset_size(type, std::max<std::size_t>(1, value.size())));
  BS_H5(H5Tset_strpad(type, H5T_STR_NULLPAD));
  BS_H5(H5Tset_cset(type, H5T_CSET_UTF8));
  PetscCall(put(object, name, type, type, value.c_str()));
  PetscFunctionReturn(0);
}

PetscErrorCode put_words(hid_t object, const char* name, const std::vector<std::string>& words) {
  std::size_t width = 1;
  std::string all;
  PetscFunctionBegin;
  for (const std::string& word : words) width = std::max(width, word.size());
  for (std::string word : words) {
    word.resize(width, '\0');
    all += word;
  }
  H5 type(H5Tcopy(H5T_C_S1), H5Tclose);
  BS_H5(H5Tset_size(type, width));
  BS_H5(H5Tset_strpad(type, H5T_STR_NULLPAD));
  PetscCall(put(object, name, type, type, all.data(), words.size()));
  PetscFunctionReturn(0);
}

PetscErrorCode put_reference(hid_t file, hid_t object, const char* name, const std::string& path) {
  hobj_ref_t reference;
  PetscFunctionBegin;
  BS_H5(H5Rcreate(&reference, file, path.c_str(), H5R_OBJECT, -1));
  PetscCall(put(object, name, H5T_STD_REF_OBJ, H5T_STD_REF_OBJ, &reference));
  PetscFunctionReturn(0);
}

IoWatch::IoWatch(MPI_Comm comm, std::string before, std::string after) : comm_(comm), before_(std::move(before)), after_(std::move(after)) {
  (void)PetscPushErrorHandler(handle, this);
}

IoWatch::~IoWatch() { (void)PetscPopErrorHandler(); }

PetscErrorCode IoWatch::handle(MPI_Comm, int, const char*, const char*, PetscErrorCode code, PetscErrorType type, const char* message, void* watch) {
  auto* self = static_cast<IoWatch*>(watch);
  PetscMPIInt size = 1;
  if (code == ERR_FAILED || type != PETSC_ERROR_INITIAL || !self->reason_.empty()) return code;
  const bool bare = !message || std::strstr(message, "Error in HDF5 call");
  self->reason_ = bare ? h5_reason() : std::string(message, std::strcspn(message, "\n"));
  self->reason_ += if_out_of_memory();
  MPI_Comm_size(self->comm_, &size);
  return size > 1 ? fail_here(self->comm_, Exit::io, self->sentence(self->reason_)) : code;
}

PetscErrorCode IoWatch::report(MPI_Comm comm, PetscErrorCode code) const {
  if (code == 0 || code == ERR_FAILED) return code;
  return fail(comm, Exit::io, sentence(reason_.empty() ? "unknown error" : reason_));
}

}  // namespace bs
