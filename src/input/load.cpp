#include "input/load.hpp"
#include <strings.h>
#include "base/collective.hpp"
#include "base/error.hpp"
#include "base/find_file.hpp"
#include "base/option_names.hpp"
#include "base/options.hpp"
#include "input/adjust.hpp"
#include "input/dilution.hpp"
#include "input/hdf5_layout.hpp"
#include "input/remote.hpp"
#include "lattice/generator.hpp"
#include "lattice/xsp.hpp"
#include "network/migrate.hpp"

namespace bs {

namespace {

/// Everything the options say about the lattice.
struct LatticeOptions {
  std::string file;
  bool file_given = false, width_given = false, height_given = false;
  double width = XSP_WIDTH, height = XSP_HEIGHT;  ///< window of an .xsp scene
  SpringOptions springs;
  GeneratorSpec generator;
  AnchorSpec anchors;
  GroupTexts groups;

  void read(Section& section);
};

void LatticeOptions::read(Section& section) {
  file_given = section.file("-bs_lattice_file", "lattice file to read: HDF5 (.h5, .hdf5, .h5md) or XSpringies (.xsp)", file);
  springs.read(section);
  width_given = section.real("-bs_lattice_width", "width of the window of an .xsp scene [pixel]", width, Range::positive);
  height_given = section.real("-bs_lattice_height", "height of the window of an .xsp scene [pixel]", height, Range::positive);
  generator.options(section);
  anchors.options(section);
  read_group_options(section, &groups);
}

bool has_suffix(const std::string& text, const char* ending) {
  const std::size_t length = std::char_traits<char>::length(ending);
  return text.size() > length && strcasecmp(text.c_str() + text.size() - length, ending) == 0;
}

/// -help without a lattice must get as far as the options of the laws and the solver: two particles stand in.
void stand_in_for_help(LatticeOptions* options) {
  if (!is_given("-help") || options->file_given || options->generator.type != LatticeType::none) return;
  options->generator.type = LatticeType::chain;
  if (options->generator.size.empty()) options->generator.size = {2};
}

/// One source, and one only.
PetscErrorCode check_source(MPI_Comm comm, const LatticeOptions& options) {
  const bool generated = options.generator.type != LatticeType::none;
  PetscFunctionBegin;
  if (options.file_given && options.file.empty()) PetscCall(fail(comm, Exit::input, "-bs_lattice_file names no file; write its path"));
  if (options.file_given && generated)
    PetscCall(fail(comm, Exit::input,
                   format("-bs_lattice_file %s and -bs_lattice_type %s are both given; write one of them", options.file.c_str(),
                          type_info(options.generator.type).name)));
  if (!options.file_given && !generated)
    PetscCall(fail(comm, Exit::input,
                   "no lattice is given; write -bs_lattice_file FILE (.h5, .xsp) or "
                   "-bs_lattice_type chain|square|triangular|cloth|cubic|bcc|fcc|kagome|honeycomb|diamond"));
  PetscFunctionReturn(0);
}

PetscErrorCode load_generated(MPI_Comm comm, const LatticeOptions& options, Lattice* out) {
  PetscFunctionBegin;
  GeneratorSpec spec = options.generator;
  const std::string fault = check(spec);
  if (!fault.empty()) PetscCall(fail(comm, Exit::input, fault));
  PetscCall(parse_groups(comm, options.groups, dimension(spec), type_info(spec.type).axes, particle_count(spec), &spec.groups));
  const std::string name = std::string("-bs_lattice_type ") + type_info(spec.type).name;
  PetscCall(check_sizes(comm, name, particle_count(spec), dimension(spec), spring_count(spec), 0));
  PetscCall(reserve_lattice(comm, name, {particle_count(spec), spring_count(spec), 0, dimension(spec)}));
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  *out = generate(spec, rank, size);
  PetscCall(remove_springs(comm, spec, out));
  if (spec.prune != PruneRule::none && !options.anchors.particles.empty())
    PetscCall(fail(comm, Exit::input,
                   "-bs_anchor_particles with -bs_lattice_prune: rows change when particles are left out; write -bs_group_NAME ids:... and "
                   "-bs_anchor_group NAME"));
  PetscCall(prune_particles(comm, spec, out));
  PetscFunctionReturn(0);
}

PetscErrorCode load_xsp(MPI_Comm comm, const LatticeOptions& options, Lattice* out) {
  std::string text, error;
  Lattice whole;
  PetscFunctionBegin;
  PetscCall(read_text_file(comm, options.file, &text));
  if (!parse_xsp(text, options.file, options.width, options.height, &whole, &error)) PetscCall(fail(comm, Exit::input, error));
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  *out = chunk_of(whole, rank, size);
  PetscFunctionReturn(0);
}

/// What options change of a lattice that stands.
PetscErrorCode adjust(MPI_Comm comm, const LatticeOptions& options, Lattice* out) {
  GeneratorSpec spec = options.generator;
  PetscFunctionBegin;
  PetscCall(warn_of_idle_options(comm, out->source));
  PetscCall(parse_groups(comm, options.groups, out->dim, out->dim, out->particles.total, &spec.groups));
  PetscCall(adjust_lattice(comm, spec, out));
  PetscFunctionReturn(0);
}

PetscErrorCode load_given(MPI_Comm comm, const LatticeOptions& options, const Lattice& given, Lattice* out) {
  PetscFunctionBegin;
  if (options.file_given || options.generator.type != LatticeType::none)
    PetscCall(fail(comm, Exit::input, "-bs_lattice_file or -bs_lattice_type is given beside a lattice in memory: leave it out"));
  PetscCall(check_sizes(comm, given.source, given.particles.total, given.dim, given.springs.total, given.anchors.total));
  const PetscMPIInt rank = rank_of(comm), size = size_of(comm);
  *out = chunk_of(given, rank, size);
  PetscCall(check_shifts(comm, out));
  PetscCall(adjust(comm, options, out));
  PetscFunctionReturn(0);
}

PetscErrorCode load_file(MPI_Comm comm, const LatticeOptions& options, Lattice* out) {
  const std::string& file = options.file;
  const int dim = options.generator.dim;
  const bool xsp = has_suffix(file, ".xsp");
  PetscFunctionBegin;
  if (dim < 0) PetscCall(fail(comm, Exit::input, "-bs_lattice_dim: write 1, 2 or 3"));
  if (xsp) PetscCall(load_xsp(comm, options, out));
  else if (has_suffix(file, ".h5") || has_suffix(file, ".hdf5") || has_suffix(file, ".h5md")) PetscCall(read_hdf5_lattice(comm, file, out));
  else
    PetscCall(fail(comm, Exit::input,
                   file + ": unknown ending; lattices are read from .h5, .hdf5, .h5md and .xsp files; "
                          "postprocess/convert.py makes an .h5 of Gmsh, VTK, VTU, OBJ, PLY, STL and LAMMPS data"));
  if (dim > 0 && dim != out->dim)
    PetscCall(fail(comm, Exit::input, format("%s: -bs_lattice_dim %d: the file has d = %d; leave the option out", file.c_str(), dim, out->dim)));
  if (!xsp && (options.width_given || options.height_given))
    PetscCall(warn(comm, "ignored_options", file + ": -bs_lattice_width and -bs_lattice_height are for .xsp files: ignored"));
  PetscCall(adjust(comm, options, out));
  PetscFunctionReturn(0);
}

/// Options the input implies, where the user set none.
PetscErrorCode put_implied_options(const Lattice& lattice) {
  PetscFunctionBegin;
  for (const auto& [name, value] : lattice.implied_options)
    if (!is_given(name)) PetscCall(PetscOptionsSetValue(nullptr, name.c_str(), value.c_str()));
  PetscFunctionReturn(0);
}

/// Numbers, laws, anchors and checks, whatever the source.
PetscErrorCode complete(MPI_Comm comm, const LatticeOptions& options, Lattice* out) {
  PetscFunctionBegin;
  PetscCall(check_groups(comm, *out));
  PetscCall(require_groups(comm, "-bs_lattice_fixed_groups", options.generator.fixed_groups, *out));
  PetscCall(number_rows(comm, &out->springs));
  PetscCall(number_rows(comm, &out->anchors));
  for (InteractionRows& kind : out->interactions) PetscCall(number_rows(comm, &kind.rows));
  PetscCall(apply_spring_options(comm, options.springs, out));
  PetscCall(add_anchors(comm, options.anchors, out));
  PetscCall(choose_images(comm, out));
  PetscCall(validate(comm, out));
  if (options.generator.type == LatticeType::none && options.generator.perturbation > 0) {
    perturb(options.generator, out);
    PetscCall(validate(comm, out));  // ends that meet
  }
  PetscCall(check_rest_lengths(comm, *out));
  for (const std::string& warning : out->warnings) PetscCall(warn(comm, "ignored_input", warning));
  PetscCall(put_implied_options(*out));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode load_lattice(MPI_Comm comm, Lattice* out, const Lattice* given) {
  LatticeOptions options;
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Lattice: particles and springs", [&options](Section& s) { options.read(s); }));
  if (!given) {
    stand_in_for_help(&options);
    PetscCall(check_source(comm, options));
  }
  if (given) PetscCall(load_given(comm, options, *given, out));
  else if (options.file_given) PetscCall(load_file(comm, options, out));
  else PetscCall(load_generated(comm, options, out));
  PetscCall(complete(comm, options, out));
  PetscFunctionReturn(0);
}

}  // namespace bs
