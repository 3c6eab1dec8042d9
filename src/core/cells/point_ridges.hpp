// Sharp convex edges of a cloud.
#pragma once

#include "cells/bending.hpp"

namespace superfacets {

// Returns an array (N,) with 1 for each point on or next to a ridge, and 0 for all other points. A
// ridge is a convex edge between two flat sides that meet at an angle of kSharpAngle or more. Walls
// of a room and faces of a machine part meet at ridges; rounded limbs have no ridges. Flipping all
// normals swaps convex and concave edges. Both ridges and concave edges increase weights, so a
// sharp edge increases weights for either sign of the normals.
//
// Estimated normals spread an edge over several arcs. Where half this width exceeds `radius`, the
// radius of a region, nothing is marked, because limbs would look like ridges on sparse points.
//
// A mark depends on the points up to 10 arcs away and on their shape operators.
Buffer<std::uint8_t> find_point_ridges(std::span<const Point> positions,
                                       std::span<const Point> normals, const Arcs& arcs,
                                       std::span<const Cell> order, const Bends& bends,
                                       double radius, ThreadTeam& team);

}  // namespace superfacets
