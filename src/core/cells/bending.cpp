#include "cells/bending.hpp"

#include <array>

namespace superfacets {
namespace {

// Regularization of the fit, as a fraction of the spread of the neighbors. If the neighbors are on
// a line, the regularization makes the surface flat across the line.
constexpr double kStiffness = 1e-9;

// Two orthogonal directions in the tangent plane.
struct Tangents {
  Point u;
  Point v;

  explicit Tangents(const Point& normal) {
    const Point axis = std::abs(normal.x) < 0.7 ? Point{1.0, 0.0, 0.0} : Point{0.0, 1.0, 0.0};
    const Point across = cross(normal, axis);
    u = (1.0 / norm(across)) * across;
    v = cross(normal, u);
  }
};

// A symmetric 2 x 2 matrix in the basis of two tangent vectors.
struct Flat {
  double uu, uv, vv;

  Bend in_space(const Tangents& t) const {
    const auto entry = [&](double Point::* a, double Point::* b) {
      return static_cast<float>(uu * (t.u.*a) * (t.u.*b) + vv * (t.v.*a) * (t.v.*b) +
                                uv * ((t.u.*a) * (t.v.*b) + (t.v.*a) * (t.u.*b)));
    };
    return {entry(&Point::x, &Point::x), entry(&Point::x, &Point::y), entry(&Point::x, &Point::z),
            entry(&Point::y, &Point::y), entry(&Point::y, &Point::z), entry(&Point::z, &Point::z)};
  }

  // Returns a copy of this matrix in which negative eigenvalues are replaced by 0.
  Flat positive_part() const {
    const double mean = 0.5 * (uu + vv);
    const double half = 0.5 * (uu - vv);
    const double apart = std::sqrt(half * half + uv * uv);
    const double high = mean + apart;
    const double low = mean - apart;
    if (low >= 0.0) return *this;
    if (high <= 0.0) return {0.0, 0.0, 0.0};
    const double scale = high / (high - low);
    return {scale * (uu - low), scale * uv, scale * (vv - low)};
  }
};

// Fits a symmetric matrix S with S dx = -dn by least squares. dx is the step to a neighbor, and dn
// is the change of the normal, both projected to the tangent plane. Solves the normal equations by
// Cramer's rule.
Flat fit(std::span<const Point> positions, std::span<const Point> normals,
         std::span<const Cell> neighbors, Cell point, const Tangents& t) {
  double xx = 0.0, xy = 0.0, yy = 0.0;
  double a = 0.0, b = 0.0, c = 0.0;  // right-hand sides of the normal equations for uu, uv and vv
  for (const Cell neighbor : neighbors) {
    const Point step = positions[neighbor] - positions[point];
    const Point change = normals[point] - normals[neighbor];
    if (squared_norm(normals[neighbor]) == 0.0) continue;
    const double x = dot(step, t.u);
    const double y = dot(step, t.v);
    const double along_u = dot(change, t.u);
    const double along_v = dot(change, t.v);
    xx += x * x;
    xy += x * y;
    yy += y * y;
    a += x * along_u;
    b += y * along_u + x * along_v;
    c += y * along_v;
  }
  const double sum = xx + yy;
  if (!(sum > 0.0)) return {0.0, 0.0, 0.0};
  const double p = xx / sum + kStiffness;
  const double q = xy / sum;
  const double r = yy / sum + kStiffness;
  a /= sum;
  b /= sum;
  c /= sum;
  const double middle = p + r;
  const double determinant = p * (middle * r - q * q) - q * q * r;
  return {(a * (middle * r - q * q) - q * (b * r - q * c)) / determinant,
          (p * (b * r - q * c) - a * q * r) / determinant,
          (p * (middle * c - b * q) - q * q * c + a * q * q) / determinant};
}

// The mean shape operator of a point and its neighbors, expressed in the tangent basis of the
// point.
Flat averaged(std::span<const Bend> bends, std::span<const Cell> neighbors, Cell point,
              const Tangents& t) {
  std::array<double, 6> sum{};
  const auto add = [&](const Bend& bend) {
    const std::array<float, 6> entries{bend.xx, bend.xy, bend.xz, bend.yy, bend.yz, bend.zz};
    for (std::size_t i = 0; i < 6; ++i) sum[i] += entries[i];
  };
  add(bends[point]);
  for (const Cell neighbor : neighbors) add(bends[neighbor]);
  const double scale = 1.0 / static_cast<double>(neighbors.size() + 1);
  const auto times = [&](const Point& a) {
    const auto [xx, xy, xz, yy, yz, zz] = sum;
    return scale * Point{xx * a.x + xy * a.y + xz * a.z, xy * a.x + yy * a.y + yz * a.z,
                         xz * a.x + yz * a.y + zz * a.z};
  };
  return {dot(t.u, times(t.u)), dot(t.u, times(t.v)), dot(t.v, times(t.v))};
}

}  // namespace

Bends find_bends(std::span<const Point> positions, std::span<const Point> normals, const Arcs& arcs,
                 std::span<const Cell> order, ThreadTeam& team) {
  SUPERFACETS_ASSERT(positions.size() == normals.size() && order.size() == normals.size());
  constexpr Bend kFlat{0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F};
  const auto n_points = static_cast<std::int64_t>(positions.size());
  const auto for_each_bend = [&](const auto& take) {
    team.for_each_index(n_points, [&](std::int64_t place) {
      take(order[place], squared_norm(normals[order[place]]) > 0.0);
    });
  };
  Buffer<Bend> fitted(n_points);
  for_each_bend([&](Cell point, bool has_normal) {
    fitted[point] = kFlat;
    if (!has_normal) return;
    const Tangents t(normals[point]);
    fitted[point] = fit(positions, normals, arcs.neighbors(point), point, t).in_space(t);
  });
  Bends bends{Buffer<Bend>(n_points), Buffer<Bend>(n_points)};
  for_each_bend([&](Cell point, bool has_normal) {
    bends.concave[point] = kFlat;
    bends.convex[point] = kFlat;
    if (!has_normal) return;
    const Tangents t(normals[point]);
    const Flat all = averaged(fitted.span(), arcs.neighbors(point), point, t);
    bends.concave[point] = all.positive_part().in_space(t);
    const Flat negated{-all.uu, -all.uv, -all.vv};
    bends.convex[point] = negated.positive_part().in_space(t);
  });
  return bends;
}

}  // namespace superfacets
