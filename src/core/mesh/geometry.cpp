#include "mesh/geometry.hpp"

#include <limits>
#include <memory>

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
SUPERFACETS_ALWAYS_INLINE double longest_squared(const std::array<Point, 3>& corners) {
  const auto& [a, b, c] = corners;
  return std::max(std::max(squared_norm(b - a), squared_norm(c - b)), squared_norm(a - c));
}
inline double longest_squared(std::span<const Point> vertices, const Triangle& face) {
  return longest_squared(corners_of(vertices, face));
}

struct Shapes {
  Points centroids;
  Numbers areas;
  Numbers longest;
};

// Corners of the faces of a block.
struct Corners {
  std::array<Points, 3> at;

  // Gathers the corners of some faces.
  void set(std::span<const Point> vertices, std::span<const Triangle> faces) {
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (int corner = 0; corner < 3; ++corner) {
        at[corner].set(i, vertices[faces[i].corners[corner]]);
      }
    }
  }
  SUPERFACETS_ALWAYS_INLINE std::array<Point, 3> get(std::size_t i) const {
    return {at[0].get(i), at[1].get(i), at[2].get(i)};
  }
};

// Measures the first n faces of a block, with the same formulas as centroid() and area().
struct Measure {
  SUPERFACETS_ALWAYS_INLINE void operator()(const Corners& corners, Shapes* shapes,
                                            std::size_t n) const {
    for (std::size_t i = 0; i < n; ++i) {
      const std::array<Point, 3> at = corners.get(i);
      const auto& [a, b, c] = at;
      const Point sum = a + b + c;
      shapes->centroids.set(i, {sum.x / 3.0, sum.y / 3.0, sum.z / 3.0});
      shapes->areas[i] = 0.5 * norm(cross(b - a, c - a));
      shapes->longest[i] = longest_squared(at);
    }
  }
};

// Computes the normals of the first n faces of a block, with the same formula as unit_normal().
struct Orient {
  SUPERFACETS_ALWAYS_INLINE void operator()(const Corners& corners, Points* normals,
                                            std::size_t n) const {
    for (std::size_t i = 0; i < n; ++i) {
      const std::array<Point, 3> at = corners.get(i);
      const auto& [a, b, c] = at;
      const Point direction = cross(b - a, c - a);
      const double length = norm(direction);
      const bool has_normal = length > kNormalNoise * longest_squared(at);
      const double divisor = has_normal ? length : 1.0;
      normals->set(
          i, {has_normal ? direction.x / divisor : 0.0, has_normal ? direction.y / divisor : 0.0,
              has_normal ? direction.z / divisor : 0.0});
    }
  }
};

// Measures faces begin .. end-1. Returns the squared length of their longest side.
double measure_range(std::span<const Point> vertices, std::span<const Triangle> faces,
                     std::int64_t begin, std::int64_t end, FaceShapes& all) {
  const InstructionSet with = best_instruction_set();
  Corners corners;
  Shapes shapes;
  double longest = 0.0;
  for (std::int64_t first = begin; first < end; first += kFacesAtOnce) {
    const std::size_t n = std::min<std::size_t>(kFacesAtOnce, end - first);
    corners.set(vertices, faces.subspan(first, n));
    run_version(with, Measure{}, corners, &shapes, n);
    for (std::size_t i = 0; i < n; ++i) all.centroids[first + i] = shapes.centroids.get(i);
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
  FaceShapes shapes{Buffer<Point>(n), Buffer<double>(n),
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

void write_unit_normals(std::span<const Point> vertices, std::span<const Triangle> faces,
                        std::span<Point> normals) {
  const InstructionSet with = best_instruction_set();
  const auto block = std::make_unique<Points>();
  Corners corners;
  for (std::size_t first = 0; first < faces.size(); first += kFacesAtOnce) {
    const std::size_t n = std::min(kFacesAtOnce, faces.size() - first);
    corners.set(vertices, faces.subspan(first, n));
    run_version(with, Orient{}, corners, block.get(), n);
    for (std::size_t i = 0; i < n; ++i) normals[first + i] = block->get(i);
  }
}

Buffer<Point> unit_normals(std::span<const Point> vertices, std::span<const Triangle> faces,
                           ThreadTeam& team) {
  Buffer<Point> normals(faces.size());
  team.for_each_block(std::ssize(faces), [&](std::int64_t begin, std::int64_t end) {
    const std::size_t n = end - begin;
    write_unit_normals(vertices, faces.subspan(begin, n), normals.span().subspan(begin, n));
  });
  return normals;
}

Buffer<float> single_normals(std::span<const Point> vertices, std::span<const Triangle> faces,
                             ThreadTeam& team) {
  Buffer<float> normals(3 * faces.size());
  team.for_each_block(std::ssize(faces), [&](std::int64_t begin, std::int64_t end) {
    std::vector<Point> exact(end - begin);
    write_unit_normals(vertices, faces.subspan(begin, exact.size()), exact);
    for (std::size_t i = 0; i < exact.size(); ++i) {
      const std::span row = normals.span().subspan(3 * (begin + i), 3);
      row[0] = static_cast<float>(exact[i].x);
      row[1] = static_cast<float>(exact[i].y);
      row[2] = static_cast<float>(exact[i].z);
    }
  });
  return normals;
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
