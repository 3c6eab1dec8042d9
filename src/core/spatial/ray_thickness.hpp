// The shape diameter function: the thickness of a solid at points of its surface, measured with
// rays.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct RayOptions {
  int n_rays = 30;  // number of rays per point, in a cone with a half-angle of 60 degrees
  // minimum distance of a hit; nearer hits are on the surface around the start
  double least_distance = 0.0;
  bool inside_out = false;  // whether the normals of triangles point inwards
};

// Computes the thickness at each starting point: the weighted mean length of rays in a cone around
// an inward axis (a unit vector). A ray ends at the first triangle that it hits. A ray is used if
// it leaves the solid through the back of this triangle, and if its length is within one standard
// deviation of the median. Rays near the axis have more weight. The result is NaN if the axis is
// zero, or if fewer than a quarter of the rays leave the solid. Time O(F log F) for a tree of
// boxes, and about a microsecond per ray. The result does not depend on the number of threads.
//
// Shapira, Shamir and Cohen-Or, "Consistent mesh partitioning and skeletonisation using the shape
// diameter function", 2008.
Buffer<double> ray_thickness(std::span<const Point> vertices, std::span<const Triangle> triangles,
                             std::span<const Point> starts, std::span<const Point> axes,
                             const RayOptions& options, ThreadTeam& team);

}  // namespace superfacets
