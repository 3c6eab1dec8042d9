// Sorts cells along a space-filling curve, so that consecutive cells are near in space.
#pragma once

#include "base/box.hpp"
#include "base/buffer.hpp"
#include "base/threads.hpp"

namespace superfacets {

// A Morton curve with 2^10 steps per axis in a box.
class Curve {
 public:
  explicit Curve(const Box& bounds);

  // Code of kCodeBits bits of a point in the box.
  std::uint32_t code_of(const Point& p) const;

 private:
  const Box bounds_;
  double scale_;  // steps per length
};

// Sorts cells along a Morton curve with 2^10 steps per axis in `bounds`, the bounding box of all
// positions. Cells with equal codes are sorted by index. Time O(N). Uses 12 bytes per cell
// including the result, or 20 if nearly all cells are within a tenth of the box along each axis.
Buffer<Cell> morton_order(std::span<const Point> positions, const Box& bounds, ThreadTeam& team);

// Like morton_order, but cells with equal codes are sorted by position, then by index. If more than
// n_together cells have the same code, they are first split recursively at the median along the
// longest axis of their box. So consecutive cells are near in space even if the density of cells
// varies widely, and the order of different positions does not depend on indices. Takes O(N log N)
// time at most.
Buffer<Cell> refined_morton_order(std::span<const Point> positions, std::size_t n_together,
                                  ThreadTeam& team);

// Sorts cells with an extent by the centers of their boxes, with refined_morton_order.
template <typename BoxOf>
Buffer<Cell> order_of_boxes(std::int64_t n_cells, const BoxOf& box_of, std::size_t n_together,
                            ThreadTeam& team) {
  Buffer<Point> middles(n_cells);  // centers of the boxes, times two
  team.for_each_index(n_cells, [&](std::int64_t cell) {
    const Box box = box_of(cell);
    middles[cell] = box.low + box.high;
  });
  return refined_morton_order(middles.span(), n_together, team);
}

// Splits cells that are sorted with refined_morton_order into ranges of at most n_together cells.
// Each range consists of whole octants of the curve, or of a part of one octant. `codes` contains
// the codes of the sorted cells. Returns the first cell of each range, followed by the number of
// cells.
std::vector<Place> octant_ranges(std::span<const std::uint32_t> codes, std::size_t n_together);

// Computes the Morton code of each position.
Buffer<std::uint32_t> morton_codes(std::span<const Point> positions, const Box& bounds,
                                   ThreadTeam& team);

// Number of bits of a Morton code.
inline constexpr int kCodeBits = 30;

struct SortedCodes {
  Buffer<std::uint32_t> codes;  // sorted codes
  Buffer<Cell> order;           // index of each sorted code in the input
};

// Sorts codes of kCodeBits bits; equal codes keep their order. Time O(N). Uses as much memory as
// morton_order.
SortedCodes sorted_codes(Buffer<std::uint32_t> codes, ThreadTeam& team);

// Calls visit(cells) for each two or more cells with the same code. Calls are made on any thread.
template <typename Visit>
void for_each_run(SortedCodes& sorted, const Visit& visit, ThreadTeam& team) {
  const std::span<const std::uint32_t> codes = sorted.codes.span();
  team.for_each_slow(std::ssize(codes), [&](std::size_t first) {
    if (first > 0 && codes[first - 1] == codes[first]) return;
    std::size_t last = first + 1;
    while (last < codes.size() && codes[last] == codes[first]) ++last;
    if (last > first + 1) visit(sorted.order.span().subspan(first, last - first));
  });
}

// Bounding box of position_of(0), ..., position_of(n - 1).
template <typename PositionOf>
Box bounds_of(std::int64_t n, const PositionOf& position_of, ThreadTeam& team) {
  Box bounds;
  std::mutex mutex;
  team.for_each_block(n, [&](std::int64_t begin, std::int64_t end) {
    Box box;
    for (std::int64_t i = begin; i < end; ++i) box.include(position_of(i));
    const std::scoped_lock lock(mutex);
    bounds.include(box);
  });
  return bounds;
}

// Bounding box of all positions.
inline Box bounds_of(std::span<const Point> positions, ThreadTeam& team) {
  return bounds_of(std::ssize(positions), [&](std::int64_t i) { return positions[i]; }, team);
}

}  // namespace superfacets
