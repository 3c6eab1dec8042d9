// A space-filling curve: cells that are adjacent in the order are near in space.
#pragma once

#include <vector>

#include "base/box.hpp"
#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"

namespace superfacets {

// Cells sorted along a Morton curve of 2^10 steps per axis over `bounds`, the box around all
// positions. Cells with equal codes are sorted by index. Time O(N); memory 12 bytes per cell with
// the result, 20 if all cells are within a tenth of each axis.
Buffer<Cell> morton_order(std::span<const Point> positions, const Box& bounds, ThreadTeam& team);

// Like morton_order over the box around all positions, except that more than n_together cells with
// the same code are ordered by recursive halving of their box. So neighbors in the order are near
// in space however unevenly the cells are spread. Expected time O(N log N) at worst.
Buffer<Cell> refined_morton_order(std::span<const Point> positions, std::size_t n_together,
                                  ThreadTeam& team);

// refined_morton_order for cells that are already sorted by code, then by index. The cells may be a
// subset of all, but must include all cells of each code that occurs.
Buffer<Cell> order_within_steps(std::span<const Point> positions,
                                std::span<const std::uint32_t> codes, std::size_t n_together,
                                ThreadTeam& team);

// Splits cells in refined_morton_order, given their codes, into ranges of at most n_together cells
// that fill whole octants of the curve, or halves of one. Returns the first place of each range,
// and the number of cells.
std::vector<Place> octant_ranges(std::span<const std::uint32_t> codes, std::size_t n_together);

// The Morton code of each position: morton_order sorts by code, then by index.
Buffer<std::uint32_t> morton_codes(std::span<const Point> positions, const Box& bounds,
                                   ThreadTeam& team);

// Number of bits of a code.
inline constexpr int kCodeBits = 30;

// Cells sorted by codes of kCodeBits bits, then by index. Takes the time of morton_order, and its
// memory without the codes.
Buffer<Cell> order_of_codes(std::span<const std::uint32_t> codes, ThreadTeam& team);

// Bounding box of all positions.
Box bounds_of(std::span<const Point> positions, ThreadTeam& team);

}  // namespace superfacets
