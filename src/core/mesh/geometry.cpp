#include "mesh/geometry.hpp"

#include <algorithm>
#include <limits>

#include "base/assert.hpp"
#include "base/threads.hpp"

namespace superfacets {
namespace {

// The cross product of two edges of length L carries rounding errors up to about 4 eps L^2; below
// twice that its direction means nothing, and the face counts as one without a normal.
constexpr double kNormalNoise = 8.0 * std::numeric_limits<double>::epsilon();

}  // namespace

void measure_faces(std::span<const Point> vertices, std::span<const Triangle> faces,
                   ThreadTeam& team, std::span<Point> centroids, std::span<double> areas) {
  SUPERFACETS_ASSERT(centroids.size() == faces.size() && areas.size() == faces.size());
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) {
      centroids[face] = centroid(vertices, faces[face]);
      areas[face] = area(vertices, faces[face]);
    }
  });
}

double sliver_area(std::span<const Point> vertices, std::span<const Triangle> faces,
                   std::span<const double> areas, double min_length, double max_height,
                   ThreadTeam& team) {
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  const auto add_slivers = [&](std::int64_t begin, std::int64_t end) {
    double sum = 0.0;
    for (std::int64_t face = begin; face < end; ++face) {
      const auto& [a, b, c] = faces[face].corners;
      const double squared = std::max({squared_norm(vertices[b] - vertices[a]),
                                       squared_norm(vertices[c] - vertices[b]),
                                       squared_norm(vertices[a] - vertices[c])});
      if (squared <= min_length * min_length) continue;
      if (2.0 * areas[face] < max_height * std::sqrt(squared)) sum += areas[face];
    }
    return sum;
  };
  return sum_of_blocks(n_faces, add_slivers, team);
}

void area_vectors(std::span<const Point> vertices, std::span<const Triangle> faces,
                  ThreadTeam& team, std::span<Point> vectors) {
  SUPERFACETS_ASSERT(vectors.size() == faces.size());
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) {
      vectors[face] = 0.5 * double_area_vector(vertices, faces[face]);
    }
  });
}

Point unit_normal(std::span<const Point> vertices, const Triangle& face) {
  const Point& a = vertices[face.corners[0]];
  const Point& b = vertices[face.corners[1]];
  const Point& c = vertices[face.corners[2]];
  const Point direction = double_area_vector(vertices, face);
  const double length = norm(direction);
  const double longest = std::max({squared_norm(b - a), squared_norm(c - b), squared_norm(a - c)});
  if (!(length > kNormalNoise * longest)) return {0.0, 0.0, 0.0};
  return {direction.x / length, direction.y / length, direction.z / length};
}

std::int64_t count_degenerate(std::span<const Point> vertices, std::span<const Triangle> faces) {
  return std::count_if(faces.begin(), faces.end(), [&](const Triangle& face) {
    return squared_norm(unit_normal(vertices, face)) == 0.0;
  });
}

double signed_volume(std::span<const Point> vertices, std::span<const Triangle> faces, Point origin,
                     ThreadTeam& team) {
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  const auto six_volumes = [&](std::int64_t begin, std::int64_t end) {
    double sum = 0.0;
    for (const Triangle& face : faces.subspan(begin, end - begin)) {
      const Point a = vertices[face.corners[0]] - origin;
      const Point b = vertices[face.corners[1]] - origin;
      const Point c = vertices[face.corners[2]] - origin;
      sum += dot(a, cross(b, c));
    }
    return sum;
  };
  return sum_of_blocks(n_faces, six_volumes, team) / 6.0;
}

}  // namespace superfacets
