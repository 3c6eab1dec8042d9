// Estimates normals of points from their neighbors.
#pragma once

#include "base/types.hpp"

namespace superfacets {

// A symmetric 3 x 3 matrix.
struct Symmetric {
  double xx = 0.0, xy = 0.0, xz = 0.0, yy = 0.0, yz = 0.0, zz = 0.0;

  // Adds p p^T.
  void add_square(const Point& p) {
    xx += p.x * p.x;
    xy += p.x * p.y;
    xz += p.x * p.z;
    yy += p.y * p.y;
    yz += p.y * p.z;
    zz += p.z * p.z;
  }
};

// Sums from which the covariance matrix of points is computed: the number of points, the sum of
// coordinates, and the sums of products of coordinates, all relative to `origin`.
struct Spread {
  Point origin;
  double n = 0.0;
  Point sum{0.0, 0.0, 0.0};
  Symmetric products;

  explicit Spread(const Point& first) : origin(first) {}
  void include(const Point& point) {
    const Point p = point - origin;
    n += 1.0;
    sum = sum + p;
    products.add_square(p);
  }
};

// Sum of a a^T over axes a. An axis is a unit vector of arbitrary sign, or zero.
struct AxisSpread {
  double n = 0.0;
  Symmetric products;

  void include(const Point& a) {
    n += squared_norm(a) > 0.0 ? 1.0 : 0.0;
    products.add_square(a);
  }
};

// The mean direction of the included axes: a unit vector of arbitrary sign. Zero if the mean is not
// unique, or if there are no axes.
Point common_axis(const AxisSpread& spread);

// The direction of least variance of the included points: a unit vector of arbitrary sign. Zero if
// this direction is not unique, for example if the points are on a line.
Point direction_of_least_spread(const Spread& spread);

// Estimates the normal of a point from its neighborhood: the mean of the axes if there are any,
// otherwise the direction of least variance. `axes` is empty or contains one axis per point.
class NormalFit {
 public:
  NormalFit(std::span<const Point> axes, const Point& origin) : axes_(axes), spread_(origin) {}

  // Adds a point of the neighborhood.
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
