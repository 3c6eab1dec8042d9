// Point clouds as cells: the measures of arcs between neighboring points.
#pragma once

#include <unordered_map>

#include "cells/point_ridges.hpp"
#include "cells/weights.hpp"

namespace superfacets {

// Surface of a point cloud and its graph, with arcs in both directions. The surface has no corners,
// because the neighbors around a point are not ordered.
class PointSurface final : public Surface {
 public:
  // Normals have length 1, or are zero where undefined. `normals` is empty if no kernel needs them.
  // `order` lists all points in a spatial order.
  PointSurface(std::span<const Point> positions, std::span<const double> areas,
               std::span<const Point> normals, std::span<const Cell> order, const Arcs& arcs)
      : Surface(arcs), positions_(positions), areas_(areas), normals_(normals), order_(order) {
    SUPERFACETS_ASSERT(arcs.are_valid() && std::cmp_equal(positions.size(), arcs.n_cells()));
    SUPERFACETS_ASSERT(areas.size() == positions.size());
    SUPERFACETS_ASSERT(normals.empty() || normals.size() == positions.size());
    SUPERFACETS_ASSERT(order.size() == positions.size() && all_below(order, arcs.n_cells()));
    for (Cell point = 0; point < n_cells(); ++point) {
      const bool is_crowded = arcs.neighbors(point).size() > kMaxInARow;
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
  Bends find_bends(ThreadTeam& team) const {
    return superfacets::find_bends(positions_, normals_, arcs(), order_, team);
  }
  Buffer<std::uint8_t> find_ridges(const Bends& bends, double radius, ThreadTeam& team) const {
    return find_point_ridges(positions_, normals_, arcs(), order_, bends, radius, team);
  }

  // The mean of pi a / (sum of arc lengths) over both points, where a is the area of a point. With
  // this definition, the border lengths of all arcs that cross a line sum up to the length of the
  // line, on average over its directions (Cauchy-Crofton formula).
  double border_length(Cell from, std::int64_t arc) const override;

  double angle(Cell from, std::int64_t arc) const override;

 private:
  // pi a / (sum of arc lengths) of a point; see border_length. Each arc of a point needs this sum,
  // so the sum is cached for points with many arcs. For example, a point with a million duplicates
  // has a million arcs.
  static constexpr std::size_t kMaxInARow = 32;
  double border_per_arc(Cell point) const {
    const bool is_crowded = arcs().neighbors(point).size() > kMaxInARow;
    return is_crowded ? border_of_crowded_.at(point) : sum_border_per_arc(point);
  }
  double sum_border_per_arc(Cell point) const;

  const std::span<const Point> positions_;
  const std::span<const double> areas_;
  const std::span<const Point> normals_;
  const std::span<const Cell> order_;
  std::unordered_map<Cell, double>
      border_of_crowded_;  // cached sums of points with more than kMaxInARow arcs
};

// Computes the weights of arcs with eq. 1-3 (see weights.hpp). The geodesic term (eq. 1) is the
// distance of the two points. In the angular term (eq. 2), theta is the angle between the normals
// if steps are straight, and otherwise the smaller of the angles by which the shape operators at
// both ends rotate the normal along the step (see Bend). Convex angles have a larger weight on
// ridges (point_ridges.hpp). An arc and its reverse arc get bit-identical weights.
WeighedArcs point_weights(const PointSurface& surface, const EdgeFactors& factors,
                          ThreadTeam& team);

}  // namespace superfacets
