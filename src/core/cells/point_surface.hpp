// Points as cells: the measures of arcs between neighbors in a cloud.
#pragma once

#include <unordered_map>

#include "base/assert.hpp"
#include "base/threads.hpp"
#include "cells/bending.hpp"
#include "cells/surface.hpp"
#include "cells/weights.hpp"

namespace superfacets {

// A cloud and the arcs of its graph, which lead both ways. There are no corners: the order of
// neighbors around a point is not known.
class PointSurface final : public Surface {
 public:
  // Normals are of length 1, or zero where a point has none; empty where none are wanted. The
  // order holds all points, near ones after each other.
  PointSurface(std::span<const Point> positions, std::span<const double> areas,
               std::span<const Point> normals, std::span<const Cell> order, const Arcs& arcs)
      : Surface(arcs), positions_(positions), areas_(areas), normals_(normals), order_(order) {
    SUPERFACETS_ASSERT(arcs.are_valid() && std::cmp_equal(positions.size(), arcs.n_cells()));
    SUPERFACETS_ASSERT(areas.size() == positions.size());
    SUPERFACETS_ASSERT(normals.empty() || normals.size() == positions.size());
    SUPERFACETS_ASSERT(order.size() == positions.size() && all_below(order, arcs.n_cells()));
    for (Cell point = 0; point < n_cells(); ++point) {
      const bool is_crowded = arcs.neighbors(point).size() > kMostInARow;
      if (is_crowded) border_of_crowded_.emplace(point, sum_border_per_arc(point));
    }
  }

  Point position(Cell point) const override { return positions_[point]; }
  double measure(Cell point) const override { return areas_[point]; }
  CellShape shape(Cell point) const override {
    const Point& at = positions_[point];
    const Point normal = normals_.empty() ? Point{} : normals_[point];
    return {at, areas_[point], areas_[point] * normal, {}, {at, at}};
  }
  std::span<const Cell> order() const { return order_; }
  Bends find_bends(bool wants_convex, ThreadTeam& team) const {
    return superfacets::find_bends(positions_, normals_, arcs(), order_, wants_convex, team);
  }

  // The distance between the points.
  double step_length(Cell from, std::int64_t arc) const override {
    return norm(positions_[arcs().targets[arc]] - positions_[from]);
  }

  // pi a / (sum of the lengths of its arcs), the mean of both points, where a is the area around a
  // point: with it, the borders of the arcs that cross a line add up to the length of the line, on
  // average over its directions (Cauchy and Crofton).
  double border_length(Cell from, std::int64_t arc) const override;

  double angle(Cell from, std::int64_t arc) const override;
  int side(Cell from, std::int64_t arc) const override {
    return static_cast<int>(arc - arcs().offsets[from]);
  }
  double open_length(Cell) const override { return 0.0; }

 private:
  // Total border length per crowded point. Each of its arcs needs it, and a point with a million
  // duplicates has a million arcs: so it is computed once.
  static constexpr std::size_t kMostInARow = 32;
  double border_per_arc(Cell point) const {
    const bool is_crowded = arcs().neighbors(point).size() > kMostInARow;
    return is_crowded ? border_of_crowded_.at(point) : sum_border_per_arc(point);
  }
  double sum_border_per_arc(Cell point) const;

  const std::span<const Point> positions_;
  const std::span<const double> areas_;
  const std::span<const Point> normals_;
  const std::span<const Cell> order_;
  std::unordered_map<Cell, double> border_of_crowded_;  // points with more than kMostInARow arcs
};

// Weights by eq. 1-3 (weights.hpp), where the distance of the points is eq. 1, and the turn of the
// surface on the way, by its curvature at that end where it is less, is theta in eq. 2. Symmetric
// in the two points, bit for bit.
void point_weights(const PointSurface& surface, const WeightOptions& options, ThreadTeam& team,
                   std::span<double> weights);

}  // namespace superfacets
