// Axis-aligned boxes.
#pragma once

#include <algorithm>
#include <initializer_list>
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

  static Box around(std::initializer_list<Point> points) {
    Box box;
    for (const Point& p : points) box.include(p);
    return box;
  }

  // The point of the box that is nearest to p.
  Point clamped(Point p) const {
    return {std::clamp(p.x, low.x, high.x), std::clamp(p.y, low.y, high.y),
            std::clamp(p.z, low.z, high.z)};
  }

  // Lower bound of the squared distance between any two points of two boxes. The bound also holds
  // in floating point, because rounding is monotone and the terms are added in the same order as in
  // squared_norm.
  double squared_distance(const Box& other) const {
    const auto gap = [&](double Point::* axis) {
      return std::max({low.*axis - other.high.*axis, 0.0, other.low.*axis - high.*axis});
    };
    return squared_norm({gap(&Point::x), gap(&Point::y), gap(&Point::z)});
  }
  double squared_distance(Point p) const { return squared_distance({p, p}); }
};

}  // namespace superfacets
