#include "mesh/polygons.hpp"

#include "base/box.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// Calls visit(u, v) for each triangle (0, i, i + 1) of the fan triangulation of a polygon; u and v
// are the vectors from corner 0 to the other two corners of the triangle.
template <typename Visit>
void for_each_of_fan(std::span<const Point> vertices, std::span<const Vertex> corners,
                     const Visit& visit) {
  const Point& origin = vertices[corners[0]];
  Point step = vertices[corners[1]] - origin;
  for (const Vertex corner : corners.subspan(2)) {
    const Point next = vertices[corner] - origin;
    visit(step, next);
    step = next;
  }
}

// Squared length of the longest side in the fan triangulation of a polygon.
double longest_squared(std::span<const Point> vertices, std::span<const Vertex> corners) {
  double longest = 0.0;
  for_each_of_fan(vertices, corners, [&](const Point& u, const Point& v) {
    longest = std::max({longest, squared_norm(u), squared_norm(v), squared_norm(v - u)});
  });
  return longest;
}

// Scales a direction to length 1. Returns zero if the length is not larger than the rounding error
// of the fan triangulation.
Point normal_along(const Point& direction, std::span<const Point> vertices,
                   std::span<const Vertex> corners) {
  // The rounding errors of the triangles add up.
  const auto n_triangles = static_cast<double>(corners.size() - 2);
  return unit_normal_along(direction, n_triangles * longest_squared(vertices, corners));
}

Point centroid_of_fan(std::span<const Point> vertices, std::span<const Vertex> corners,
                      const Point& normal) {
  if (corners.size() == 3) return centroid(vertices, {corners[0], corners[1], corners[2]});
  if (squared_norm(normal) == 0.0) return mean_corner(vertices, corners);
  Point moment{0.0, 0.0, 0.0};
  double total = 0.0;
  for_each_of_fan(vertices, corners, [&](const Point& u, const Point& v) {
    const double weight = dot(cross(u, v), normal);
    moment = moment + weight * (u + v);
    total += weight;
  });
  Box box;
  for (const Vertex corner : corners) box.include(vertices[corner]);
  return box.clamped(vertices[corners[0]] + (1.0 / (3.0 * total)) * moment);
}

// Cuts one polygon into triangles, in the projection along its normal.
class EarCutter {
 public:
  EarCutter(std::span<const Point> vertices, std::span<const Vertex> corners)
      : vertices_(vertices),
        rest_(corners.begin(), corners.end()),
        normal_(double_area_vector(vertices, corners)) {}

  void cut(std::span<Triangle> triangles) {
    for (Triangle& triangle : triangles) {
      const std::size_t ear = rest_.size() > 3 ? find_ear() : 1;
      triangle = {{before(ear), rest_[ear], after(ear)}};
      rest_.erase(rest_.begin() + static_cast<std::ptrdiff_t>(ear));
    }
  }

 private:
  Vertex before(std::size_t i) const { return rest_[i == 0 ? rest_.size() - 1 : i - 1]; }
  Vertex after(std::size_t i) const { return rest_[i + 1 == rest_.size() ? 0 : i + 1]; }

  // Returns the next corner that can be cut off. If no corner is an ear, returns corner 1, so the
  // remaining polygon is cut into a fan.
  std::size_t find_ear() const {
    for (std::size_t i = 1; i <= rest_.size(); ++i) {
      if (is_ear(i % rest_.size())) return i % rest_.size();
    }
    return 1;
  }

  bool is_ear(std::size_t i) const {
    const Vertex tip[] = {before(i), rest_[i], after(i)};
    if (!(turn(tip[0], tip[1], tip[2]) > 0.0)) return false;
    return std::ranges::none_of(rest_, [&](Vertex other) {
      if (std::find(std::begin(tip), std::end(tip), other) != std::end(tip)) return false;
      return turn(tip[0], tip[1], other) >= 0.0 && turn(tip[1], tip[2], other) >= 0.0 &&
             turn(tip[2], tip[0], other) >= 0.0;
    });
  }

  // Positive if a, b, c are in counterclockwise order.
  double turn(Vertex a, Vertex b, Vertex c) const {
    return dot(cross(vertices_[b] - vertices_[a], vertices_[c] - vertices_[a]), normal_);
  }

