// Sharp convex edges of a cloud.
#pragma once

#include "base/buffer.hpp"
#include "cells/bending.hpp"

namespace superfacets {

// Marks the points on or next to a ridge (1; 0 for all others): a convex edge between two sides
// that are flat and meet at kSharpAngle or more. Walls of a room and faces of a machine part meet
// at ridges, rounded limbs do not. Turning all normals around turns concave creases into convex
// ones, but an edge between flat sides counts either way, so which side is the outside does not
// matter.
//
// Estimated normals spread an edge over several arcs. Where that is wider than `radius`, of a
// region, there are no ridges: on sparse points they would be limbs.
//
// A mark depends on points up to 10 arcs away, and on their bends (halos.STEPS counts them).
Buffer<std::uint8_t> find_point_ridges(std::span<const Point> positions,
                                       std::span<const Point> normals, const Arcs& arcs,
                                       std::span<const Cell> order, const Bends& bends,
                                       double radius, ThreadTeam& team);

}  // namespace superfacets
