// Whether the tables and texts that options name still say what they said: lattices and matrices are compared by the
// model's fingerprint, everything else by its bytes.
#include <fstream>
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/recalled.hpp"
#include "checkpoint/checkpoint.hpp"

namespace bs {
namespace {

const std::string begin = "input_";

/// What the model's fingerprint covers. The text of a scene (.xsp) also sets options.
bool known_to_model(const std::string& option, const std::string& path) {
  if (option == "-bs_lattice_file") return !ends_with(path, ".xsp");
  return option == "-bs_linear_G" || option == "-bs_linear_C" || option == "-bs_linear_B";
}

/// FNV-1a of all bytes; false if it cannot be read.
bool hash_of(const std::string& path, std::uint64_t* sum) {
  std::ifstream in(path, std::ios::binary);
  std::vector<char> piece(1 << 16);
  *sum = 0xcbf29ce484222325u;
  if (!in) return false;
  while (in) {
    in.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    for (std::streamsize k = 0; k < in.gcount(); ++k) *sum = (*sum ^ static_cast<unsigned char>(piece[static_cast<std::size_t>(k)])) * 0x100000001b3u;
  }
  return in.eof();
}

}  // namespace

PetscErrorCode fingerprint_inputs(MPI_Comm comm, Facts* run) {
  PetscMPIInt rank;
  Error fault;
  std::map<std::string, std::uint64_t> sums;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  for (const auto& [option, path] : input_files(comm)) {
    if (path.empty() || known_to_model(option, path)) continue;
    std::uint64_t sum = 0;
    if (rank == 0 && !hash_of(path, &sum)) fault.note(0, "option " + option + ": " + path + " cannot be read any more: put it back");
    PetscCallMPI(MPI_Bcast(&sum, 1, MPI_UINT64_T, 0, comm));
    const auto [at, first] = sums.try_emplace(option, sum);
    if (!first) at->second = 3 * at->second + sum;  // tables of several components: their order counts
  }
  for (const auto& [option, sum] : sums) run->whole[begin + option.substr(1)] = static_cast<std::int64_t>(sum);
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

PetscErrorCode require_same_inputs(MPI_Comm comm, const CheckpointFile& file, const Facts& now) {
  PetscFunctionBegin;
  for (const auto& [name, sum] : now.whole) {
    if (name.compare(0, begin.size(), begin) != 0) continue;
    const std::string option = "-" + name.substr(begin.size());
    const auto was = file.run().whole.find(name);
    if (was == file.run().whole.end() || was->second == sum) continue;
    std::string paths;
    for (const auto& [of, path] : input_files(comm))
      if (of == option) paths += (paths.empty() ? "" : ", ") + path;
    if (is_recalled(comm, option))
      PetscCall(fail(comm, Exit::input,
                     option + " " + paths + ": its contents have changed since " + file.name() + " was written: restore them, or give " + option +
                         " again to continue with the present contents"));
    PetscCall(warn(comm, "the run continues with other contents of " + option + " " + paths + " than when " + file.name() + " was written"));
  }
  PetscFunctionReturn(0);
}

}  // namespace bs
