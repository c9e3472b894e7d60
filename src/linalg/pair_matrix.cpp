#include "linalg/pair_matrix.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include "base/attached.hpp"
#include "base/dimension.hpp"
#include "base/handle.hpp"
#include "base/log_event.hpp"
#include "base/memory.hpp"
#include "base/petsc_versions.hpp"
#include "base/vec_array.hpp"
#include "linalg/lanes.hpp"
#include "linalg/pair_product.hpp"

namespace bs {

PetscErrorCode PairMatrix::create(const Graph& graph, PairPattern pattern) {
  PetscFunctionBegin;
  graph_ = std::make_unique<const Graph>(graph);
  dim_ = graph.dim;
  area_ = static_cast<std::size_t>(dim_ * dim_);
  width_ = static_cast<std::size_t>(dim_ + 1);
  pattern_ = std::move(pattern);
  const std::size_t lanes = dim_ == 3 ? 4 : static_cast<std::size_t>(dim_);
  const double rows = static_cast<double>(graph.n), pairs = static_cast<double>(pattern_.pairs() + pattern_.ghost.size());
  PetscCall(reserve_memory(graph.comm,
                           {"the condensed matrix, spring by spring, of " + graph.source,
                            rows * static_cast<double>((area_ + lanes) * sizeof(double)) + pairs * static_cast<double>(width_ * sizeof(float)), ""}));
  node_.assign(static_cast<std::size_t>(graph.n) * area_ + 1, 0.0);  // read in whole registers: one number behind the last
  pair_.assign(pattern_.pairs() * width_, 0.0F);
  cut_.assign(pattern_.ghost.size() * width_, 0.0F);
  sums_.assign(static_cast<std::size_t>(graph.n) * lanes, 0.0);
  VecHandle layout;
  PetscCall(create_vector(layout.out()));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, graph.ghosts * dim_, ghost_values_.out()));
  ISHandle ghosts;
  PetscCall(ISCreateBlock(graph.comm, dim_, graph.ghosts, graph.global.data() + graph.n, PETSC_COPY_VALUES, ghosts.out()));
  PetscCall(VecScatterCreate(layout, ghosts, ghost_values_, nullptr, scatter_.out()));
  PetscFunctionReturn(0);
}

PetscErrorCode PairMatrix::fetch_ghosts(Vec p, std::vector<double>* ghosts) {
  PetscFunctionBegin;
  PetscCall(scatter_all(scatter_, p, ghost_values_));
  const ReadArray a(ghost_values_);
  ghosts->assign(a.data(), a + graph_->ghosts * dim_);
  PetscFunctionReturn(0);
}

PetscErrorCode PairMatrix::add_ghosts(const std::vector<double>& ghosts, Vec y) {
  PetscFunctionBegin;
  std::copy(ghosts.begin(), ghosts.end(), WriteArray(ghost_values_).data());
  PetscCall(scatter_all(scatter_, ghost_values_, y, SCATTER_REVERSE, ADD_VALUES));
  PetscFunctionReturn(0);
}

PetscErrorCode PairMatrix::append_ghosts(std::vector<double>* values) {
  std::vector<double> ghosts;
  VecHandle owned;
  PetscFunctionBegin;
  PetscCall(create_vector(owned.out()));
  std::copy(values->begin(), values->end(), WriteArray(owned).data());
  PetscCall(fetch_ghosts(owned, &ghosts));
  values->insert(values->end(), ghosts.begin(), ghosts.end());
  PetscFunctionReturn(0);
}

std::vector<double> PairMatrix::positions() const {
  std::vector<double> points(static_cast<std::size_t>(graph_->n * dim_));
  for (PetscInt i = 0; i < graph_->n; ++i) std::copy_n(places_(i), dim_, points.data() + i * dim_);
  return points;
}

std::vector<PetscInt> PairMatrix::boundary() const {
  std::vector<PetscInt> points = pattern_.cut_row;
  if (!remainder_.created()) return points;
  for (PetscInt i = 0; i < pattern_.n; ++i)
    remainder_.for_row(i, [&](PetscInt j, const double*) {
      if (j >= pattern_.n) points.push_back(i);
    });
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

void PairMatrix::zero() {
  std::fill(node_.begin(), node_.end(), 0.0);
  std::fill(pair_.begin(), pair_.end(), 0.0F);
  std::fill(cut_.begin(), cut_.end(), 0.0F);
}

namespace {

/// Owned pairs while the ghosts travel, then the cut ones.
template <int d>
PetscErrorCode product(const PairMatrix& S, VecScatter scatter, Vec ghost_values, HugeVector<double>* sums, Vec p, Vec y) {
  const PairPattern& pattern = S.pattern();
  PetscFunctionBegin;
  PetscCall(VecScatterBegin(scatter, p, ghost_values, INSERT_VALUES, SCATTER_FORWARD));
  const ReadArray ap(p);
  const WriteArray ay(y);
  std::fill(sums->begin(), sums->end(), 0.0);
  multiply_pairs<d>(pattern, S.node(0), S.pair(0), ap, sums->data(), ay);
  PetscCall(VecScatterEnd(scatter, p, ghost_values, INSERT_VALUES, SCATTER_FORWARD));
  const ReadArray ag(ghost_values);
  multiply_cut<d>(pattern, S.cut(0), ap, ag, ay);
  if (S.remainder().created()) S.remainder().multiply_add(ap, ag, ay);
  PetscFunctionReturn(0);
}

PetscErrorCode shell_multiply(Mat A, Vec p, Vec y) {
  PairMatrix* S = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(A, &S));
  PetscCall(S->multiply(p, y));
  PetscFunctionReturn(0);
}

PetscErrorCode shell_diagonal(Mat A, Vec out) {
  PairMatrix* S = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(A, &S));
  PetscCall(S->diagonal(out));
  PetscFunctionReturn(0);
}

