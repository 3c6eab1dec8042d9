#include "base/elementary.hpp"

namespace superfacets {
namespace {

struct Loop {
  SUPERFACETS_ALWAYS_INLINE void operator()(const double* __restrict y, const double* __restrict x,
                                            double* __restrict angles, std::size_t n) const {
    for (std::size_t i = 0; i < n; ++i) angles[i] = arctangent(y[i], x[i]);
  }
};

}  // namespace

void arctangents(std::span<const double> y, std::span<const double> x, std::span<double> angles,
                 InstructionSet with) {
  const std::size_t n = angles.size();
  SUPERFACETS_ASSERT(y.size() == n && x.size() == n && with <= best_instruction_set());
  run_version(with, Loop{}, y.data(), x.data(), angles.data(), n);
}

void exponentials(std::span<const double> x, std::span<double> powers) {
  SUPERFACETS_ASSERT(powers.size() == x.size());
  std::ranges::transform(x, powers.begin(), exponential);
}

}  // namespace superfacets
