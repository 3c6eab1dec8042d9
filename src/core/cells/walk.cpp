#include "cells/walk.hpp"

#include "base/lists.hpp"

namespace superfacets {
namespace {

class Walker {
 public:
  Walker(const Arcs& arcs, std::span<const Label> labels)
      : arcs_(arcs), labels_(labels), is_visited_(labels.size()) {
    std::ranges::fill(is_visited_, 0);
  }

  // Sorts the cells of a region in the order of a walk. Several threads may walk different regions
  // at the same time.
  void walk(std::span<Cell> cells) {
    std::vector<Cell> starts(cells.begin(), cells.end());
    std::ranges::stable_sort(
        starts, [&](Cell a, Cell b) { return n_waiting_around(a) < n_waiting_around(b); });
    std::size_t n_visited = 0;
    std::vector<Cell> path;
    for (const Cell start : starts) {
      if (is_visited_[start] != 0) continue;
      path.assign({start});
      is_visited_[start] = 1;
      cells[n_visited++] = start;
      while (!path.empty()) {
        const Cell next = next_after(path.back());
        if (next == kNoCell) {
          path.pop_back();
          continue;
        }
        is_visited_[next] = 1;
        cells[n_visited++] = next;
        path.push_back(next);
      }
    }
  }

 private:
  bool is_waiting(Cell cell, Label label) const {
    return labels_[cell] == label && is_visited_[cell] == 0;
  }

  std::ptrdiff_t n_waiting_around(Cell cell) const {
    const std::span<const Cell> near = arcs_.neighbors(cell);
    return std::ranges::count_if(near,
                                 [&](Cell other) { return is_waiting(other, labels_[cell]); });
  }

  Cell next_after(Cell cell) const {
    std::pair<std::ptrdiff_t, Cell> best{0, kNoCell};
    for (const Cell near : arcs_.neighbors(cell)) {
      if (!is_waiting(near, labels_[cell])) continue;
      const std::pair<std::ptrdiff_t, Cell> found{n_waiting_around(near), near};
      if (best.second == kNoCell || found < best) best = found;
    }
    return best.second;
  }

  const Arcs& arcs_;
  const std::span<const Label> labels_;
  Buffer<std::uint8_t> is_visited_;  // (N,) 1 if the cell has been visited
};

}  // namespace

Buffer<Cell> walk_regions(const Arcs& arcs, std::span<const Label> labels, Label n_regions,
                          ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), arcs.n_cells()));
  Lists<Cell> cells = group<Cell>(n_regions, [&](const auto& add) {
    for (Cell cell = 0; cell < arcs.n_cells(); ++cell) {
      if (labels[cell] != kNoLabel) add(labels[cell], cell);
    }
  });
  Walker walker(arcs, labels);
  team.for_each(n_regions, [&](std::int64_t region, int) {
    const std::int64_t begin = cells.offsets[region];
    walker.walk(cells.entries.span().subspan(begin, cells.offsets[region + 1] - begin));
  });
  return std::move(cells.entries);
}

}  // namespace superfacets
