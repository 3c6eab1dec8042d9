// Stage 0: finds a representative for all vertices at the same position.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Returns the representative of each vertex, (V,): the lowest vertex at exactly the same position
// (-0.0 equals 0.0). `vertices` has at most 2^31 - 1 points, and all coordinates are finite.
// Expected time O(V). Memory: at most 20 bytes per vertex in addition to the result.
Buffer<Vertex> weld_vertices(std::span<const Point> vertices, ThreadTeam& team);

// Lists the vertices that represent themselves, ascending.
std::vector<Vertex> representatives_of(std::span<const Vertex> representative);

}  // namespace superfacets
