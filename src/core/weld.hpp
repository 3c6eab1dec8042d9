// Stage 0: vertices at the same position count as one.
#pragma once

#include "types.hpp"

namespace superfacets {

// For each vertex the lowest index among the vertices at exactly the same position (-0.0 is 0.0).
// Expected time and memory O(V).
std::vector<Vertex> weld_vertices(std::span<const Point> vertices);

}  // namespace superfacets
