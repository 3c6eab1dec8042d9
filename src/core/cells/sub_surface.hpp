// A surface that consists of some cells of another surface, and of some arcs between them.
#pragma once

#include "cells/surface.hpp"

namespace superfacets {

// The kept cells and arcs, as ascending indices in the whole surface.
struct KeptParts {
  std::span<const Cell> cells;         // (n_cells,) index of each kept cell
  std::span<const std::int64_t> arcs;  // (n_arcs,) index of each kept arc
};

// Surface of the kept cells. Measures are read from the whole surface. The side of a dropped arc is
// treated as an open boundary, and no walk around a corner crosses this side.
class SubSurface final : public Surface {
 public:
  // `arcs` contains every kept arc. Its offsets and targets refer to kept cells by their new
  // indices.
  SubSurface(const Surface& whole, const Arcs& arcs, const KeptParts& kept)
      : Surface(arcs), whole_(whole), kept_(kept), new_cells_(whole.n_cells(), kNoCell) {
    SUPERFACETS_ASSERT(arcs.are_valid() && std::cmp_equal(kept.cells.size(), arcs.n_cells()));
    SUPERFACETS_ASSERT(std::ssize(kept.arcs) == arcs.n_arcs());
    SUPERFACETS_ASSERT(all_below(kept.cells, whole.n_cells()) &&
                       all_below(kept.arcs, whole.arcs().n_arcs()));
    for (Cell cell = 0; cell < n_cells(); ++cell) new_cells_[kept.cells[cell]] = cell;
  }

  Point position(Cell cell) const override { return whole_.position(kept_.cells[cell]); }
  double measure(Cell cell) const override { return whole_.measure(kept_.cells[cell]); }
  CellShape shape(Cell cell) const override { return whole_.shape(kept_.cells[cell]); }
  double step_length(Cell from, std::int64_t arc) const override {
    return whole_.step_length(kept_.cells[from], kept_.arcs[arc]);
  }
  double border_length(Cell from, std::int64_t arc) const override {
    return whole_.border_length(kept_.cells[from], kept_.arcs[arc]);
  }
  double angle(Cell from, std::int64_t arc) const override {
    return whole_.angle(kept_.cells[from], kept_.arcs[arc]);
  }
  int side(Cell from, std::int64_t arc) const override {
    return whole_.side(kept_.cells[from], kept_.arcs[arc]);
  }

  // The open length of the cell in the whole surface, plus the border lengths of sides without kept
  // arcs.
  double open_length(Cell cell) const override {
    const Cell old = kept_.cells[cell];
    double length = whole_.open_length(old);
    whole_.for_each_side(old, [&](std::int64_t begin, std::int64_t) {
      if (!has_arc_by(cell, whole_.side(old, begin))) length += whole_.border_length(old, begin);
    });
    return length;
  }

  bool may_have_one_way_arcs() const override { return whole_.may_have_one_way_arcs(); }
  bool has_corners() const override { return whole_.has_corners(); }
  int n_sides(Cell cell) const override { return whole_.n_sides(kept_.cells[cell]); }
  Corner corner_between(Cell cell, int first_side, int second_side) const override {
    return whole_.corner_between(kept_.cells[cell], first_side, second_side);
  }
  Cell next_around(Corner corner, Cell before, Cell here) const override {
    const Cell next = whole_.next_around(corner, kept_.cells[before], kept_.cells[here]);
    if (next == kNoCell || new_cells_[next] == kNoCell) return kNoCell;
    const bool is_kept = arcs().leads_to(here, new_cells_[next]);
    return is_kept ? new_cells_[next] : kNoCell;
  }

 private:
  bool has_arc_by(Cell cell, int wanted) const {
    for (const auto [arc, neighbor] : arcs().steps(cell)) {
      if (side(cell, arc) == wanted) return true;
    }
    return false;
  }

  const Surface& whole_;
  const KeptParts kept_;
  // New index of each cell of the whole surface, or kNoCell if the cell is dropped.
  std::vector<Cell> new_cells_;
};

}  // namespace superfacets
