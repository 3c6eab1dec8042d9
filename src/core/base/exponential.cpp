#include "base/exponential.hpp"

#include <algorithm>

#include "base/assert.hpp"

namespace superfacets {

void exponentials(std::span<const double> x, std::span<double> powers) {
  SUPERFACETS_ASSERT(powers.size() == x.size());
  std::ranges::transform(x, powers.begin(), exponential);
}

}  // namespace superfacets
