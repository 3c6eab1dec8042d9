// Stage 0: checks whether arrays form a mesh.
#pragma once

#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct MeshFindings {
  bool is_finite = true;    // all coordinates, of vertices that faces use or not
  bool is_in_range = true;  // all corners are vertices
  // Bounding box of the vertices that faces use. Valid only if the mesh is finite and in range.
  Point low{};
  Point high{};
};

// Checks the preconditions of the other kernels, given the corners of all faces in a row. Time
// O(C + V), memory V bytes.
MeshFindings check_mesh(std::span<const Point> vertices, std::span<const Vertex> corners,
                        ThreadTeam& team);

// Copies indices; those that do not fit become -1, which is not in any range.
void narrow_indices(std::span<const std::int64_t> indices, ThreadTeam& team,
                    std::span<std::int32_t> narrow);

// Copies indices that fit.
void narrow_indices(std::span<const std::int32_t> indices, ThreadTeam& team,
                    std::span<std::int32_t> narrow);

struct NumberFindings {
  bool is_valid = true;  // all are finite and >= 0
  double largest = 0.0;  // valid only if all are valid
};

// Checks whether numbers can be areas or weights.
NumberFindings check_numbers(std::span<const double> numbers, ThreadTeam& team);

}  // namespace superfacets
