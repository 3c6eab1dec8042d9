// The interface of cells for stage 2 (weights), stage 5 (regions), metrics and exports: cells,
// arcs, and measures of the borders that arcs cross.
#pragma once

#include <utility>

#include "base/box.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

// Index of a point where borders of cells meet. On a mesh, corners are vertices.
using Corner = std::int64_t;

inline constexpr Corner kNoCorner = -1;

// Lengths of the border that an arc crosses and of the step across the border.
struct CrossedBorder {
  double border_length;  // length of the border that the arc crosses
  double step_length;    // length of the step from cell to cell across the border
};

// Second moment of a shape: the mean of p p^T over the points p of the shape, relative to an
// origin. This is a symmetric matrix.
struct SecondMoment {
  Point squares{0.0, 0.0, 0.0};   // diagonal entries xx, yy, zz
  Point products{0.0, 0.0, 0.0};  // off-diagonal entries xy, xz, yz

  void add(double weight, const SecondMoment& part) {
    squares = squares + weight * part.squares;
    products = products + weight * part.products;
  }
  void add(double weight, const Point& p) {
    add(weight, {{p.x * p.x, p.y * p.y, p.z * p.z}, {p.x * p.y, p.x * p.z, p.y * p.z}});
  }
};

// Size, position, extent and orientation of a cell.
struct CellShape {
  Point position;
  double measure;
  Point area_vector{0.0, 0.0, 0.0};  // area times unit normal; zero if the cell has no normal
  SecondMoment spread;               // second moment about the position; 0 for a point
  Box box;                           // bounding box of the cell's vertices
};

// Each kind of cell implements this interface. Measures are computed on request, because few arcs
// are near a border between regions, and arrays for all arcs would take more memory than all other
// data. Lengths are in the unit of the positions.
class Surface {
 public:
  explicit Surface(const Arcs& arcs) : arcs_(arcs) {}
  Surface(const Surface&) = delete;
  Surface& operator=(const Surface&) = delete;
  virtual ~Surface() = default;

  const Arcs& arcs() const { return arcs_; }
  Cell n_cells() const { return arcs_.n_cells(); }

  virtual Point position(Cell cell) const = 0;
  virtual double measure(Cell cell) const = 0;

  // All measures of a cell. By default, the cell is treated as a point.
  virtual CellShape shape(Cell cell) const {
    const Point at = position(cell);
    return {at, measure(cell), {}, {}, {at, at}};
  }

  // Length of the step from cell to cell across the border (eq. 1 in weights.hpp). The default is
  // the distance between the positions of the two cells.
  virtual double step_length(Cell from, std::int64_t arc) const {
    return norm(position(arcs_.targets[arc]) - position(from));
  }

  // Length of the border that an arc crosses. Between faces, the border is an edge.
  virtual double border_length(Cell from, std::int64_t arc) const = 0;

  // Writes step length and border length of several consecutive arcs of a cell, beginning with
  // `arc`.
  virtual void write_crossed(Cell from, std::int64_t arc, std::span<CrossedBorder> crossed) const {
    for (CrossedBorder& border : crossed) {
      border = {border_length(from, arc), step_length(from, arc)};
      ++arc;
    }
  }

  // The angle between the normals of the two cells that an arc joins, from -pi to pi. The angle is
  // positive where the surface is concave, and 0 where the surface is flat or one of the cells has
  // no normal.
  virtual double angle(Cell from, std::int64_t arc) const = 0;

  // Index of the side that an arc crosses when it leaves its cell. The arcs of a cell are sorted by
  // side. If more than two cells share a side, several arcs cross the same side. By default, each
  // arc crosses a different side.
  virtual int side(Cell from, std::int64_t arc) const {
    return static_cast<int>(arc - arcs_.offsets[from]);
  }

  // Calls visit(begin, end) for each side of a cell that any arc crosses; the arcs begin .. end-1
  // cross the side.
  template <typename Visit>
  void for_each_side(Cell cell, const Visit& visit) const {
    const std::int64_t last = arcs_.offsets[cell + 1];
    for (std::int64_t begin = arcs_.offsets[cell]; begin < last;) {
      std::int64_t end = begin + 1;
      const int crossed = side(cell, begin);
      while (end < last && side(cell, end) == crossed) ++end;
      visit(begin, end);
      begin = end;
    }
  }

  // Length of the part of a cell's border that no arc crosses, as at the boundary of an open mesh.
  virtual double open_length(Cell) const { return 0.0; }

  // Prefetches the data that other functions of this class will read for a cell, and for its arcs
  // beginning with `arc`.
  virtual void prefetch_cell(Cell, std::int64_t /*arc*/) const {}

  // Whether there may be arcs without a reverse arc.
  virtual bool may_have_one_way_arcs() const { return false; }

  // Whether corners are defined. Otherwise, n_sides, corner_between, next_around and leads_around
  // must not be called.
  virtual bool has_corners() const { return false; }
  virtual int n_sides(Cell) const { return 0; }

  // The corner between two sides of a cell, or kNoCorner if they do not meet.
  virtual Corner corner_between(Cell, int /*first_side*/, int /*second_side*/) const {
    return kNoCorner;
  }

  // The cell that follows after `before` and `here` in a walk around a corner; kNoCell if the next
  // cell does not exist or is not unique.
  virtual Cell next_around(Corner, Cell /*before*/, Cell /*here*/) const { return kNoCell; }

  // Whether a walk around a corner reaches the cell `goal`. The walk begins with the step from
  // `before` to `here`, and visits only cells with the label of `here`. The walk fails if the next
  // cell does not exist or is not unique, or after kLongestFan steps.
  virtual bool leads_around(Corner corner, Cell before, Cell here, Cell goal,
                            std::span<const Label> labels) const {
    return walk_around(*this, corner, before, here, goal, labels);
  }

  // Whether the arcs of each cell are sorted by side. Visits all arcs, so it is used in assertions
  // only.
  bool are_sides_sorted() const {
    for (Cell cell = 0; cell < n_cells(); ++cell) {
      int last = 0;
      for (const auto [arc, neighbor] : arcs_.steps(cell)) {
        if (side(cell, arc) < last) return false;
        last = side(cell, arc);
      }
    }
    return true;
  }

 protected:
  // Implements leads_around. `AnySurface` is the concrete class, so that next_around can be
  // inlined.
  template <typename AnySurface>
  static bool walk_around(const AnySurface& surface, Corner corner, Cell before, Cell here,
                          Cell goal, std::span<const Label> labels) {
    const Cell start = before;
    const Label label = labels[here];
    for (int n_steps = 0; here != goal; ++n_steps) {
      const Cell next = n_steps < kLongestFan ? surface.next_around(corner, before, here) : kNoCell;
      if (next == kNoCell || next == start || labels[next] != label) return false;
      before = std::exchange(here, next);
    }
    return true;
  }

 private:
  // Maximum number of steps of a walk around a corner. On real meshes about 6 faces meet at a
  // corner.
  static constexpr int kLongestFan = 64;

  const Arcs arcs_;
};

}  // namespace superfacets
