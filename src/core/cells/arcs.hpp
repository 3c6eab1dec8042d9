// The arcs between cells in CSR form, with iterators over the arcs of a cell.
#pragma once

#include "base/assert.hpp"
#include "base/types.hpp"

namespace superfacets {

// An arc that leaves a cell: its index among all arcs, and its target.
struct Step {
  std::int64_t arc;
  Cell to;
};

// The arcs that leave cell i are offsets[i] .. offsets[i + 1] - 1.
struct Arcs {
  std::span<const std::int64_t> offsets;  // (N + 1,) index of the first arc of each cell
  std::span<const Cell> targets;          // (M,) target cell of each arc

  struct Steps {
    struct Iterator {
      const Cell* targets;
      std::int64_t arc;

      Step operator*() const { return {arc, targets[arc]}; }
      Iterator& operator++() {
        ++arc;
        return *this;
      }
      bool operator!=(const Iterator& other) const { return arc != other.arc; }
    };

    const Cell* targets;
    std::int64_t first;
    std::int64_t last;  // one past the last arc

    Iterator begin() const { return {targets, first}; }
    Iterator end() const { return {targets, last}; }
  };

  Cell n_cells() const { return static_cast<Cell>(offsets.size() - 1); }
  std::int64_t n_arcs() const { return static_cast<std::int64_t>(targets.size()); }

  // Iterates over the arcs of a cell: for (const auto [arc, neighbor] : arcs.steps(cell))
  Steps steps(Cell cell) const {
    SUPERFACETS_ASSERT(cell >= 0 && cell < n_cells());
    return {targets.data(), offsets[cell], offsets[cell + 1]};
  }

  // Iterates over the neighbors of a cell: for (const Cell neighbor : arcs.neighbors(cell))
  std::span<const Cell> neighbors(Cell cell) const {
    SUPERFACETS_ASSERT(cell >= 0 && cell < n_cells());
    return targets.subspan(offsets[cell], offsets[cell + 1] - offsets[cell]);
  }

  bool leads_to(Cell from, Cell to) const {
    const std::span<const Cell> all = neighbors(from);
    return std::ranges::find(all, to) != all.end();
  }
  // Whether a cell has a neighbor with another label.
  bool is_at_border(Cell cell, std::span<const Label> labels) const {
    return std::ranges::any_of(neighbors(cell),
                               [&](Cell neighbor) { return labels[neighbor] != labels[cell]; });
  }

  // Whether the offsets ascend from 0 to the number of arcs, and all targets are valid cells.
  bool are_valid() const {
    return !offsets.empty() && offsets.front() == 0 && offsets.back() == n_arcs() &&
           std::ranges::is_sorted(offsets) && all_below(targets, n_cells());
  }
};

}  // namespace superfacets
