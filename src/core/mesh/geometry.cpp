#include "mesh/geometry.hpp"

#include <limits>

#include "base/point_block.hpp"

namespace superfacets {
namespace {

// Threshold for the length of a cross product. The cross product of two edges of length L has
// rounding errors up to about 4 eps L^2. If the product is shorter than twice this error, its
// direction is arbitrary, and the face has no normal.
constexpr double kNormalNoise = 8.0 * std::numeric_limits<double>::epsilon();

// Number of faces per block. The data of a block fits into the first-level cache.
constexpr std::size_t kFacesAtOnce = 64;

using Numbers = std::array<double, kFacesAtOnce>;
using Points = PointBlock<kFacesAtOnce>;

// Squared length of the longest side of a face.
inline double longest_squared(std::span<const Point> vertices, const Triangle& face) {
  const auto& [a, b, c] = face.corners;
  return std::max({squared_norm(vertices[b] - vertices[a]), squared_norm(vertices[c] - vertices[b]),
                   squared_norm(vertices[a] - vertices[c])});
}

struct Shapes {
  Points centroids;
  Numbers areas;
  Points normals;
  Numbers longest;
};

// Measures the first n faces of a block, with the same formulas as centroid(), area() and
// unit_normal().
struct Measure {
  SUPERFACETS_ALWAYS_INLINE void operator()(const std::array<Points, 3>& corners, Shapes* shapes,
                                            std::size_t n) const {
    for (std::size_t i = 0; i < n; ++i) {
      const Point a = corners[0].get(i);
      const Point b = corners[1].get(i);
      const Point c = corners[2].get(i);
      const Point sum = a + b + c;
      shapes->centroids.set(i, {sum.x / 3.0, sum.y / 3.0, sum.z / 3.0});
      const Point direction = cross(b - a, c - a);
      const double length = norm(direction);
      const double longest =
          std::max(std::max(squared_norm(b - a), squared_norm(c - b)), squared_norm(a - c));
      const bool has_normal = length > kNormalNoise * longest;
      const double divisor = has_normal ? length : 1.0;
      shapes->normals.set(
          i, {has_normal ? direction.x / divisor : 0.0, has_normal ? direction.y / divisor : 0.0,
              has_normal ? direction.z / divisor : 0.0});
      shapes->areas[i] = 0.5 * length;
      shapes->longest[i] = longest;
    }
  }
};

// Measures faces begin .. end-1. Returns the squared length of their longest side.
double measure_range(std::span<const Point> vertices, std::span<const Triangle> faces,
                     std::int64_t begin, std::int64_t end, FaceShapes& all) {
  const InstructionSet with = best_instruction_set();
  std::array<Points, 3> corners;
  Shapes shapes;
  double longest = 0.0;
  for (std::int64_t first = begin; first < end; first += kFacesAtOnce) {
    const std::size_t n = std::min<std::size_t>(kFacesAtOnce, end - first);
    for (std::size_t i = 0; i < n; ++i) {
      const Triangle& face = faces[first + i];
      for (int corner = 0; corner < 3; ++corner) {
        corners[corner].set(i, vertices[face.corners[corner]]);
      }
    }
    run_version(with, Measure{}, corners, &shapes, n);
    for (std::size_t i = 0; i < n; ++i) all.centroids[first + i] = shapes.centroids.get(i);
    for (std::size_t i = 0; i < n; ++i) all.normals[first + i] = shapes.normals.get(i);
    std::copy_n(shapes.areas.begin(), n, all.areas.begin() + first);
    longest =
        std::max(longest, *std::max_element(shapes.longest.begin(), shapes.longest.begin() + n));
  }
  return longest;
}

}  // namespace

FaceShapes measure_faces(std::span<const Point> vertices, std::span<const Triangle> faces,
                         ThreadTeam& team) {
  const std::size_t n = faces.size();
  FaceShapes shapes{Buffer<Point>(n), Buffer<double>(n), Buffer<Point>(n),
                    Buffer<double>((n + kSumBlock - 1) / kSumBlock)};
  const auto measure = [&](std::int64_t begin, std::int64_t end) {
    shapes.longest[begin / kSumBlock] = measure_range(vertices, faces, begin, end, shapes);
  };
  team.for_each_block(std::ssize(faces), measure, kSumBlock);
  return shapes;
}

double sliver_area(std::span<const Point> vertices, std::span<const Triangle> faces,
                   std::span<const double> areas, std::span<const double> longest,
                   double min_length, double max_height, ThreadTeam& team) {
  const auto n_faces = static_cast<std::int64_t>(faces.size());
  const auto add_slivers = [&](std::int64_t begin, std::int64_t end) {
    double sum = 0.0;
    if (longest[begin / kSumBlock] <= min_length * min_length) return sum;
    for (std::int64_t face = begin; face < end; ++face) {
      const double squared = longest_squared(vertices, faces[face]);
      if (squared <= min_length * min_length) continue;
      if (2.0 * areas[face] < max_height * std::sqrt(squared)) sum += areas[face];
    }
    return sum;
  };
  return sum_of_blocks(n_faces, add_slivers, team);
}

Buffer<Point> area_vectors(std::span<const Point> vertices, std::span<const Triangle> faces,
                           ThreadTeam& team) {
  Buffer<Point> vectors(faces.size());
  team.for_each_index(std::ssize(faces), [&](std::int64_t face) {
    vectors[face] = 0.5 * double_area_vector(vertices, faces[face]);
  });
  return vectors;
}

Point unit_normal_along(const Point& direction, double longest_squared) {
  const double length = norm(direction);
  if (!(length > kNormalNoise * longest_squared)) return {0.0, 0.0, 0.0};
  return {direction.x / length, direction.y / length, direction.z / length};
}

Point unit_normal(std::span<const Point> vertices, const Triangle& face) {
  return unit_normal_along(double_area_vector(vertices, face), longest_squared(vertices, face));
}

std::int64_t count_degenerate(std::span<const Point> vertices, std::span<const Triangle> faces) {
  return std::ranges::count_if(faces, [&](const Triangle& face) {
    return squared_norm(unit_normal(vertices, face)) == 0.0;
  });
}

Point weighted_mean(std::span<const Point> positions, std::span<const double> weights,
                    ThreadTeam& team) {
  const auto sum_along = [&](double Point::* axis) {
    const auto term = [&](std::int64_t i) { return weights[i] * (positions[i].*axis); };
    return sum_over(std::ssize(weights), term, team);
  };
  const Point moment{sum_along(&Point::x), sum_along(&Point::y), sum_along(&Point::z)};
  const double total = sum_of(weights, team);
  return total > 0.0 ? (1.0 / total) * moment : positions.front();
}

double signed_volume(std::span<const Point> vertices, std::span<const Triangle> faces, Point origin,
                     ThreadTeam& team) {
  const auto six_volumes = [&](std::int64_t face) {
    const auto& [a, b, c] = faces[face].corners;
    return dot(vertices[a] - origin, cross(vertices[b] - origin, vertices[c] - origin));
  };
  return sum_over(std::ssize(faces), six_volumes, team) / 6.0;
}

}  // namespace superfacets