constexpr char MARK[] = "bs_pair_matrix";

}  // namespace

PetscErrorCode PairMatrix::multiply(Vec p, Vec y) {
  const bool holds = graph_->holds;
  Vec given = p;
  PetscFunctionBegin;
  const LoggedTime logged(LogEvent::product, p);
  if (holds) {
    PetscCall(copy_into(&free_, p));
    graph_->clear_held(WriteArray(free_));
    p = free_;
  }
  PetscCall(with_dimension(dim_, [&](auto d) { return product<d>(*this, scatter_, ghost_values_, &sums_, p, y); }));
  if (holds) PetscCall(hold_product(given, y));
  PetscCall(PetscLogFlops(8.0 * dim_ * static_cast<double>(pattern_.pairs())));
  PetscFunctionReturn(0);
}

PetscErrorCode PairMatrix::hold_product(Vec p, Vec y) const {
  PetscFunctionBegin;
  const ReadArray ap(p);
  const WriteArray ay(y);
  graph_->for_held([&](std::size_t k) { ay[k] = on_diagonal(static_cast<PetscInt>(k) / dim_) * ap[k]; });
  PetscFunctionReturn(0);
}

PetscErrorCode PairMatrix::create_shell(Mat* out) {
  const PetscInt local = graph_->n * dim_;
  PetscFunctionBegin;
  PetscCall(MatCreateShell(graph_->comm, local, local, PETSC_DETERMINE, PETSC_DETERMINE, this, out));
  PetscCall(MatSetBlockSize(*out, dim_));
  PetscCall(MatSetVecType(*out, VECSTANDARD));
  PetscCall(set_shell_operation(*out, MATOP_MULT, shell_multiply));
  PetscCall(set_shell_operation(*out, MATOP_MULT_TRANSPOSE, shell_multiply));
  PetscCall(set_shell_operation(*out, MATOP_GET_DIAGONAL, shell_diagonal));
  PetscCall(MatSetOption(*out, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(attach(*out, MARK, this));
  PetscFunctionReturn(0);
}

PairMatrix* PairMatrix::from(Mat A) { return attached<PairMatrix>(A, MARK); }

void PairMatrix::hold_block(PetscInt i, PetscInt j, double* block) const {
  const std::uint8_t rows = graph_->mask(i), columns = graph_->mask(j);
  for (int r = 0; r < dim_; ++r)
    for (int c = 0; c < dim_; ++c) {
      if (!((rows >> r & 1) || (columns >> c & 1))) continue;
      block[r * dim_ + c] = i == j && r == c ? on_diagonal(i) : 0;
    }
}

namespace {

/// The pairs' part of the diagonal blocks.
template <int d>
void add_pairs(const PairMatrix& S, double* out) {
  constexpr int area = d * d;
  const PairPattern& pattern = S.pattern();
  double B[area];
  const auto add = [&](PetscInt i) {
    double* to = out + static_cast<std::size_t>(i) * area;
    for (int c = 0; c < area; ++c) to[c] += B[c];
  };
  for (PetscInt i = 0; i < pattern.n; ++i)
    for (PetscInt k = pattern.start[i]; k < pattern.start[i + 1]; ++k) {
      write_block<d>(S.pair(static_cast<std::size_t>(k)), B);
      add(i);
      add(pattern.other[k]);
    }
  for (std::size_t r = 0; r < pattern.cut_row.size(); ++r)
    for (PetscInt k = pattern.cut_start[r]; k < pattern.cut_start[r + 1]; ++k) {
      write_block<d>(S.cut(static_cast<std::size_t>(k)), B);
      add(pattern.cut_row[r]);
    }
}

}  // namespace

void PairMatrix::diagonal_blocks(std::vector<double>* out) const {
  out->assign(node_.begin(), node_.end());
  with_dimension(dim_, [&](auto d) { add_pairs<d>(*this, out->data()); });
  if (remainder_.created()) remainder_.add_diagonal(out);
  if (graph_->holds)
    for (PetscInt i = 0; i < pattern_.n; ++i) hold_block(i, i, out->data() + static_cast<std::size_t>(i) * area_);
}

PetscErrorCode PairMatrix::diagonal(Vec out) const {
  std::vector<double> blocks;
  PetscFunctionBegin;
  diagonal_blocks(&blocks);
  const WriteArray a(out);
  for (PetscInt i = 0; i < pattern_.n; ++i)
    for (int c = 0; c < dim_; ++c) a[i * dim_ + c] = blocks[i * area_ + c * (dim_ + 1)];
  PetscFunctionReturn(0);
}

PetscErrorCode PairMatrix::size_ratio(const std::vector<double>& blocks, double* ratio) const {
  double ends[2] = {-std::numeric_limits<double>::max(), 0};  // minus the smallest, the largest
  PetscFunctionBegin;
  for (PetscInt i = 0; i < pattern_.n; ++i) {
    if (graph_->fixed[i]) continue;  // tied to nothing
    double size = 0;
    for (int c = 0; c < dim_; ++c) size = std::max(size, std::abs(blocks[i * area_ + c * (dim_ + 1)]));
    ends[0] = std::max(ends[0], -size);
    ends[1] = std::max(ends[1], size);
  }
  PetscCall(MPIU_Allreduce(MPI_IN_PLACE, ends, 2, MPI_DOUBLE, MPI_MAX, graph_->comm));
  *ratio = -ends[1] / ends[0];
  PetscFunctionReturn(0);
}

}  // namespace bs
