// A vector as text, one number a line. No PETSc.
#pragma once
#include <string>
#include <vector>

namespace bs {

/// Reads the CSV form of a vector: a number a line, or `name,value`; a first line without a number is a header. `name` is
/// the file's, for messages. Returns one line of error, empty if all is well; values are finite, and there are as many
/// names as values, or none.
std::string read_vector_csv(const std::string& text, const std::string& name, std::vector<double>* values, std::vector<std::string>* names);

}  // namespace bs
