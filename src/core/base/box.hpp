// Axis-aligned boxes.
#pragma once

#include <algorithm>
#include <limits>

#include "base/types.hpp"

namespace superfacets {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Bounding box of the points included so far.
struct Box {
  Point low{kInfinity, kInfinity, kInfinity};
  Point high{-kInfinity, -kInfinity, -kInfinity};

  void include(const Box& other) {
    low = {std::min(low.x, other.low.x), std::min(low.y, other.low.y),
           std::min(low.z, other.low.z)};
    high = {std::max(high.x, other.high.x), std::max(high.y, other.high.y),
            std::max(high.z, other.high.z)};
  }
  void include(Point p) { include({p, p}); }

  // The point of the box that is nearest to p.
  Point clamped(Point p) const {
    return {std::clamp(p.x, low.x, high.x), std::clamp(p.y, low.y, high.y),
            std::clamp(p.z, low.z, high.z)};
  }

  // Lower bound of the squared distance from p to any point in the box. The bound also holds in
  // floating point, because rounding is monotone and the terms are added in the same order as in
  // squared_norm.
  double squared_distance(Point p) const {
    auto gap = [](double from, double to, double value) {
      return std::max({from - value, 0.0, value - to});
    };
    return squared_norm(
        {gap(low.x, high.x, p.x), gap(low.y, high.y, p.y), gap(low.z, high.z, p.z)});
  }
};

}  // namespace superfacets
