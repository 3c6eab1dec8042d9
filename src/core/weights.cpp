#include "weights.hpp"

#include <algorithm>
#include <limits>
#include <numbers>

#include "parallel.hpp"

namespace superfacets {
namespace {

// The cross product of two edges of length L carries rounding errors up to about 4 eps L^2; below
// twice that its direction means nothing, and the face counts as one without a normal.
constexpr double kNormalNoise = 8.0 * std::numeric_limits<double>::epsilon();

// Areas that differ by less than this part count as equal: rounding must not tell mirror images
// apart.
constexpr double kAreaNoise = 1e-9;

// Partial sums run over this many weights, whatever the number of threads.
constexpr std::int64_t kSumChunk = 4096;

// The unit normal, or a zero vector where the face has none.
Point unit_normal(std::span<const Point> vertices, const Triangle& face) {
  const Point a = vertices[face.corners[0]];
  const Point b = vertices[face.corners[1]];
  const Point c = vertices[face.corners[2]];
  const Point direction = cross(b - a, c - a);
  const double length = norm(direction);
  const double longest = std::max({squared_norm(b - a), squared_norm(c - b), squared_norm(a - c)});
  if (!(length > kNormalNoise * longest)) return {0.0, 0.0, 0.0};
  return {direction.x / length, direction.y / length, direction.z / length};
}

std::vector<Point> unit_normals(const ArcGeometry& arcs, int n_threads) {
  std::vector<Point> normals(arcs.faces.size());  // zero where a face has none
  const auto n_faces = static_cast<std::int64_t>(normals.size());
  parallel_ranges(n_faces, n_threads, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) {
      normals[face] = unit_normal(arcs.vertices, arcs.faces[face]);
    }
  });
  return normals;
}

// Where two neighbors run through their edge alike, one normal is turned, and both arcs of the pair
// turn the same one: that of the smaller face, or of the higher index where areas are equal.
bool turns_second(Face first, Face second, std::span<const double> areas) {
  const double difference = areas[first] - areas[second];
  if (std::abs(difference) > kAreaNoise * std::max(areas[first], areas[second])) {
    return difference > 0.0;
  }
  return first < second;
}

// alpha eta |e| theta / pi. Each operand is symmetric in the two faces, bit for bit.
double angular_term(Point normal_from, Point normal_to, Point step, double edge_length,
                    const WeightOptions& options) {
  // atan2 keeps full precision near 0 and pi, where acos of the dot product loses half the digits.
  // Where a normal is missing both arguments are 0; adding 0.0 keeps the second from being -0.0,
  // which would make theta pi instead of 0.
  const double theta =
      std::atan2(norm(cross(normal_from, normal_to)), dot(normal_from, normal_to) + 0.0);
  // Positive if each centroid lies above the plane of the other face, summed over both.
  const double rise = dot(normal_from - normal_to, step);
  const bool concave = options.inside_out ? rise < 0.0 : rise > 0.0;
  const double eta = concave ? 1.0 : options.eta_convex;
  return options.alpha * eta * edge_length * theta / std::numbers::pi;
}

double arc_weight(const ArcGeometry& arcs, std::span<const Point> normals, Face from,
                  std::int64_t arc, const WeightOptions& options) {
  const Face to = arcs.neighbors[arc];
  const int side = arcs.sides[arc];
  const Triangle& face = arcs.faces[from];
  const Point start = arcs.vertices[face.corners[side]];
  const Point end = arcs.vertices[face.corners[(side + 1) % 3]];
  const Point middle = 0.5 * (start + end);
  const Point c_from = arcs.centroids[from];
  const Point c_to = arcs.centroids[to];
  const double geodesic = norm(c_from - middle) + norm(middle - c_to);  // eq. 1

  Point normal_from = normals[from];
  Point normal_to = normals[to];
  if (arcs.same_turn[arc]) {
    Point& turned = turns_second(from, to, arcs.areas) ? normal_to : normal_from;
    turned = -1.0 * turned;
  }
  const double angular =
      angular_term(normal_from, normal_to, c_to - c_from, norm(end - start), options);  // eq. 2
  return (geodesic + angular) / options.diagonal;                                       // eq. 3
}

double sum_of(std::span<const double> weights) {
  double total = 0.0;
  const auto n = static_cast<std::int64_t>(weights.size());
  for (std::int64_t begin = 0; begin < n; begin += kSumChunk) {
    double partial = 0.0;
    for (const double weight : weights.subspan(begin, std::min(kSumChunk, n - begin))) {
      partial += weight;
    }
    total += partial;
  }
  return total;
}

}  // namespace

void superfacet_weights(const ArcGeometry& arcs, const WeightOptions& options, int n_threads,
                        std::span<double> weights) {
  const std::vector<Point> normals = unit_normals(arcs, n_threads);
  const auto n_faces = static_cast<std::int64_t>(arcs.faces.size());
  parallel_ranges(n_faces, n_threads, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) {
      for (std::int64_t arc = arcs.offsets[face]; arc < arcs.offsets[face + 1]; ++arc) {
        weights[arc] = arc_weight(arcs, normals, static_cast<Face>(face), arc, options);
      }
    }
  });
}

std::int64_t count_degenerate(std::span<const Point> vertices, std::span<const Triangle> faces) {
  return std::count_if(faces.begin(), faces.end(), [&](const Triangle& face) {
    return squared_norm(unit_normal(vertices, face)) == 0.0;
  });
}

double signed_volume(std::span<const Point> vertices, std::span<const Triangle> faces,
                     Point origin) {
  double six_volumes = 0.0;
  for (const Triangle& face : faces) {
    const Point a = vertices[face.corners[0]] - origin;
    const Point b = vertices[face.corners[1]] - origin;
    const Point c = vertices[face.corners[2]] - origin;
    six_volumes += dot(a, cross(b, c));
  }
  return six_volumes / 6.0;
}

double quantize_weights(std::span<const double> weights, std::span<float> lengths) {
  // A power of two: rounding then only cuts the last bits of a weight, and a sum that differs in
  // its last bits, because arcs come in another order, gives the same unit.
  const double total = sum_of(weights);
  const double unit = total > 0.0 ? std::ldexp(1.0, std::ilogb(total) + 1 - kTotalBits) : 1.0;
  for (std::size_t arc = 0; arc < weights.size(); ++arc) {
    // A float keeps 24 bits of a whole number of any size. Never 0: paths get strictly longer.
    lengths[arc] = static_cast<float>(std::max(1.0, std::nearbyint(weights[arc] / unit)));
  }
  return unit;
}

}  // namespace superfacets
