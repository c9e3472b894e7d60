#include "tasks/generate.hpp"
#include <algorithm>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "lattice/spring_laws.hpp"
#include "output/fresh_file.hpp"
#include "output/progress.hpp"
#include "output/report.hpp"
#include "output/tables.hpp"
#include "systems/create.hpp"
#include "systems/particles/lattice_tables.hpp"
#include "tasks/run_options.hpp"
#include "tasks/unused_options.hpp"

namespace bs {
namespace {

constexpr const char* TASK = "-bs_task generate";

PetscErrorCode check_name(MPI_Comm comm, const std::string& file) {
  const std::string ending = lower(file);
  PetscFunctionBegin;
  if (file.empty()) PetscCall(fail(comm, Exit::input, std::string(TASK) + " writes a lattice file: give its name by -bs_output F.h5"));
  if (!ends_with(ending, ".h5") && !ends_with(ending, ".hdf5"))
    PetscCall(fail(comm, Exit::input, "option -bs_output " + file + ": names of lattice files end in .h5 or .hdf5: give such a name"));
  PetscFunctionReturn(0);
}

/// How many there are of what the lattice is made of, by name.
PetscErrorCode count_parts(MPI_Comm comm, const Lattice& l, std::vector<std::pair<std::string, std::int64_t>>* out) {
  std::int64_t fixed = std::count(l.fixed.begin(), l.fixed.end(), 1);
  PetscFunctionBegin;
  PetscCall(sum_over_ranks(comm, &fixed));
  *out = {{"particle", l.particles.total}, {"fixed particle", fixed}, {"spring", l.springs.total}, {"anchor", l.anchors.total}};
  for (std::size_t kind = 0; kind < l.interactions.size(); ++kind)
    out->emplace_back(interaction_schemas()[kind].title, l.interactions[kind].rows.total);
  PetscFunctionReturn(0);
}

struct LatticeFile {
  std::vector<Dataset> tables;
  std::vector<std::pair<std::string, std::string>> root;
  std::vector<std::string> boundary;  ///< words along the edges of the box; empty: there is none
};

PetscErrorCode take_file(MPI_Comm comm, Lattice* l, LatticeFile* out) {
  PetscFunctionBegin;
  out->root = root_attributes(*l);
  for (int k = 0; k < l->dim && l->box.active(); ++k) out->boundary.emplace_back(l->box.periodic[k] ? "periodic" : "none");
  PetscCall(take_tables(comm, hdf5_layout(false), l, &out->tables));
  for (const Dataset& table : out->tables) PetscCall(require_finite(comm, table));
  PetscFunctionReturn(0);
}

PetscErrorCode fill(hid_t file, const LatticeFile& lattice) {
  H5 root, box;
  PetscFunctionBegin;
  for (const Dataset& table : lattice.tables) PetscCall(write_table(file, table));
  PetscCall(open_group(file, "/", &root));
  for (const auto& [name, text] : lattice.root) PetscCall(put_attribute(root, name.c_str(), text));
  if (lattice.boundary.empty()) PetscFunctionReturn(0);
  PetscCall(open_group(file, "/box", &box));
  PetscCall(put_attribute(box, "dimension", static_cast<std::int64_t>(lattice.boundary.size())));
  PetscCall(put_words(box, "boundary", lattice.boundary));
  PetscFunctionReturn(0);
}

/// The name goes to the file once it is whole and on disk.
PetscErrorCode write_file(MPI_Comm comm, const std::string& file, bool overwrite, const LatticeFile& lattice) {
  const std::string target = real_name(file);
  PetscFunctionBegin;
  const IoWatch watch(comm, "cannot write the lattice " + file, "");
  PetscCall(write_whole_hdf5(
      comm, watch, target, table_bytes(lattice.tables), [&](hid_t to) { return fill(to, lattice); },
      [&](const std::string& made) { return give_name(made, target, overwrite); }));
  PetscFunctionReturn(0);
}

PetscErrorCode report(MPI_Comm comm, const OutputSettings& settings, const Lattice& l, const std::vector<std::pair<std::string, std::int64_t>>& parts,
                      double wall, const std::vector<std::string>& warnings) {
  Report report;
  PetscFunctionBegin;
  const PetscMPIInt size = size_of(comm);
  report.set("outcome", "ok");
  report.set("reason", "");
  report.set("task", "generate");
  report.set("ranks", static_cast<std::int64_t>(size));
  report.set("source", l.source);
  report.set("dimension", static_cast<std::int64_t>(l.dim));
  for (const auto& [name, count] : parts) {
    std::string key = name + "s";
    std::replace(key.begin(), key.end(), ' ', '_');
    report.set(key, count);
  }
  report.set("wall", wall);
  report.set("warnings", warnings);
  PetscCall(report.write(comm, settings.report, settings.trajectory.overwrite));
  PetscFunctionReturn(0);
}

/// "8 particles (2 fixed) in 2 dimensions, 12 springs, from SOURCE"
std::string describe(const Lattice& l, const std::vector<std::pair<std::string, std::int64_t>>& parts) {
  std::string text =
      how_many(parts[0].second, parts[0].first) + format(" (%lld fixed) in ", static_cast<long long>(parts[1].second)) + how_many(l.dim, "dimension");
  for (std::size_t k = 2; k < parts.size(); ++k)
    if (k == 2 || parts[k].second > 0) text += ", " + how_many(parts[k].second, parts[k].first);
  return text + ", from " + l.source;
}

}  // namespace

PetscErrorCode write_lattice(MPI_Comm comm, const Lattice* given) {
  RunOptions options;
  OutputLocks locks;
  Lattice lattice;
  LatticeFile file;
  const Warnings warnings(comm);
  std::vector<std::pair<std::string, std::int64_t>> parts;
  PetscFunctionBegin;
  if (is_given("-bs_checkpoint") || is_given("-bs_restart"))
    PetscCall(fail(comm, Exit::input, std::string("options -bs_checkpoint and -bs_restart: ") + TASK + " has no steps to save: leave them out"));
  PetscCall(load_particles(comm, TASK, &lattice, given));
  for (const auto& [name, value] : lattice.implied_options) (void)is_given(name);  // the file keeps them
  PetscCall(read_file_options(comm, &options.output));
  PetscCall(read_program_options(comm));
  if (is_given("-help")) PetscFunctionReturn(0);
  options.output.trajectory.xdmf = false;
  const std::string& name = options.output.trajectory.file;
  PetscCall(check_name(comm, name));
  PetscCall(warn_of_run_options(comm));
  PetscCall(lock_outputs(comm, options, &locks));
  const Progress progress(comm, -1);
  PetscCall(count_parts(comm, lattice, &parts));
  progress.header({program_line(comm), describe(lattice, parts)});
  PetscCall(remove_earlier_results(comm));
  PetscCall(take_file(comm, &lattice, &file));
  set_phase(comm, Exit::io);
  PetscCall(write_file(comm, name, options.output.trajectory.overwrite, file));
  PetscCall(report(comm, options.output, lattice, parts, progress.wall(), warnings.keys()));
  progress.header({"backspring: ok lattice=" + name + format(" wall=%.3f", progress.wall()) + counted(warnings.keys().size())});
  PetscFunctionReturn(0);
}

}  // namespace bs
