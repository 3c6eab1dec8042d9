// Normals of points, estimated from their neighbors.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Number of points, and sums of their coordinates and of products of coordinates, relative to
// `origin`.
struct Spread {
  Point origin;
  double n = 0.0;
  Point sum{0.0, 0.0, 0.0};
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  explicit Spread(const Point& first) : origin(first) {}
  void include(const Point& point) {
    const Point p = point - origin;
    n += 1.0;
    sum = sum + p;
    xx += p.x * p.x;
    xy += p.x * p.y;
    xz += p.x * p.z;
    yy += p.y * p.y;
    yz += p.y * p.z;
    zz += p.z * p.z;
  }
};

// The unit vector in the direction of least variance of the included points, of either sign; zero
// if the points are on a line or at one position.
Point direction_of_least_spread(const Spread& spread);

}  // namespace superfacets
