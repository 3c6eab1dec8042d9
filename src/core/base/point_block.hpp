// A block of points with one array per coordinate, a layout that compilers can vectorize.
#pragma once

#include <array>
#include <cstddef>

#include "base/types.hpp"
#include "base/versions.hpp"

namespace superfacets {

template <std::size_t kSize>
struct PointBlock {
  std::array<double, kSize> x;
  std::array<double, kSize> y;
  std::array<double, kSize> z;

  SUPERFACETS_ALWAYS_INLINE Point get(std::size_t i) const { return {x[i], y[i], z[i]}; }
  SUPERFACETS_ALWAYS_INLINE void set(std::size_t i, const Point& p) {
    x[i] = p.x;
    y[i] = p.y;
    z[i] = p.z;
  }
};

}  // namespace superfacets
