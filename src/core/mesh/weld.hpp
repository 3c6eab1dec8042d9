// Stage 0: treats vertices at the same position as one.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// For each vertex, the lowest index among the vertices at exactly the same position (-0.0 equals
// 0.0). There are at most 2^31 - 1 vertices, with finite positions. Expected time O(V); memory at
// most 20 bytes per vertex in addition to the result.
Buffer<Vertex> weld_vertices(std::span<const Point> vertices, ThreadTeam& team);

// Lists the vertices that represent themselves, ascending.
std::vector<Vertex> representatives_of(std::span<const Vertex> representative);

}  // namespace superfacets
