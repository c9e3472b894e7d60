// String attributes, of fixed or variable length.
#include <cstring>

#include "base/error.hpp"
#include "input/hdf5_file.hpp"

namespace bs {

namespace {

constexpr std::size_t longest_text = 65536;

/// Reads all strings of `attribute`, one behind the other; false if it holds none or cannot be read.
bool read_words(hid_t attribute, std::vector<std::string>* out) {
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

/// The words of a text, split at commas, without blanks around them.
std::vector<std::string> split_at_commas(const std::string& text) {
  std::vector<std::string> words(1);
  for (const char c : text) {
    if (c == ',') words.emplace_back();
    else words.back() += c;
  }
  for (std::string& word : words) {
    const auto first = word.find_first_not_of(' '), last = word.find_last_not_of(' ');
    word = first == std::string::npos ? "" : word.substr(first, last - first + 1);
  }
  return words;
}

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
  Error fault;

  PetscFunctionBegin;
  out->clear();
  if ((path == "/" || has(path)) && H5Aexists_by_name(file_, path.c_str(), name.c_str(), links_) > 0) {
    const H5 attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, links_), H5Aclose);
    if (!attribute || !read_text(attribute, out))
      fault.note(0, format("%s: attribute %s of %s is not one string; write it as a string", name_.c_str(), name.c_str(), path.c_str()));
  } else if (elsewhere_.second) {
    fault.note(0, fault_of_link(path));
  }
  PetscCall(fail_if_any(comm_, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode Hdf5File::words_attribute(const std::string& path, const std::string& name, std::vector<std::string>* out) const {
  Error fault;

  PetscFunctionBegin;
  out->clear();
  if ((path == "/" || has(path)) && H5Aexists_by_name(file_, path.c_str(), name.c_str(), links_) > 0) {
    const H5 attribute(H5Aopen_by_name(file_, path.c_str(), name.c_str(), H5P_DEFAULT, links_), H5Aclose);
    std::vector<std::string> texts;
    if (!attribute || !read_words(attribute, &texts))
      fault.note(0, format("%s: attribute %s of %s is not a list of strings; write it as one", name_.c_str(), name.c_str(), path.c_str()));
    for (const std::string& text : texts)
      for (std::string& word : split_at_commas(text)) out->push_back(std::move(word));
  } else if (elsewhere_.second) {
    fault.note(0, fault_of_link(path));
  }
  PetscCall(fail_if_any(comm_, fault));
  PetscFunctionReturn(0);
}

}  // namespace bs
