// A space-filling curve: cells that are near in the order are near in space.
#pragma once

#include "base/box.hpp"
#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Cells sorted along a Morton curve of 2^10 steps an axis over `bounds`, the box around all
// positions; cells on the same step keep the order of their indices. Time O(N); memory 12 bytes a
// cell beside the result, or 20 where all cells are within a tenth of the axes.
Buffer<Cell> morton_order(std::span<const Point> positions, const Box& bounds, ThreadTeam& team);

// The same over the box around all positions, but that more than n_together cells on the same step
// are ordered by halving the box around them, so that cells are near in space wherever they are
// near in the order, however unevenly they are spread. Expected time O(N log N) at worst.
Buffer<Cell> refined_morton_order(std::span<const Point> positions, std::size_t n_together,
                                  ThreadTeam& team);

// The same order of cells that are sorted by code and index already, and may be a part of all, with
// the other cells of their steps.
Buffer<Cell> order_within_steps(std::span<const Point> positions,
                                std::span<const std::uint32_t> codes, std::size_t n_together,
                                ThreadTeam& team);

// The code of each position on that curve: the order is that of codes, then of indices.
Buffer<std::uint32_t> morton_codes(std::span<const Point> positions, const Box& bounds,
                                   ThreadTeam& team);

// Number of bits of a code.
inline constexpr int kCodeBits = 30;

// Cells sorted by codes of kCodeBits bits, stable. Time and memory as for morton_order.
Buffer<Cell> order_of_codes(std::span<const std::uint32_t> codes, ThreadTeam& team);

// The box around all positions.
Box bounds_of(std::span<const Point> positions, ThreadTeam& team);

}  // namespace superfacets
