// The shape diameter function: thickness of a body below points of its surface, measured by rays.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct RayOptions {
  int n_rays = 30;  // rays from each point, evenly in a cone of half-angle 60 degrees
  // nearer hits are ignored, because they are on the surface around the start
  double least_distance = 0.0;
  bool inside_out = false;  // whether the normals of triangles point inwards
};

// The thickness at each start: a mean of the lengths of rays about an inward axis (a unit vector)
// up to the first triangle that they hit. A ray counts if it leaves the body there, through the
// back of the triangle, and if its length is within one standard deviation of the median; rays near
// the axis have more weight. NaN if the axis is zero, or if fewer than a quarter of the rays leave:
// the point is not on a solid. Time O(F log F) for a tree of boxes, and about a microsecond per
// ray. The result does not depend on the number of threads.
//
// Shapira, Shamir and Cohen-Or, "Consistent mesh partitioning and skeletonisation using the shape
// diameter function", 2008.
Buffer<double> ray_thickness(std::span<const Point> vertices, std::span<const Triangle> triangles,
                             std::span<const Point> starts, std::span<const Point> axes,
                             const RayOptions& options, ThreadTeam& team);

}  // namespace superfacets