  std::span<const Point> vertices_;
  std::vector<Vertex> rest_;  // corners of the remaining polygon
  Point normal_;
};

// Whether all triangles of the fan triangulation have the orientation of the polygon.
bool is_fan_flat(std::span<const Point> vertices, std::span<const Vertex> corners) {
  const Point normal = double_area_vector(vertices, corners);
  bool is_flat = true;
  for_each_of_fan(vertices, corners, [&](const Point& u, const Point& v) {
    is_flat &= dot(cross(u, v), normal) >= 0.0;
  });
  return is_flat;
}

void triangulate_one(std::span<const Point> vertices, std::span<const Vertex> corners,
                     std::span<Triangle> triangles) {
  if (corners.size() <= kMaxCornersCut && !is_fan_flat(vertices, corners)) {
    EarCutter(vertices, corners).cut(triangles);
    return;
  }
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    triangles[i] = {{corners[0], corners[i + 1], corners[i + 2]}};
  }
}

}  // namespace

bool Polygons::are_valid() const {
  if (offsets.empty() || offsets.front() != 0) return false;
  for (std::size_t i = 1; i < offsets.size(); ++i) {
    if (offsets[i] - offsets[i - 1] < 3) return false;
  }
  return std::cmp_equal(offsets.back(), corners.size());
}

Point double_area_vector(std::span<const Point> vertices, std::span<const Vertex> corners) {
  Point sum{0.0, 0.0, 0.0};
  for_each_of_fan(vertices, corners,
                  [&](const Point& u, const Point& v) { sum = sum + cross(u, v); });
  return sum;
}

Point unit_normal(std::span<const Point> vertices, std::span<const Vertex> corners) {
  return normal_along(double_area_vector(vertices, corners), vertices, corners);
}

Point mean_corner(std::span<const Point> vertices, std::span<const Vertex> corners) {
  // Sums positions relative to a corner, to avoid cancellation in small polygons.
  const Point& origin = vertices[corners[0]];
  Point sum{0.0, 0.0, 0.0};
  for (const Vertex corner : corners) sum = sum + (vertices[corner] - origin);
  return origin + (1.0 / static_cast<double>(corners.size())) * sum;
}

PolygonShapes measure_polygons(std::span<const Point> vertices, const Polygons& faces,
                               ThreadTeam& team) {
  SUPERFACETS_ASSERT(faces.are_valid());
  const std::int64_t n = faces.n_faces();
  PolygonShapes shapes{Buffer<Point>(n), Buffer<double>(n), Buffer<Point>(n)};
  team.for_each_index(n, [&](Face face) {
    const Point direction = double_area_vector(vertices, faces[face]);
    const Point normal = normal_along(direction, vertices, faces[face]);
    shapes.centroids[face] = centroid_of_fan(vertices, faces[face], normal);
    shapes.areas[face] = 0.5 * norm(direction);
    shapes.normals[face] = normal;
  });
  return shapes;
}

double polygon_sliver_area(std::span<const Point> vertices, const Polygons& faces,
                           std::span<const double> areas, double min_length, double max_height,
                           ThreadTeam& team) {
  const auto sliver_area_of = [&](Face face) {
    const double squared = longest_squared(vertices, faces[face]);
    if (squared <= min_length * min_length) return 0.0;
    const double times_height = (faces.n_sides(face) == 3 ? 2.0 : 1.0) * areas[face];
    return times_height < max_height * std::sqrt(squared) ? areas[face] : 0.0;
  };
  return sum_over(faces.n_faces(), sliver_area_of, team);
}

Buffer<Triangle> triangulate(std::span<const Point> vertices, const Polygons& faces,
                             ThreadTeam& team) {
  Buffer<Triangle> triangles(std::ssize(faces.corners) - 2 * faces.n_faces());
  team.for_each_index(faces.n_faces(), [&](Face face) {
    const std::int64_t first = faces.offsets[face] - 2 * std::int64_t{face};
    triangulate_one(vertices, faces[face],
                    triangles.span().subspan(first, faces.n_sides(face) - 2));
  });
  return triangles;
}

}  // namespace superfacets
