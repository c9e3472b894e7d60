#include "systems/particles/condensed/spring_matrix.hpp"
#include <algorithm>
#include "base/memory.hpp"
#include "systems/particles/condensed/lanes.hpp"
#include "systems/particles/condensed/spring_product.hpp"
#include "systems/particles/events.hpp"
#include "systems/particles/local_state.hpp"
#include "systems/particles/supports.hpp"

namespace bs {

void SpringPattern::create(const Network& net) {
  const Links& links = net.links;
  n = net.n;
  ghosts = net.ghosts;
  start.reserve(static_cast<std::size_t>(n) + 1);
  start.assign(1, 0);
  other.reserve(links.other.size() / 2 + 1);  // each spring between free particles of this rank once
  cut_start.assign(1, 0);
  for (PetscInt i = 0; i < n; ++i) {
    PetscInt last = -1;  // parallel springs follow each other
    for (PetscInt e = links.start[i]; e < links.start[i + 1] && !net.fixed[i]; ++e) {
      const PetscInt j = net.coupled(i, e);
      if (links.spring[e] < 0 || net.fixed[j] || j < i || j == last || net.own_image(i, links.other[e])) continue;
      if (j < n) other.push_back(j);
      else ghost.push_back(j - n);
      last = j;
    }
    start.push_back(static_cast<PetscInt>(other.size()));
    if (static_cast<PetscInt>(ghost.size()) > cut_start.back()) {
      cut_row.push_back(i);
      cut_start.push_back(static_cast<PetscInt>(ghost.size()));
    }
  }
  other.shrink_to_fit();
  ghost.shrink_to_fit();
}

PetscErrorCode SpringMatrix::create(const Network& net) {
  PetscFunctionBegin;
  net_ = &net;
  dim_ = net.dim;
  area_ = static_cast<std::size_t>(dim_ * dim_);
  width_ = static_cast<std::size_t>(dim_ + 1);
  pattern_.create(net);
  const std::size_t lanes = dim_ == 3 ? 4 : static_cast<std::size_t>(dim_);
  const double rows = static_cast<double>(net.n), pairs = static_cast<double>(pattern_.pairs() + pattern_.ghost.size());
  PetscCall(reserve_memory(net.comm,
                           {"the condensed matrix, spring by spring, of " + net.source,
                            rows * static_cast<double>((area_ + lanes) * sizeof(double)) + pairs * static_cast<double>(width_ * sizeof(float)), ""}));
  node_.assign(static_cast<std::size_t>(net.n) * area_ + 1, 0.0);  // read in whole registers: one number behind the last
  pair_.assign(pattern_.pairs() * width_, 0.0F);
  cut_.assign(pattern_.ghost.size() * width_, 0.0F);
  sums_.assign(static_cast<std::size_t>(net.n) * lanes, 0.0);
  VecHandle layout;
  PetscCall(create_vector(layout.out()));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, net.ghosts * dim_, ghost_values_.out()));
  ISHandle ghosts;
  PetscCall(ISCreateBlock(net.comm, dim_, net.ghosts, net.global.data() + net.n, PETSC_COPY_VALUES, ghosts.out()));
  PetscCall(VecScatterCreate(layout, ghosts, ghost_values_, nullptr, scatter_.out()));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMatrix::create_vector(Vec* out) const {
  PetscFunctionBegin;
  PetscCall(VecCreate(net_->comm, out));
  PetscCall(VecSetSizes(*out, net_->n * dim_, PETSC_DETERMINE));
  PetscCall(VecSetBlockSize(*out, dim_));
  PetscCall(VecSetType(*out, VECSTANDARD));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMatrix::fetch_ghosts(Vec p, std::vector<double>* ghosts) {
  const PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(VecScatterBegin(scatter_, p, ghost_values_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter_, p, ghost_values_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(ghost_values_, &a));
  ghosts->assign(a, a + net_->ghosts * dim_);
  PetscCall(VecRestoreArrayRead(ghost_values_, &a));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMatrix::add_ghosts(const std::vector<double>& ghosts, Vec y) {
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArrayWrite(ghost_values_, &a));
  std::copy(ghosts.begin(), ghosts.end(), a);
  PetscCall(VecRestoreArrayWrite(ghost_values_, &a));
  PetscCall(VecScatterBegin(scatter_, ghost_values_, y, ADD_VALUES, SCATTER_REVERSE));
  PetscCall(VecScatterEnd(scatter_, ghost_values_, y, ADD_VALUES, SCATTER_REVERSE));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMatrix::append_ghosts(std::vector<double>* values) {
  PetscScalar* to = nullptr;
  std::vector<double> ghosts;
  VecHandle owned;
  PetscFunctionBegin;
  PetscCall(create_vector(owned.out()));
  PetscCall(VecGetArrayWrite(owned, &to));
  std::copy(values->begin(), values->end(), to);
  PetscCall(VecRestoreArrayWrite(owned, &to));
  PetscCall(fetch_ghosts(owned, &ghosts));
  values->insert(values->end(), ghosts.begin(), ghosts.end());
  PetscFunctionReturn(0);
}

std::vector<double> SpringMatrix::positions() const {
  std::vector<double> points(static_cast<std::size_t>(net_->n * dim_));
  for (PetscInt i = 0; i < net_->n; ++i) std::copy_n(state_->at(i), dim_, points.data() + i * dim_);
  return points;
}

void SpringMatrix::zero() {
  std::fill(node_.begin(), node_.end(), 0.0);
  std::fill(pair_.begin(), pair_.end(), 0.0F);
  std::fill(cut_.begin(), cut_.end(), 0.0F);
}

namespace {

/// Owned pairs while the ghosts travel, then the cut ones.
template <int d>
PetscErrorCode product(const SpringMatrix& S, VecScatter scatter, Vec ghost_values, HugeVector<double>* sums, Vec p, Vec y) {
  const SpringPattern& pattern = S.pattern();
  const PetscScalar *ap = nullptr, *ag = nullptr;
  PetscScalar* ay = nullptr;
  PetscFunctionBegin;
  PetscCall(VecScatterBegin(scatter, p, ghost_values, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(p, &ap));
  PetscCall(VecGetArrayWrite(y, &ay));
  std::fill(sums->begin(), sums->end(), 0.0);
  multiply_pairs<d>(pattern, S.node(0), S.pair(0), ap, sums->data(), ay);
  PetscCall(VecScatterEnd(scatter, p, ghost_values, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(ghost_values, &ag));
  multiply_cut<d>(pattern, S.cut(0), ap, ag, ay);
  if (S.remainder().created()) S.remainder().multiply_add(ap, ag, ay);
  PetscCall(VecRestoreArrayRead(ghost_values, &ag));
  PetscCall(VecRestoreArrayWrite(y, &ay));
  PetscCall(VecRestoreArrayRead(p, &ap));
  PetscFunctionReturn(0);
}

PetscErrorCode shell_multiply(Mat A, Vec p, Vec y) {
  SpringMatrix* S = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(A, &S));
  PetscCall(S->multiply(p, y));
  PetscFunctionReturn(0);
}

PetscErrorCode shell_diagonal(Mat A, Vec out) {
  SpringMatrix* S = nullptr;
  PetscFunctionBegin;
  PetscCall(MatShellGetContext(A, &S));
  PetscCall(S->diagonal(out));
  PetscFunctionReturn(0);
}

constexpr char MARK[] = "bs_spring_matrix";

}  // namespace

PetscErrorCode SpringMatrix::multiply(Vec p, Vec y) {
  const Supports* supports = net_->supports && net_->supports->rolls() ? net_->supports : nullptr;
  Vec given = p;
  PetscScalar* a = nullptr;
  PetscFunctionBegin;
  PetscCall(PetscLogEventBegin(particle_events().product, p, y, nullptr, nullptr));
  if (supports) {
    if (!free_) PetscCall(VecDuplicate(p, free_.out()));
    PetscCall(VecCopy(p, free_));
    PetscCall(VecGetArray(free_, &a));
    supports->clear(0, net_->n, 1, a);
    PetscCall(VecRestoreArray(free_, &a));
    p = free_;
  }
  if (dim_ == 1) PetscCall(product<1>(*this, scatter_, ghost_values_, &sums_, p, y));
  else if (dim_ == 2) PetscCall(product<2>(*this, scatter_, ghost_values_, &sums_, p, y));
  else PetscCall(product<3>(*this, scatter_, ghost_values_, &sums_, p, y));
  if (supports) PetscCall(hold_product(given, y));
  PetscCall(PetscLogFlops(8.0 * dim_ * static_cast<double>(pattern_.pairs())));
  PetscCall(PetscLogEventEnd(particle_events().product, p, y, nullptr, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMatrix::hold_product(Vec p, Vec y) const {
  const PetscScalar* ap = nullptr;
  PetscScalar* ay = nullptr;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(p, &ap));
  PetscCall(VecGetArray(y, &ay));
  for (const Supports::Hold& hold : net_->supports->holds()) {
    if (hold.particle >= net_->n) break;
    for (int c = 0; c < dim_ && !net_->fixed[hold.particle]; ++c)
      if (hold.mask >> c & 1)
        ay[hold.particle * dim_ + c] = Supports::on_diagonal(inertia_, net_->mass[hold.particle]) * ap[hold.particle * dim_ + c];
  }
  PetscCall(VecRestoreArray(y, &ay));
  PetscCall(VecRestoreArrayRead(p, &ap));
  PetscFunctionReturn(0);
}

PetscErrorCode SpringMatrix::create_shell(Mat* out) {
  const PetscInt local = net_->n * dim_;
  PetscFunctionBegin;
  PetscCall(MatCreateShell(net_->comm, local, local, PETSC_DETERMINE, PETSC_DETERMINE, this, out));
  PetscCall(MatSetBlockSize(*out, dim_));
  PetscCall(MatSetVecType(*out, VECSTANDARD));
  PetscCall(MatShellSetOperation(*out, MATOP_MULT, reinterpret_cast<void (*)()>(shell_multiply)));
  PetscCall(MatShellSetOperation(*out, MATOP_MULT_TRANSPOSE, reinterpret_cast<void (*)()>(shell_multiply)));
  PetscCall(MatShellSetOperation(*out, MATOP_GET_DIAGONAL, reinterpret_cast<void (*)()>(shell_diagonal)));
  PetscCall(MatSetOption(*out, MAT_SYMMETRIC, PETSC_TRUE));
  PetscContainer mark;
  PetscCall(PetscContainerCreate(net_->comm, &mark));
  PetscCall(PetscContainerSetPointer(mark, this));
  PetscCall(PetscObjectCompose(reinterpret_cast<PetscObject>(*out), MARK, reinterpret_cast<PetscObject>(mark)));
  PetscCall(PetscContainerDestroy(&mark));
  PetscFunctionReturn(0);
}

SpringMatrix* SpringMatrix::from(Mat A) {
  PetscObject mark = nullptr;
  void* pointer = nullptr;
  if (PetscObjectQuery(reinterpret_cast<PetscObject>(A), MARK, &mark) || !mark) return nullptr;
  if (PetscContainerGetPointer(reinterpret_cast<PetscContainer>(mark), &pointer)) return nullptr;
  return static_cast<SpringMatrix*>(pointer);
}

}  // namespace bs
