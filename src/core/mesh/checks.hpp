// Stage 0: checks whether arrays form a mesh.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

struct MeshFindings {
  bool is_finite = true;    // whether all coordinates are finite, including unused vertices
  bool is_in_range = true;  // whether all corners are indices of vertices
  // Bounding box of the vertices used by faces. Valid only if is_finite and is_in_range.
  Point low{};
  Point high{};
};

// Checks the preconditions of the other kernels. `corners` contains the corners of all faces, one
// face after the other. Time O(C + V) for C corners and V vertices. Uses V bytes of memory.
MeshFindings check_mesh(std::span<const Point> vertices, std::span<const Vertex> corners,
                        ThreadTeam& team);

// Copies indices to 32 bits. An index that does not fit into 32 bits becomes -1, which is never a
// valid index.
template <typename Index>
Buffer<std::int32_t> narrow_indices(std::span<const Index> indices, ThreadTeam& team) {
  Buffer<std::int32_t> narrow(indices.size());
  team.for_each_index(std::ssize(indices), [&](std::int64_t i) {
    const auto index = static_cast<std::int32_t>(indices[i]);
    narrow[i] = index == indices[i] ? index : -1;
  });
  return narrow;
}

struct NumberFindings {
  bool is_valid = true;  // whether all numbers are finite and >= 0
  double largest = 0.0;  // the maximum; meaningful only if is_valid
};

// Checks that all numbers are finite and non-negative, as areas and weights must be.
NumberFindings check_numbers(std::span<const double> numbers, ThreadTeam& team);

}  // namespace superfacets
