// Positions without noise.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "mesh/vertex_graph.hpp"

namespace superfacets {

// Positions after n_steps of Taubin's smoothing, each of which moves vertices by 0.5 toward the
// mean of their neighbors and then by 0.53 away from it: bumps as small as an edge vanish, and the
// shape does not shrink. Vertices without neighbors stay. Time O(n_steps * (V + M)); the same bits
// for any number of threads. (Taubin, "A Signal Processing Approach to Fair Surface Design", 1995.)
Buffer<Point> taubin_smooth(std::span<const Point> vertices, std::span<const std::int64_t> offsets,
                            std::span<const Vertex> neighbors, int n_steps, ThreadTeam& team);

}  // namespace superfacets
