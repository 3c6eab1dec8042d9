// How a surface bends at the points of a cloud: its curvature, as a tensor.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// A symmetric matrix that takes a step along the surface to the turn of the normal on the way.
struct Bend {
  float xx, xy, xz, yy, yz, zz;

  // The angle that the surface turns by on a small step.
  double turn(const Point& step) const {
    return norm({xx * step.x + xy * step.y + xz * step.z, xy * step.x + yy * step.y + yz * step.z,
                 xz * step.x + yz * step.y + zz * step.z});
  }
};

struct Bends {
  Buffer<Bend> concave;  // (N,) where the surface rises above its tangent plane
  Buffer<Bend> convex;   // (N,) where it falls below, counted positive
};

// The curvature at each point is fitted to the normals of its neighbors, averaged with those, and
// divided into its concave and its convex part. Zero where a point has no normal. Unlike the angle
// between two normals it tells which way the surface turns: on a saddle a step along the ridge is
// convex although it also turns, a little, sideways. What convex costs is not needed where that
// counts nothing: it is then left empty. Points are visited in a given order: near ones after each
// other is faster.
Bends find_bends(std::span<const Point> positions, std::span<const Point> normals, const Arcs& arcs,
                 std::span<const Cell> order, bool wants_convex, ThreadTeam& team);

}  // namespace superfacets
