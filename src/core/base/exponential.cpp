#include "base/exponential.hpp"

#include <algorithm>

#include "base/assert.hpp"

namespace superfacets {

void exponentials(std::span<const double> x, std::span<double> powers) {
  SUPERFACETS_ASSERT(powers.size() == x.size());
  std::transform(x.begin(), x.end(), powers.begin(), exponential);
}

}  // namespace superfacets
