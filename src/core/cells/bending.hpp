// Shape operators (curvature) at the points of a cloud.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Shape operator: a symmetric matrix that maps a tangent step to the change of the normal.
struct Bend {
  float xx, xy, xz, yy, yz, zz;

  // Angle in radians by which the normal rotates along a small step.
  double turn(const Point& step) const {
    return norm({xx * step.x + xy * step.y + xz * step.z, xy * step.x + yy * step.y + yz * step.z,
                 xz * step.x + yz * step.y + zz * step.z});
  }
};

struct Bends {
  // (N,) curvature in the directions in which the surface rises above the tangent plane
  Buffer<Bend> concave;
  // (N,) negated curvature in the directions in which the surface falls below the tangent plane
  Buffer<Bend> convex;
};

// Fits a shape operator to the normals around each point, averages it with the operators of the
// neighbors, and splits it into a concave and a convex part. The operator is zero at a point
// without a normal. Unlike the angle between two normals, a shape operator has a sign for each
// direction: on a saddle, a step along the ridge is convex although the normal also rotates a
// little sideways. Points are visited in `order`, which should be a spatial order for speed.
Bends find_bends(std::span<const Point> positions, std::span<const Point> normals, const Arcs& arcs,
                 std::span<const Cell> order, ThreadTeam& team);

}  // namespace superfacets
