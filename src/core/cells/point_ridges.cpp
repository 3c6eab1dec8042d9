#include "cells/point_ridges.hpp"

#include <array>

#include "cells/weights.hpp"

namespace superfacets {
namespace {

// Minimum angle, in radians, by which the normal rotates over a mean arc length at a point of a
// ridge. Estimated normals spread an edge over about five arcs. The angle in the middle of the edge
// exceeds this minimum even if the angle of the whole edge is only kSharpAngle.
constexpr double kMinTurn = 0.06;

// Distance from a ridge to the flat sides, in mean arc lengths: half the width over which estimated
// normals and averaged shape operators spread an edge. A walk shorter than kReached has not reached
// a flat side.
constexpr double kAway = 4.5;
constexpr double kReached = 0.8 * kAway;

// A side is flat if its curvature is at most this fraction of the curvature of the ridge.
constexpr double kFlatter = 0.3;

// Maximum number of steps of a walk. A step follows one or two arcs, and covers about 1.5 mean arc
// lengths.
constexpr int kMaxHops = 4;

// Weight of the sideways distance of a step, relative to its forward distance.
constexpr double kSideways = 0.25;

// The largest eigenvalue of the concave or convex part of a shape operator, computed from its trace
// and the sum of its squared entries. The part has no negative eigenvalue, and its eigenvalue along
// the normal is 0. Sets *other to the second largest eigenvalue.
double largest_turn(const Bend& bend, double* other = nullptr) {
  const double trace = double{bend.xx} + bend.yy + bend.zz;
  const double squares =
      double{bend.xx} * bend.xx + double{bend.yy} * bend.yy + double{bend.zz} * bend.zz +
      2.0 * (double{bend.xy} * bend.xy + double{bend.xz} * bend.xz + double{bend.yz} * bend.yz);
  const double apart = std::sqrt(std::max(2.0 * squares - trace * trace, 0.0));
  if (other != nullptr) *other = 0.5 * (trace - apart);
  return 0.5 * (trace + apart);
}

// The tangent direction of the largest curvature; zero if the curvature is equal in all directions.
// Subtracting (smaller eigenvalue) x (tangent projection) from the shape operator leaves a matrix
// whose rows are all multiples of this direction.
Point direction_of(const Bend& bend, const Point& normal, double smaller) {
  const auto row = [&](double x, double y, double z, double along, double at_x, double at_y,
                       double at_z) {
    return Point{x - smaller * (at_x - along * normal.x), y - smaller * (at_y - along * normal.y),
                 z - smaller * (at_z - along * normal.z)};
  };
  const std::array rows{row(bend.xx, bend.xy, bend.xz, normal.x, 1.0, 0.0, 0.0),
                        row(bend.xy, bend.yy, bend.yz, normal.y, 0.0, 1.0, 0.0),
                        row(bend.xz, bend.yz, bend.zz, normal.z, 0.0, 0.0, 1.0)};
  const Point longest = *std::ranges::max_element(rows, {}, squared_norm);
  const double length = norm(longest);
  return length > 0.0 ? (1.0 / length) * longest : Point{0.0, 0.0, 0.0};
}

class RidgeFinder {
 public:
  RidgeFinder(std::span<const Point> positions, std::span<const Point> normals, const Arcs& arcs,
              const Bends& bends, double radius)
      : positions_(positions), normals_(normals), arcs_(arcs), bends_(bends), radius_(radius) {}

  bool is_on_ridge(Cell point) const {
    const auto neighbors = arcs_.neighbors(point);
    if (neighbors.size() < 2) return false;  // the end of a line of points, or a duplicate
    double sum = 0.0;
    for (const Cell neighbor : neighbors) sum += norm(positions_[neighbor] - positions_[point]);
    const double spacing = sum / static_cast<double>(neighbors.size());
    if (kAway * spacing > radius_) return false;
    double smaller = 0.0;
    const double turn = largest_turn(bends_.convex[point], &smaller);
    if (!(turn * spacing >= kMinTurn)) return false;
    const Point across = direction_of(bends_.convex[point], normals_[point], smaller);
    const auto one = flat_side(point, across, spacing, kFlatter * turn);
    if (!one) return false;
    const auto other = flat_side(point, -1.0 * across, spacing, kFlatter * turn);
    if (!other) return false;
    return dot(normals_[*one], normals_[*other]) <= std::cos(kSharpAngle);
  }

 private:
  // Walks kAway spacings in a direction and returns the last point. Returns nullopt if the walk
  // ends too early, or if the curvature at the last point is larger than `most`.
  std::optional<Cell> flat_side(Cell from, Point along, double spacing, double most) const {
    Cell at = from;
    double walked = 0.0;
    for (int hop = 0; hop < kMaxHops && walked < kAway * spacing; ++hop) {
      const Cell next = farthest(at, along);
      if (next == at) break;
      walked += norm(positions_[next] - positions_[at]);
      at = next;
      // Direction projected onto the tangent plane.
      const Point flat = along - dot(along, normals_[at]) * normals_[at];
      const double length = norm(flat);
      if (!(length > 0.0)) break;
      along = (1.0 / length) * flat;
    }
    if (!(walked >= kReached * spacing)) return std::nullopt;
    const double bend = std::max(largest_turn(bends_.concave[at]), largest_turn(bends_.convex[at]));
    return bend <= most ? std::optional(at) : std::nullopt;
  }

  // The point within two arcs of `from` that is farthest ahead in the direction `along`, with a
  // deduction for the sideways distance. Points without a normal are skipped. Returns `from` if no
  // point is ahead.
  Cell farthest(Cell from, const Point& along) const {
    const Point side = cross(normals_[from], along);
    Cell best = from;
    double most = 0.0;
    const auto consider = [&](Cell to) {
      const Point step = positions_[to] - positions_[from];
      const double gain = dot(step, along) - kSideways * std::abs(dot(step, side));
      if (!(gain > most) || squared_norm(normals_[to]) == 0.0) return;
      most = gain;
      best = to;
    };
    for (const Cell near : arcs_.neighbors(from)) {
      consider(near);
      for (const Cell next : arcs_.neighbors(near)) consider(next);
    }
    return best;
  }

  const std::span<const Point> positions_;
  const std::span<const Point> normals_;
  const Arcs& arcs_;
  const Bends& bends_;
  const double radius_;
};

}  // namespace

Buffer<std::uint8_t> find_point_ridges(std::span<const Point> positions,
                                       std::span<const Point> normals, const Arcs& arcs,
                                       std::span<const Cell> order, const Bends& bends,
                                       double radius, ThreadTeam& team) {
  SUPERFACETS_ASSERT(bends.convex.size() == positions.size());
  const RidgeFinder finder(positions, normals, arcs, bends, radius);
  Buffer<std::uint8_t> is_on(positions.size());
  const auto n_points = std::ssize(order);
  team.for_each_index(n_points, [&](std::int64_t place) {
    is_on[order[place]] = static_cast<std::uint8_t>(finder.is_on_ridge(order[place]));
  });
  // Noise leaves gaps in a ridge, and regions would leak through the gaps. Marking neighbors of
  // ridge points closes the gaps.
  Buffer<std::uint8_t> is_near(positions.size());
  team.for_each_index(n_points, [&](std::int64_t place) {
    const Cell point = order[place];
    const bool is_beside = std::ranges::any_of(arcs.neighbors(point),
                                               [&](Cell neighbor) { return is_on[neighbor] != 0; });
    is_near[point] = static_cast<std::uint8_t>(is_on[point] != 0 || is_beside);
  });
  return is_near;
}

}  // namespace superfacets
