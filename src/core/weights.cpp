#include "weights.hpp"

#include <algorithm>
#include <limits>
#include <numbers>

#include "buffer.hpp"
#include "parallel.hpp"

namespace superfacets {
namespace {

// The cross product of two edges of length L carries rounding errors up to about 4 eps L^2; below
// twice that its direction means nothing, and the face counts as one without a normal.
constexpr double kNormalNoise = 8.0 * std::numeric_limits<double>::epsilon();

// Areas that differ by less than this part count as equal: rounding must not tell mirror images
// apart.
constexpr double kAreaNoise = 1e-9;

// Partial sums run over this many terms, whatever the number of threads.
constexpr std::int64_t kSumChunk = 4096;

// Between faces with more arcs than this, as around a crowded edge, looking for the arc back would
// cost more than the weight does.
constexpr std::int64_t kFewArcs = 8;

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

Buffer<Point> unit_normals(const ArcGeometry& arcs, int n_threads) {
  Buffer<Point> normals(arcs.faces.size());  // zero where a face has none
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

// The only arc from one face to another; none where there are several, or too many to look.
constexpr std::int64_t kNoArc = -1;

std::int64_t only_arc(const ArcGeometry& arcs, Face from, Face to) {
  const std::int64_t begin = arcs.offsets[from];
  const std::int64_t end = arcs.offsets[from + 1];
  if (end - begin > kFewArcs) return kNoArc;
  std::int64_t found = kNoArc;
  for (std::int64_t arc = begin; arc < end; ++arc) {
    if (arcs.neighbors[arc] != to) continue;
    if (found != kNoArc) return kNoArc;
    found = arc;
  }
  return found;
}

// The arc that leads back, where it and this one are the only ones between the two faces.
std::int64_t arc_back(const ArcGeometry& arcs, Face from, std::int64_t arc) {
  const Face to = arcs.neighbors[arc];
  return only_arc(arcs, from, to) == arc ? only_arc(arcs, to, from) : kNoArc;
}

// The weights of the arcs that leave a face, and of those back to it. Of a pair of arcs both are
// written when the lower face is visited, by the same rule seen from either end.
void weigh_arcs_of(Face face, const ArcGeometry& arcs, std::span<const Point> normals,
                   const WeightOptions& options, std::span<double> weights) {
  for (std::int64_t arc = arcs.offsets[face]; arc < arcs.offsets[face + 1]; ++arc) {
    const std::int64_t back = arc_back(arcs, face, arc);
    if (back != kNoArc && arcs.neighbors[arc] < face) continue;
    const double weight = arc_weight(arcs, normals, face, arc, options);
    weights[arc] = weight;
    if (back != kNoArc) weights[back] = weight;
  }
}

// Sums term(begin, end) over chunks of 0..n-1, in their order.
template <typename Term>
double sum_of_chunks(std::int64_t n, int n_threads, const Term& term) {
  const std::int64_t n_chunks = (n + kSumChunk - 1) / kSumChunk;
  std::vector<double> partial(n_chunks, 0.0);
  const auto sum_chunks = [&](std::int64_t first, std::int64_t last) {
    for (std::int64_t chunk = first; chunk < last; ++chunk) {
      partial[chunk] = term(chunk * kSumChunk, std::min(n, (chunk + 1) * kSumChunk));
    }
  };
  parallel_ranges(n_chunks, n_threads, sum_chunks, kMinPerThread / kSumChunk);
  double total = 0.0;
  for (const double sum : partial) total += sum;
  return total;
}

double sum_of(std::span<const double> weights, int n_threads) {
  return sum_of_chunks(static_cast<std::int64_t>(weights.size()), n_threads,
                       [&](std::int64_t begin, std::int64_t end) {
                         double sum = 0.0;
                         for (std::int64_t arc = begin; arc < end; ++arc) sum += weights[arc];
                         return sum;
                       });
}

// Rounds 0 <= x < 2^52 to a whole number, halves to even, as std::nearbyint does; but that is a
// call for each number where the oldest processors of a kind are compiled for.
double round_to_whole(double x) {
  constexpr double kNoFraction = 0x1p52;  // numbers from here on have no bits for a fraction
  return (x + kNoFraction) - kNoFraction;
}

}  // namespace

void superfacet_weights(const ArcGeometry& arcs, const WeightOptions& options, int n_threads,
                        std::span<double> weights) {
  const Buffer<Point> normals = unit_normals(arcs, n_threads);
  const auto n_faces = static_cast<std::int64_t>(arcs.faces.size());
  parallel_ranges(n_faces, n_threads, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) {
      weigh_arcs_of(static_cast<Face>(face), arcs, normals.span(), options, weights);
    }
  });
}

std::int64_t count_degenerate(std::span<const Point> vertices, std::span<const Triangle> faces) {
  return std::count_if(faces.begin(), faces.end(), [&](const Triangle& face) {
    return squared_norm(unit_normal(vertices, face)) == 0.0;
  });
}

double signed_volume(std::span<const Point> vertices, std::span<const Triangle> faces, Point origin,
                     int n_threads) {
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
  return sum_of_chunks(n_faces, n_threads, six_volumes) / 6.0;
}

double quantize_weights(std::span<const double> weights, int n_threads, std::span<float> lengths) {
  // A power of two: rounding then only cuts the last bits of a weight, and a sum that differs in
  // its last bits, because arcs come in another order, gives the same unit.
  const double total = sum_of(weights, n_threads);
  const double unit = total > 0.0 ? std::ldexp(1.0, std::ilogb(total) + 1 - kTotalBits) : 1.0;
  const auto n_arcs = static_cast<std::int64_t>(weights.size());
  parallel_ranges(n_arcs, n_threads, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t arc = begin; arc < end; ++arc) {
      // A float keeps 24 bits of a whole number of any size. Never 0: paths get strictly longer.
      lengths[arc] = static_cast<float>(std::max(1.0, round_to_whole(weights[arc] / unit)));
    }
  });
  return unit;
}

}  // namespace superfacets
