#include "time/stepping/step_counts.hpp"
#include <numeric>

namespace bs {

std::int64_t total(const RejectionCounts& counts) { return std::accumulate(counts.begin(), counts.end(), std::int64_t{0}); }

void StepCounter::count(std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected, StepRecord* record) {
  newton += newton_before_;
  krylov += krylov_before_;
  for (std::size_t k = 0; k < rejected.size(); ++k) record->reasons[k] = rejected[k] - rejected_[k];
  rejected_ = rejected;
  record->newton = newton - counts_.newton;
  record->krylov = krylov - counts_.krylov;
  record->rejected = total(rejected) - counts_.rejected;
  counts_.newton = newton;
  counts_.krylov = krylov;
  counts_.rejected = total(rejected);
}

void StepCounter::save(Facts* facts) const {
  facts->whole["step"] = counts_.steps;
  facts->whole["rejected"] = counts_.rejected;
  facts->whole["newton"] = counts_.newton;
  facts->whole["krylov"] = counts_.krylov;
  facts->whole["shortened"] = counts_.shortened;
}

void StepCounter::restore(const Facts& facts, std::int64_t newton, std::int64_t krylov, const RejectionCounts& rejected) {
  counts_ = {facts.whole.at("step"), facts.whole.at("rejected"), facts.whole.at("newton"), facts.whole.at("krylov"), facts.whole.at("shortened")};
  newton_before_ = counts_.newton - newton;
  krylov_before_ = counts_.krylov - krylov;
  rejected_ = rejected;
}

}  // namespace bs
