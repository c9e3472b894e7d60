#include "cli/command_line.hpp"
#include <petscsys.h>
#include <yaml.h>
#include <cctype>
#include <cstdlib>
#include <iterator>
#include <memory>
#include <sstream>
#include "base/text.hpp"

namespace bs {

namespace {

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
    const std::string name(reinterpret_cast<const char*>(key.data.scalar.value), key.data.scalar.length);
    if (name.rfind("options_file", 0) == 0) return at(key) + "PETSc reads no option file that a YAML file names; name it on the command line";
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
