#include "base/exponential.hpp"

#include <algorithm>

namespace superfacets {

void exponentials(std::span<const double> x, std::span<double> powers) {
  std::transform(x.begin(), x.end(), powers.begin(), exponential);
}

}  // namespace superfacets
