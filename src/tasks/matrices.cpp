#include "tasks/matrices.hpp"
#include <petscviewer.h>
#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>
#include "base/collective.hpp"
#include "base/context.hpp"
#include "base/error.hpp"
#include "base/handle.hpp"
#include "base/options.hpp"
#include "output/fresh_file.hpp"
#include "systems/frame_rows.hpp"
#include "systems/mechanics.hpp"

namespace bs {
namespace {

struct MatrixOption {
  std::string prefix;  ///< -bs_write_matrices
};

struct Named {
  const char *name, *meaning;
  MatHandle matrix = {};
};

/// Indices in the state of the components that can move, positions and velocities, as they come in the input; and their masses.
struct Order {
  std::vector<PetscInt> x, v;
  std::vector<double> mass;
};

/// A vector with one number for each component, sent to the input's order.
PetscErrorCode in_order(Model& model, Vec state, std::vector<double>* out) {
  std::vector<StatePart> parts;
  PetscFunctionBegin;
  PetscCall(model.gather_state(state, &parts));
  PetscCall(own_numbers(parts[0].vec, out));
  PetscFunctionReturn(0);
}

PetscErrorCode find_order(Model& model, Vec y, Order* order) {
  Mechanics& mechanics = *model.mechanics();
  const Layout& at = mechanics.layout();
  VecHandle places;
  PetscScalar* a = nullptr;
  PetscInt first = 0;
  std::vector<double> place, mass;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(y, places.out()));
  for (std::vector<double>* values : {&place, &mass}) {
    PetscCall(VecZeroEntries(places));
    PetscCall(VecGetOwnershipRange(places, &first, nullptr));
    PetscCall(VecGetArray(places, &a));
    for (PetscInt i = 0; i < at.particles; ++i)
      for (PetscInt c = 0; c < at.dim; ++c)
        a[at.x(i, c)] = values == &mass                         ? mechanics.masses()[static_cast<std::size_t>(i)]
                        : mechanics.linearisation().moves(i, c) ? static_cast<double>(first + at.x(i, c))
                                                                : -1.0;
    PetscCall(VecRestoreArray(places, &a));
    PetscCall(in_order(model, places, values));
  }
  for (std::size_t k = 0; k < place.size(); ++k) {
    if (place[k] < 0) continue;
    order->x.push_back(static_cast<PetscInt>(place[k]));
    order->v.push_back(static_cast<PetscInt>(place[k]) + at.v(0) - at.x(0));
    order->mass.push_back(mass[k]);
  }
  PetscFunctionReturn(0);
}

/// K and D are minus the lower blocks of J = [0, -M; -K, -D].
PetscErrorCode make(Model& model, double t, Vec y, Named* M, Named* K, Named* D) {
  Mechanics& mechanics = *model.mechanics();
  MatHandle J;
  Order order;
  PetscFunctionBegin;
  PetscCall(find_order(model, y, &order));
  PetscCall(mechanics.linearisation().linearise(t, y));
  PetscCall(mechanics.create_first_order(J.out()));
  PetscCall(mechanics.assemble_first_order(0, true, J));
  const PetscInt n = static_cast<PetscInt>(order.x.size());
  ISHandle x, v;
  PetscCall(ISCreateGeneral(model.comm(), n, order.x.data(), PETSC_COPY_VALUES, x.out()));
  PetscCall(ISCreateGeneral(model.comm(), n, order.v.data(), PETSC_COPY_VALUES, v.out()));
  PetscCall(MatCreateSubMatrix(J, v, x, MAT_INITIAL_MATRIX, K->matrix.out()));
  PetscCall(MatCreateSubMatrix(J, v, v, MAT_INITIAL_MATRIX, D->matrix.out()));
  PetscCall(MatScale(K->matrix, -1));
  PetscCall(MatScale(D->matrix, -1));
  PetscInt row = 0;
  PetscCall(MatCreateAIJ(model.comm(), n, n, PETSC_DETERMINE, PETSC_DETERMINE, 1, nullptr, 0, nullptr, M->matrix.out()));
  PetscCall(MatGetOwnershipRange(M->matrix, &row, nullptr));
  for (PetscInt k = 0; k < n; ++k) PetscCall(MatSetValue(M->matrix, row + k, row + k, order.mass[static_cast<std::size_t>(k)], INSERT_VALUES));
  PetscCall(assemble(M->matrix));
  PetscFunctionReturn(0);
}

/// This rank's entries other than 0 as lines of Matrix Market, and how many.
PetscErrorCode local_lines(Mat A, std::string* text, PetscInt* count, Error* fault) {
  PetscInt first = 0, end = 0;
  PetscFunctionBegin;
  *count = 0;
  PetscCall(MatGetOwnershipRange(A, &first, &end));
  for (PetscInt row = first; row < end; ++row) {
    PetscInt n = 0;
    const PetscInt* column = nullptr;
    const PetscScalar* value = nullptr;
    PetscCall(MatGetRow(A, row, &n, &column, &value));
    for (PetscInt k = 0; k < n; ++k) {
      if (value[k] == 0) continue;
      if (!std::isfinite(value[k]))
        fault->note(row, format("row %lld has an entry that is not finite", static_cast<long long>(row) + 1), Exit::solve);
      *text += format("%lld %lld %.17g\n", static_cast<long long>(row) + 1, static_cast<long long>(column[k]) + 1, value[k]);
      ++*count;
    }
    PetscCall(MatRestoreRow(A, row, &n, &column, &value));
  }
  PetscFunctionReturn(0);
}

/// On rank 0 the texts of all ranks, one behind the other.
PetscErrorCode collect(MPI_Comm comm, std::string* text) {
  constexpr int TAG = 7;
  constexpr std::size_t SLICE = std::size_t{1} << 28;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm), ranks = size_of(comm);
  for (PetscMPIInt r = 1; r < ranks; ++r) {
    std::uint64_t size = text->size();
    if (rank == r) PetscCallMPI(MPI_Send(&size, 1, MPI_UINT64_T, 0, TAG, comm));
    if (rank == 0) PetscCallMPI(MPI_Recv(&size, 1, MPI_UINT64_T, r, TAG, comm, MPI_STATUS_IGNORE));
    const std::size_t before = rank == 0 ? text->size() : 0;
    if (rank == 0) text->resize(before + size);
    for (std::size_t done = 0; done < size && (rank == 0 || rank == r); done += SLICE) {
      const int part = static_cast<int>(std::min(SLICE, static_cast<std::size_t>(size) - done));
      if (rank == r) PetscCallMPI(MPI_Send(text->data() + done, part, MPI_CHAR, 0, TAG, comm));
      else PetscCallMPI(MPI_Recv(text->data() + before + done, part, MPI_CHAR, r, TAG, comm, MPI_STATUS_IGNORE));
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode write_market(const Named& named, double t, PetscInt dim, const std::string& file, bool overwrite) {
  std::string lines;
  PetscInt count = 0, n = 0;
  Error fault;
  MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(named.matrix.get()));
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  PetscCall(MatGetSize(named.matrix, &n, nullptr));
  PetscCall(local_lines(named.matrix, &lines, &count, &fault));
  if (fault) fault.text = std::string("option -bs_write_matrices: ") + named.meaning + ": " + fault.text + ": it is not written";
  PetscCall(fail_if_any(comm, fault));
  PetscCall(sum_over_ranks(comm, &count));
  PetscCall(collect(comm, &lines));
  if (rank == 0) {
    const std::string head = format(
        "%%%%MatrixMarket matrix coordinate real general\n%% %s = %s of M x'' = f(t, x, v) at t = %.17g s\n"
        "%% rows: the particles in the input's order without fixed ones, %s each\n%lld %lld %lld\n",
        named.name, named.meaning, t, how_many(dim, "component").c_str(), static_cast<long long>(n), static_cast<long long>(n),
        static_cast<long long>(count));
    if (const int why = write_whole(file, head + lines, overwrite)) fault.note(0, "cannot write " + file + ": " + std::strerror(why), Exit::io);
  }
  fault.exit = Exit::io;
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

/// A fresh file, its name known on all ranks.
PetscErrorCode create_everywhere(MPI_Comm comm, const std::string& file, std::string* made) {
  Error fault;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  if (rank == 0) {
    int handle = -1;
    if (const int why = create_fresh(file, ".tmp", made, &handle)) fault.note(0, "cannot write " + file + ": " + std::strerror(why));
    else (void)close(handle);
  }
  fault.exit = Exit::io;
  PetscCall(fail_if_any(comm, fault));
  PetscCall(share_text(comm, made));
  PetscFunctionReturn(0);
}

PetscErrorCode write_fresh_binary(const Named& named, const std::string& file) {
  ViewerHandle viewer;
  PetscFunctionBegin;
  PetscCall(PetscViewerCreate(PetscObjectComm(reinterpret_cast<PetscObject>(named.matrix.get())), viewer.out()));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_WRITE));
  PetscCall(PetscViewerBinarySkipInfo(viewer));
  PetscCall(PetscViewerFileSetName(viewer, file.c_str()));
  PetscCall(MatView(named.matrix, viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode write_binary(const Named& named, const std::string& file, bool overwrite) {
  MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(named.matrix.get()));
  std::string made;
  Error fault;
  PetscFunctionBegin;
  const PetscMPIInt rank = rank_of(comm);
  PetscCall(create_everywhere(comm, file, &made));
  const PetscErrorCode code = write_fresh_binary(named, made);
  if (code != 0) (void)unlink(made.c_str());
  PetscCall(code);
  if (rank == 0) {
    if (const int why = give_name(made, file, overwrite)) {
      fault.note(0, "cannot write " + file + ": " + std::strerror(why));
      (void)unlink(made.c_str());
    }
  }
  fault.exit = Exit::io;
  PetscCall(fail_if_any(comm, fault));
  PetscFunctionReturn(0);
}

}  // namespace

PetscErrorCode read_matrix_options(MPI_Comm comm) {
  PetscFunctionBegin;
  PetscCall(read_section(comm, "Matrices", [&](Section& o) {
    o.path("-bs_write_matrices",
           "prefix P of files P_M, P_K and P_D, each as .mtx (Matrix Market) and .petsc (PETSc binary): masses, K = df/dx and D = df/dv of "
           "M x'' = f at the start (-bs_task statics: at the last equilibrium), in the input's order, without rows and columns of fixed particles; "
           "default: none are written",
           held_by<MatrixOption>(comm).prefix);
  }));
  PetscFunctionReturn(0);
}

const std::string& matrix_prefix(MPI_Comm comm) { return held_by<MatrixOption>(comm).prefix; }

std::vector<std::string> matrix_files(MPI_Comm comm) {
  const std::string& prefix = matrix_prefix(comm);
  std::vector<std::string> files;
  for (const char* ending : {"_M.mtx", "_M.petsc", "_K.mtx", "_K.petsc", "_D.mtx", "_D.petsc"})
    if (!prefix.empty()) files.push_back(prefix + ending);
  return files;
}

PetscErrorCode at_rest(Vec y, Vec* out) {
  PetscFunctionBegin;
  PetscCall(VecDuplicate(y, out));
  PetscCall(VecCopy(y, *out));
  PetscCall(zero_velocities(*out));
  PetscFunctionReturn(0);
}

PetscErrorCode write_matrices(Model& model, double t, Vec y, bool overwrite) {
  Named all[] = {{"M", "mass [kg]"}, {"K", "df/dx [N/m]"}, {"D", "df/dv [kg/s]"}};
  const Exit phase = present_phase(model.comm());
  PetscFunctionBegin;
  const std::string& prefix = matrix_prefix(model.comm());
  if (prefix.empty()) PetscFunctionReturn(0);
  if (!model.mechanics())
    PetscCall(fail(model.comm(), Exit::input,
                   std::string("option -bs_write_matrices: a ") + model.name() + " system has no forces: leave it out, or give -bs_model particles"));
  if (model.mechanics()->couples_all())
    PetscCall(fail(model.comm(), Exit::input, "option -bs_write_matrices: forces that couple all particles have no sparse matrix: leave them out"));
  for (const std::string& file : matrix_files(model.comm())) PetscCall(require_writable(model.comm(), file, "-bs_write_matrices", overwrite));
  PetscCall(make(model, t, y, &all[0], &all[1], &all[2]));
  set_phase(model.comm(), Exit::io);
  for (const Named& named : all) {
    const std::string file = prefix + "_" + named.name;
    PetscCall(write_market(named, t, model.mechanics()->layout().dim, file + ".mtx", overwrite));
    PetscCall(write_binary(named, file + ".petsc", overwrite));
  }
  set_phase(model.comm(), phase);
  PetscFunctionReturn(0);
}

}  // namespace bs
