// Normals of points, estimated from their neighbors.
#pragma once

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

// Sum of a a^T over axes a. An axis has length 1 or 0, and either sign.
struct AxisSpread {
  double n = 0.0;
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  void include(const Point& a) {
    n += squared_norm(a) > 0.0 ? 1.0 : 0.0;
    xx += a.x * a.x;
    xy += a.x * a.y;
    xz += a.x * a.z;
    yy += a.y * a.y;
    yz += a.y * a.z;
    zz += a.z * a.z;
  }
};

// The unit vector that the included axes are closest to, of either sign; zero if two directions are
// equally close, or there are no axes.
Point common_axis(const AxisSpread& spread);

// The unit vector in the direction of least variance of the included points, of either sign; zero
// if the points are on a line or at one position.
Point direction_of_least_spread(const Spread& spread);

// The normal around a point: the common axis of the points that have axes, or else the direction of
// least spread. `axes` is empty, or holds one axis per point.
class NormalFit {
 public:
  NormalFit(std::span<const Point> axes, const Point& origin) : axes_(axes), spread_(origin) {}

  // Adds the position of a point, and its axis.
  void include(const Point& position, std::size_t point) {
    spread_.include(position);
    if (!axes_.empty()) around_.include(axes_[point]);
  }
  Point normal() const {
    const Point axis = axes_.empty() ? Point{0.0, 0.0, 0.0} : common_axis(around_);
    return squared_norm(axis) > 0.0 ? axis : direction_of_least_spread(spread_);
  }

 private:
  const std::span<const Point> axes_;
  Spread spread_;
  AxisSpread around_;
};

}  // namespace superfacets
