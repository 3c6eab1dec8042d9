// Geometric shapes (point, triangle, tetrahedron). Each finds the point of the shape that is
// nearest to a given point.
//
// The result of nearest() is always in the box() of the shape, despite rounding. So
// box().squared_distance(p) is a lower bound of the computed squared distance. A search that prunes
// with boxes therefore has the same result, bit for bit, as an exhaustive search.
#pragma once

#include <utility>

#include "base/box.hpp"

namespace superfacets {

// Returns the point that is nearer to p, or `one` if both are equally near.
inline Point nearer(const Point& p, const Point& one, const Point& other) {
  return squared_norm(p - other) < squared_norm(p - one) ? other : one;
}

inline Point nearest_on_segment(const Point& p, const Point& a, const Point& b) {
  const Point along = b - a;
  const double squared = squared_norm(along);
  if (!(squared > 0.0)) return a;
  const double t = dot(p - a, along) / squared;
  if (t <= 0.0) return a;
  if (t >= 1.0) return b;
  return Box::around({a, b}).clamped(a + t * along);
}

struct PointShape {
  Point at;

  Box box() const { return {at, at}; }
  Point nearest(const Point&) const { return at; }
};

// A triangle. Its corners are sorted by x, y, z, so two triangles that share an edge compute the
// same nearest point on the edge.
class TriangleShape {
 public:
  TriangleShape() = default;
  TriangleShape(const Point& a, const Point& b, const Point& c) : a_(a), b_(b), c_(c) {
    if (b_ < a_) std::swap(a_, b_);
    if (c_ < b_) std::swap(b_, c_);
    if (b_ < a_) std::swap(a_, b_);
  }

  Box box() const { return Box::around({a_, b_, c_}); }

  // If the projection of p is inside the triangle, the result is computed from barycentric
  // coordinates. Otherwise the result is on one of the sides. In a nearly degenerate triangle, only
  // the sides are searched, because every point of the triangle is close to a side.
  Point nearest(const Point& p) const {
    const Point ab = b_ - a_;
    const Point ac = c_ - a_;
    const Point normal = cross(ab, ac);
    const double squared = squared_norm(normal);
    if (squared > kFlat * squared_norm(ab) * squared_norm(ac)) {
      const Point ap = p - a_;
      const double of_b = dot(cross(ap, ac), normal) / squared;
      const double of_c = dot(cross(ab, ap), normal) / squared;
      const bool is_inside = of_b >= 0.0 && of_c >= 0.0 && of_b + of_c <= 1.0;
      if (is_inside) return box().clamped(a_ + of_b * ab + of_c * ac);
    }
    const Point on_ab = nearest_on_segment(p, a_, b_);
    const Point on_ac = nearest_on_segment(p, a_, c_);
    return nearer(p, nearer(p, on_ab, on_ac), nearest_on_segment(p, b_, c_));
  }

 private:
  // Threshold for the squared sine of the angle at the first corner. Below the threshold,
  // barycentric coordinates consist of rounding errors.
  static constexpr double kFlat = 1e-20;

  Point a_, b_, c_;
};

// A solid tetrahedron. If the volume is 0, the shape consists of the four sides only.
class TetShape {
 public:
  TetShape() = default;
  TetShape(const Point& a, const Point& b, const Point& c, const Point& d)
      : a_(a), b_(b), c_(c), d_(d) {}

  Box box() const { return Box::around({a_, b_, c_, d_}); }

  Point nearest(const Point& p) const {
    if (contains(p)) return p;
    const Point on_first =
        nearer(p, TriangleShape(a_, b_, c_).nearest(p), TriangleShape(a_, b_, d_).nearest(p));
    const Point on_last =
        nearer(p, TriangleShape(a_, c_, d_).nearest(p), TriangleShape(b_, c_, d_).nearest(p));
    return nearer(p, on_first, on_last);
  }

 private:
  // Whether p is inside the tetrahedron or on its surface.
  bool contains(const Point& p) const {
    if (box().squared_distance(p) > 0.0) return false;
    const double whole = volume(a_, b_, c_, d_);
    const double sign = whole > 0.0 ? 1.0 : -1.0;
    return whole != 0.0 && sign * volume(p, b_, c_, d_) >= 0.0 &&
           sign * volume(a_, p, c_, d_) >= 0.0 && sign * volume(a_, b_, p, d_) >= 0.0 &&
           sign * volume(a_, b_, c_, p) >= 0.0;
  }

  // Six times the signed volume of the tetrahedron with these corners.
  static double volume(const Point& a, const Point& b, const Point& c, const Point& d) {
    return dot(cross(b - a, c - a), d - a);
  }

  Point a_, b_, c_, d_;
};

}  // namespace superfacets
