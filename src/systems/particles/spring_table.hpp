// Numbers of springs between the network's links and rows in the input's order.
#pragma once
#include <algorithm>
#include <array>
#include <optional>
#include <vector>
#include "base/vec_array.hpp"
#include "network/network.hpp"
#include "systems/particles/local_state.hpp"

namespace bs {

class SpringTable {
 public:
  /// Collective. `rows`: this rank's springs in the input's order. `net` must outlive the object.
  PetscErrorCode create(const Network& net, const Rows& rows);
  bool created() const { return net_ != nullptr; }
  static constexpr std::size_t BLOCK = 512;  ///< springs
  /// Collective. Each of `out`, made at first use, receives a number of every spring: fill(count, i, e, numbers) is told `count` of them, up to
  /// BLOCK, by their owned particles i and their links e there, and puts number k of spring s at numbers[k][s].
  template <std::size_t K, class F>
  PetscErrorCode gather(F&& fill, const std::array<VecHandle*, K>& out) {
    constexpr std::size_t AHEAD = 32;
    PetscFunctionBegin;
    for (std::size_t k = 0; k < K; ++k) PetscCall(make(k, out[k]));
    {
      std::array<std::optional<WriteArray>, K> arrays;
      std::array<PetscScalar*, K> to;
      for (std::size_t k = 0; k < K; ++k) to[k] = arrays[k].emplace(alone_ ? out[k]->get() : local_[k].get());
      double numbers[K][BLOCK];
      for (std::size_t first = 0; first < link_.size(); first += BLOCK) {
        const std::size_t count = std::min(BLOCK, link_.size() - first);
        fill(count, particle_.data() + first, link_.data() + first, numbers);
        for (std::size_t s = first; s < first + count; ++s) {
          if (alone_ && s + AHEAD < target_.size())  // the rows of springs that follow each other lie apart
            for (std::size_t k = 0; k < K; ++k) __builtin_prefetch(to[k] + target_[s + AHEAD], 1);
          const std::size_t at = alone_ ? static_cast<std::size_t>(target_[s]) : s;
          for (std::size_t k = 0; k < K; ++k) to[k][at] = numbers[k][s - first];
        }
      }
    }
    for (std::size_t k = 0; k < K; ++k) PetscCall(scatter_rows(k, *out[k]));
    PetscFunctionReturn(0);
  }
  /// The same of one number, value(i, e).
  template <class F>
  PetscErrorCode gather(F&& value, VecHandle* out) {
    const auto fill = [&](std::size_t count, const PetscInt* i, const PetscInt* e, double(*numbers)[BLOCK]) {
      for (std::size_t s = 0; s < count; ++s) numbers[0][s] = value(i[s], e[s]);
    };
    return gather<1>(fill, {out});
  }
  /// Collective. put(e, value) for every link e of a spring, at both its ends, from `rows` in the input's order.
  template <class F>
  PetscErrorCode spread(Vec rows, F&& put) {
    PetscFunctionBegin;
    PetscCall(fetch_rows(rows));
    const ReadArray values(all_);
    for (std::size_t k = 0; k < every_.size(); ++k) put(every_[k], values[k]);
    PetscFunctionReturn(0);
  }

 private:
  /// `out`, and where other ranks have rows, too, room for this rank's springs.
  PetscErrorCode make(std::size_t number, VecHandle* out);
  PetscErrorCode scatter_rows(std::size_t number, Vec out);
  PetscErrorCode fetch_rows(Vec rows);
  const Network* net_ = nullptr;
  PetscInt rows_ = 0;
  bool alone_ = false;                     ///< one rank has all rows: numbers go to their places at once
  std::vector<PetscInt> particle_, link_;  ///< per spring evaluated here: its owned end and its place in net.links
  std::vector<PetscInt> target_;           ///< its row, where alone
  std::vector<PetscInt> every_;            ///< links that are springs
  std::vector<VecHandle> local_;
  VecHandle all_;
  ScatterHandle scatter_, back_;  ///< the latter made at first use
};

}  // namespace bs
