#include "base/command_line.hpp"

#include <petscsys.h>
#include <sys/stat.h>
#include <yaml.h>

#include <cctype>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <sstream>

#include "base/format.hpp"

namespace bs {

namespace {

bool ends_with(const std::string& text, const std::string& tail) {
  return text.size() >= tail.size() && text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

bool is_option(const std::string& word) {
  PetscBool valid = PETSC_FALSE;
  (void)PetscOptionsValidKey(word.c_str(), &valid);
  return valid;
}

/// PETSc options are mappings of names to scalars, sequences of scalars, or further mappings.
/// `budget` counts down the nodes that may still be visited: aliases can make a small file endless.
std::string fault_of_node(yaml_document_t* document, const yaml_node_t& node, bool in_sequence, int* budget) {
  const auto at = [](const yaml_node_t& there) { return format(" line %zu: ", there.start_mark.line + 1); };
  if (--*budget < 0) return at(node) + "more than 10000 entries, or aliases that never end; write each option once";
  if (node.type == YAML_SCALAR_NODE) return {};
  if (in_sequence) return at(node) + "a list in a list; write lists of numbers or words, like [0, -9.81]";
  if (node.type == YAML_SEQUENCE_NODE) {
    for (const yaml_node_item_t* item = node.data.sequence.items.start; item < node.data.sequence.items.top; ++item) {
      const std::string fault = fault_of_node(document, *yaml_document_get_node(document, *item), true, budget);
      if (!fault.empty()) return fault;
    }
    return {};
  }
  for (const yaml_node_pair_t* pair = node.data.mapping.pairs.start; pair < node.data.mapping.pairs.top; ++pair) {
    const yaml_node_t& key = *yaml_document_get_node(document, pair->key);
    if (key.type != YAML_SCALAR_NODE) return at(key) + "a name must be a word; write 'name: value'";
    const std::string fault = fault_of_node(document, *yaml_document_get_node(document, pair->value), false, budget);
    if (!fault.empty()) return fault;
  }
  return {};
}

struct ParserDelete {
  void operator()(yaml_parser_t* parser) const {
    yaml_parser_delete(parser);
    delete parser;
  }
};

struct OptionFile {
  std::string path;
  bool yaml;
};

std::vector<OptionFile> option_files(const std::vector<std::string>& words) {
  std::vector<OptionFile> files;
  for (std::size_t k = 0; k + 1 < words.size(); ++k) {
    if (words[k] != "-options_file" && words[k] != "-options_file_yaml") continue;
    const std::string& path = words[++k];
    files.push_back({path, words[k - 1] == "-options_file_yaml" || ends_with(path, ".yaml") || ends_with(path, ".yml")});
  }
  return files;
}

std::string fault_of_file(const OptionFile& file) {
  struct stat info = {};
  const char* const name = file.path.c_str();
  if (file.path.empty() || file.path[0] == '$' || file.path[0] == '~') return {};  // PETSc resolves these
  if (stat(name, &info) != 0) {
    if (errno == ENOENT) return format("option file %s: no such file; check the path, which is relative to the folder in which the run starts", name);
    return format("option file %s: cannot be read (%s)", name, std::strerror(errno));
  }
  if (S_ISDIR(info.st_mode)) return format("option file %s: is a folder; name a file in it", name);
  std::ifstream in(file.path, std::ios::binary);
  if (!in) return format("option file %s: cannot be opened; check its permissions (chmod +r)", name);
  if (!file.yaml || !S_ISREG(info.st_mode)) return {};
  return fault_of_yaml(std::string(std::istreambuf_iterator<char>(in), {}), "option file " + file.path);
}

}  // namespace

std::string fault_of_yaml(const std::string& text, const std::string& name) {
  const std::unique_ptr<yaml_parser_t, ParserDelete> parser(new yaml_parser_t());
  if (!yaml_parser_initialize(parser.get())) return name + ": not enough memory to read it";
  yaml_parser_set_input_string(parser.get(), reinterpret_cast<const unsigned char*>(text.data()), text.size());
  yaml_document_t document;
  if (!yaml_parser_load(parser.get(), &document))
    return name + format(" line %zu: not valid YAML (%s); write 'name: value' a line, lists as [1, 2]", parser->problem_mark.line + 1,
                         parser->problem ? parser->problem : "no reason given");
  std::string fault;
  int budget = 10000;
  yaml_node_t* const root = yaml_document_get_root_node(&document);
  if (root && root->type != YAML_MAPPING_NODE)
    fault = format(" line %zu: holds no options; write 'name: value' a line, the name without its dash", root->start_mark.line + 1);
  else if (root) fault = fault_of_node(&document, *root, false, &budget);
  yaml_document_delete(&document);
  return fault.empty() ? fault : name + fault;
}

std::string fault_of_option_files(int argc, const char* const* argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  const std::vector<std::string> more = words_of_environment();
  words.insert(words.end(), more.begin(), more.end());
  for (const OptionFile& file : option_files(words)) {
    const std::string fault = fault_of_file(file);
    if (!fault.empty()) return fault;
  }
  return {};
}

std::vector<std::string> stray_words(const std::vector<std::string>& words) {
  std::vector<std::string> stray;
  for (std::size_t k = 0; k < words.size(); ++k) {
    if (!is_option(words[k])) stray.push_back(words[k]);
    else if (k + 1 < words.size() && !is_option(words[k + 1])) ++k;  // its value
  }
  return stray;
}

std::string fault_of_form(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    const std::size_t dashes = word.find_first_not_of('-'), equals = word.find('=');
    if (dashes == 0 || dashes == std::string::npos || !std::isalpha(static_cast<unsigned char>(word[dashes]))) continue;
    const std::string name = "-" + word.substr(dashes, equals == std::string::npos ? equals : equals - dashes);
    if (equals != std::string::npos)
      return "'" + word + "': an option and its value are separated by a blank: write " + name + " " + word.substr(equals + 1);
    if (dashes > 1) return "'" + word + "': options begin with one dash: write " + name;
  }
  return {};
}

std::vector<std::string> words_of_environment() {
  const char* const more = std::getenv("PETSC_OPTIONS");
  std::istringstream in(more ? more : "");
  return {std::istream_iterator<std::string>(in), {}};
}

}  // namespace bs
