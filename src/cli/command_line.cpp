#include "cli/command_line.hpp"
#include <petscsys.h>
#include <yaml.h>
#include <algorithm>
#include <cctype>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>
#include "base/text.hpp"

namespace bs {

namespace {

bool is_option(const std::string& word) {
  PetscBool valid = PETSC_FALSE;
  (void)PetscOptionsValidKey(word.c_str(), &valid);
  return valid;
}

/// PETSc options are mappings of names to scalars, sequences of scalars, or further mappings.
/// `budget` counts down the nodes that may still be visited, `levels` those within one another: aliases can make a small file endless.
std::string fault_of_node(yaml_document_t* document, const yaml_node_t& node, bool in_sequence, int levels, int* budget) {
  const auto at = [](const yaml_node_t& there) { return format(" line %zu: ", there.start_mark.line + 1); };
  if (--*budget < 0 || levels < 0)
    return at(node) + "more than 10000 entries, more than 100 within one another, or aliases that never end; write each option once";
  if (node.type == YAML_SCALAR_NODE) return {};
  if (in_sequence) return at(node) + "a list in a list; write lists of numbers or words, like [0, -9.81]";
  if (node.type == YAML_SEQUENCE_NODE) {
    for (const yaml_node_item_t* item = node.data.sequence.items.start; item < node.data.sequence.items.top; ++item) {
      const std::string fault = fault_of_node(document, *yaml_document_get_node(document, *item), true, levels - 1, budget);
      if (!fault.empty()) return fault;
    }
    return {};
  }
  std::map<std::string, std::size_t> lines;
  for (const yaml_node_pair_t* pair = node.data.mapping.pairs.start; pair < node.data.mapping.pairs.top; ++pair) {
    const yaml_node_t& key = *yaml_document_get_node(document, pair->key);
    if (key.type != YAML_SCALAR_NODE) return at(key) + "a name must be a word; write 'name: value'";
    const std::string name(reinterpret_cast<const char*>(key.data.scalar.value), key.data.scalar.length);
    const std::size_t dashes = name.find_first_not_of('-');
    if (dashes > 0 && dashes < name.size())
      return at(key) + "'" + name + "': names stand without their dash; write '" + name.substr(dashes) + ": value'";
    if (name.rfind("options_file", 0) == 0) return at(key) + "PETSc reads no option file that a YAML file names; name it on the command line";
    const auto [first, once] = lines.try_emplace(lower(name), key.start_mark.line + 1);
    if (!once && name != "<<" && name.rfind("$$", 0) != 0)  // mappings that are merged; PETSc's mark of remarks
      return at(key) + "'" + name + format("' stands in line %zu already; write each option once", first->second);
    const std::string fault = fault_of_node(document, *yaml_document_get_node(document, pair->value), false, levels - 1, budget);
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
  else if (root) fault = fault_of_node(&document, *root, false, 100, &budget);
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

/// PETSc takes an option of its own that wants a number or a name and has none for one that is not given.
static bool needs_value(const std::string& name) {
  static const char* const ends[] = {"_dt",   "_time_step", "_init_time", "_max_time", "_max_steps", "_rtol",
                                     "_atol", "_stol",      "_divtol",    "_max_it",   "_type",      "_max_reject"};
  return name.rfind("-bs_", 0) != 0 && std::any_of(std::begin(ends), std::end(ends), [&](const std::string& end) {
           return name.size() > end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
         });
}

std::string fault_of_form(const std::vector<std::string>& words) {
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::string& word = words[k];
    if (is_option(word) && needs_value(word) && (k + 1 == words.size() || is_option(words[k + 1])))
      return "option " + word + " needs a value: write it behind the name, with a blank between them";
    const std::size_t dashes = word.find_first_not_of('-'), equals = word.find('=');
    if (dashes == 0 || dashes == std::string::npos || !std::isalpha(static_cast<unsigned char>(word[dashes]))) continue;
    const std::string name = "-" + word.substr(dashes, equals == std::string::npos ? equals : equals - dashes);
    if (equals != std::string::npos)
      return "'" + word + "': an option and its value are separated by a blank: write " + name + " " + word.substr(equals + 1);
    if (dashes > 1) return "'" + word + "': options begin with one dash: write " + name;
  }
  return {};
}

namespace {

std::string collected;
std::size_t own = std::string::npos;                                       ///< length of what was collected of the run that was asked for
PetscErrorCode (*printing)(FILE*, const char[], va_list) = PetscVFPrintf;  // PETSc's own

// Every text of PETSc, also that of its lists of types, comes through here on the rank that prints.
PetscErrorCode collect(FILE* file, const char* format, va_list arguments) {
  size_t length = 0;
  PetscFunctionBegin;
  if (file != stdout) {
    PetscCall(printing(file, format, arguments));
    PetscFunctionReturn(0);
  }
  std::vector<char> text(64 * 1024);
  PetscCall(PetscVSNPrintf(text.data(), text.size(), format, &length, arguments));
  collected += text.data();
  PetscFunctionReturn(0);
}

/// A title begins a section: it stands at the margin and ends with a colon.
bool is_title(const std::string& line) { return !line.empty() && line[0] != ' ' && line[0] != '-' && line.back() == ':'; }

std::vector<std::string> sections_of(const std::string& text) {
  std::vector<std::string> sections(1);
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = text.find('\n', begin);
    if (end == std::string::npos) end = text.size();
    const std::string line = text.substr(begin, end - begin);
    if (is_title(line)) sections.emplace_back();
    sections.back() += line + "\n";
    begin = end + 1;
  }
  return sections;
}

void print(const std::string& text) {
  std::string shown = text;
  for (std::size_t at; (at = shown.find("\n----------------------------------------\n")) != std::string::npos;) shown.erase(at + 1, 41);
  std::fputs(shown.c_str(), stdout);
}

/// A section without the program's options in `seen`, to which it adds those that are left; empty where none is.
std::string unseen(const std::string& section, std::set<std::string>* seen) {
  std::string out, rest = section, kept;
  std::size_t end;
  for (bool first = true; (end = rest.find('\n')) != std::string::npos; rest.erase(0, end + 1), first = false) {
    const std::string line = rest.substr(0, end + 1);
    const bool option = line.compare(0, 6, "  -bs_") == 0;
    if (!option && !first) continue;
    if (!option) out = line;
    else if (seen->insert(line.substr(0, line.find(": "))).second) kept += line;
  }
  return kept.empty() ? kept : out + kept;
}

}  // namespace

void translate_common_flags(int argc, char** argv) {
  static char help[] = "-help", version[] = "-bs_version";
  for (int k = 1; k < argc; ++k) {
    if (std::strcmp(argv[k], "--help") == 0 || std::strcmp(argv[k], "-h") == 0) argv[k] = help;
    if (std::strcmp(argv[k], "--version") == 0) argv[k] = version;
  }
}

void collect_help(int argc, const char* const* argv) {
  for (int k = 1; k < argc; ++k)
    if (std::strcmp(argv[k], "-help") == 0) PetscVFPrintf = collect;
}

void collect_help_of_others() {
  if (own == std::string::npos) own = collected.size();
}

void print_help() {
  PetscVFPrintf = printing;
  if (collected.empty()) return;
  std::set<std::string> seen;
  const std::vector<std::string> sections = sections_of(collected.substr(0, own));
  print(sections[0].substr(0, sections[0].find("\n----")) + "\n");
  for (std::size_t k = 1; k < sections.size(); ++k)
    if (sections[k].find("\n  -bs_") != std::string::npos) print(unseen(sections[k], &seen));
  for (const std::string& section : sections_of(own < collected.size() ? collected.substr(own) : std::string())) print(unseen(section, &seen));
  std::puts(
      "\nOptions of PETSc that this run can use (https://petsc.org has their "
      "manual)\n===========================================================================");
  for (std::size_t k = 1; k < sections.size(); ++k)
    if (sections[k].find("\n  -bs_") == std::string::npos) print(sections[k]);
  collected.clear();
}

}  // namespace bs
