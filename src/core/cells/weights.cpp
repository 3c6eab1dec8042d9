#include "cells/weights.hpp"

#include <algorithm>
#include <limits>
#include <numbers>

#include "base/buffer.hpp"
#include "base/prefetch.hpp"
#include "base/threads.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// Areas that differ by less than this part count as equal: rounding must not tell mirror images
// apart.
constexpr double kAreaNoise = 1e-9;

// Between faces with more arcs than this, as around a crowded edge, looking for the arc back would
// cost more than the weight does.
constexpr std::int64_t kFewArcs = 8;

// What is needed of so many faces and their neighbors fits into the nearest cache.
constexpr std::int64_t kFacesPerList = 64;

constexpr double kNotYetWeighed = -1.0;

Buffer<Point> unit_normals(const ArcGeometry& arcs, ThreadTeam& team) {
  Buffer<Point> normals(arcs.faces.size());  // zero where a face has none
  const auto n_faces = static_cast<std::int64_t>(normals.size());
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
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
  const double etas[] = {options.eta_convex, 1.0};
  const double eta = etas[static_cast<int>(concave)];  // no branch: on most meshes it is a toss-up
  return options.alpha * eta * edge_length * theta / std::numbers::pi;
}

struct Edge {
  Point start;
  Point end;
};

// The edge that an arc crosses.
Edge crossed_edge(const ArcGeometry& arcs, Face from, std::int64_t arc) {
  const int side = arcs.sides[arc];
  const Triangle& face = arcs.faces[from];
  return {arcs.vertices[face.corners[side]], arcs.vertices[face.corners[(side + 1) % 3]]};
}

// |c_i - m| + |m - c_j| (eq. 1).
double geodesic_term(const ArcGeometry& arcs, Face from, Face to, const Edge& edge) {
  const Point middle = 0.5 * (edge.start + edge.end);
  return norm(arcs.centroids[from] - middle) + norm(middle - arcs.centroids[to]);
}

double arc_weight(const ArcGeometry& arcs, std::span<const Point> normals, Face from,
                  std::int64_t arc, const WeightOptions& options) {
  const Face to = arcs.neighbors[arc];
  const Edge edge = crossed_edge(arcs, from, arc);
  const double geodesic = geodesic_term(arcs, from, to, edge);  // eq. 1
  Point normal_from = normals[from];
  Point normal_to = normals[to];
  if (!arcs.same_turn.empty() && arcs.same_turn[arc] != 0) {
    Point& turned = turns_second(from, to, arcs.areas) ? normal_to : normal_from;
    turned = -1.0 * turned;
  }
  const double length =
      options.crease_length > 0.0 ? options.crease_length : norm(edge.end - edge.start);
  const double angular =
      angular_term(normal_from, normal_to, arcs.centroids[to] - arcs.centroids[from], length,
                   options);                       // eq. 2
  return (geodesic + angular) / options.diagonal;  // eq. 3
}

// The only arc from one face to another, or -1 where there are several, or too many to look.
std::int64_t only_arc(const ArcGeometry& arcs, Face from, Face to) {
  const std::int64_t begin = arcs.offsets[from];
  const std::int64_t end = arcs.offsets[from + 1];
  if (end - begin > kFewArcs) return -1;
  std::int64_t n_found = 0;
  std::int64_t sum = 0;
  for (std::int64_t arc = begin; arc < end; ++arc) {
    // No branch: where in the list an arc stands is not to be foretold.
    const std::int64_t is_found = arcs.neighbors[arc] == to;
    n_found += is_found;
    sum += is_found * arc;
  }
  return n_found == 1 ? sum : -1;
}

struct RisingArc {
  Face from;
  Face to;  // > from
  std::int64_t arc;
};

// Lists the arcs that lead from a range of faces to higher ones, and asks for what is needed there:
// neighbors are anywhere in memory, and the way to it would take longer than the arithmetic.
void list_rising_arcs(const ArcGeometry& arcs, std::span<const Point> normals, std::int64_t begin,
                      std::int64_t end, std::vector<RisingArc>& rising) {
  rising.resize(arcs.offsets[end] - arcs.offsets[begin]);
  std::size_t n_rising = 0;
  for (std::int64_t face = begin; face < end; ++face) {
    for (const Vertex corner : arcs.faces[face].corners) prefetch(&arcs.vertices[corner]);
    for (std::int64_t arc = arcs.offsets[face]; arc < arcs.offsets[face + 1]; ++arc) {
      rising[n_rising] = {static_cast<Face>(face), arcs.neighbors[arc], arc};
      n_rising += static_cast<std::size_t>(face < arcs.neighbors[arc]);  // no branch, as above
    }
  }
  rising.resize(n_rising);
  for (const RisingArc& step : rising) {
    prefetch(&arcs.offsets[step.to]);
    prefetch(&arcs.centroids[step.to]);
    prefetch(&normals[step.to]);
  }
  for (const RisingArc& step : rising) prefetch(&arcs.neighbors[arcs.offsets[step.to]]);
}

// Weighs the arcs that lead from a range of faces to higher ones, and the arcs back where there is
// one each way.
void weigh_rising_arcs(const ArcGeometry& arcs, std::span<const Point> normals,
                       const WeightOptions& options, std::int64_t begin, std::int64_t end,
                       std::span<double> weights) {
  std::vector<RisingArc> rising;
  for (std::int64_t first = begin; first < end; first += kFacesPerList) {
    list_rising_arcs(arcs, normals, first, std::min(end, first + kFacesPerList), rising);
    for (const RisingArc& step : rising) {
      const double weight = arc_weight(arcs, normals, step.from, step.arc, options);
      weights[step.arc] = weight;
      const std::int64_t back = only_arc(arcs, step.to, step.from);
      const bool is_pair = back >= 0 && only_arc(arcs, step.from, step.to) == step.arc;
      if (is_pair) weights[back] = weight;
    }
  }
}

// Weighs what is left: arcs to lower faces that are not the only ones, or have no arc back.
void weigh_other_arcs(const ArcGeometry& arcs, std::span<const Point> normals,
                      const WeightOptions& options, std::int64_t begin, std::int64_t end,
                      std::span<double> weights) {
  for (std::int64_t face = begin; face < end; ++face) {
    for (std::int64_t arc = arcs.offsets[face]; arc < arcs.offsets[face + 1]; ++arc) {
      if (weights[arc] != kNotYetWeighed) continue;
      weights[arc] = arc_weight(arcs, normals, static_cast<Face>(face), arc, options);
    }
  }
}

// Rounds 0 <= x < 2^52 to a whole number, halves to even, as std::nearbyint does; but that is a
// call for each number where the oldest processors of a kind are compiled for.
double round_to_whole(double x) {
  constexpr double kNoFraction = 0x1p52;  // numbers from here on have no bits for a fraction
  return (x + kNoFraction) - kNoFraction;
}

}  // namespace

void superfacet_weights(const ArcGeometry& arcs, const WeightOptions& options, ThreadTeam& team,
                        std::span<double> weights) {
  const Buffer<Point> normals = unit_normals(arcs, team);
  const auto n_faces = static_cast<std::int64_t>(arcs.faces.size());
  team.fill(weights, kNotYetWeighed);
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
    weigh_rising_arcs(arcs, normals.span(), options, begin, end, weights);
  });
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
    weigh_other_arcs(arcs, normals.span(), options, begin, end, weights);
  });
}

void stk02_weights(const ArcGeometry& arcs, double alpha, ThreadTeam& team,
                   std::span<double> weights) {
  const Buffer<Point> normals = unit_normals(arcs, team);
  const auto has_normal = [&](Face face) { return squared_norm(normals[face]) > 0.0; };
  const auto n_faces = static_cast<std::int64_t>(arcs.faces.size());
  team.for_each_block(n_faces, [&](std::int64_t begin, std::int64_t end) {
    for (auto face = static_cast<Face>(begin); face < end; ++face) {
      for (std::int64_t arc = arcs.offsets[face]; arc < arcs.offsets[face + 1]; ++arc) {
        const Face to = arcs.neighbors[arc];
        const double geodesic = geodesic_term(arcs, face, to, crossed_edge(arcs, face, arc));
        const double cosine = dot(normals[face], normals[to]);
        const bool is_bent = has_normal(face) && has_normal(to);
        // Rounding can take the squared cosine of equal normals above 1.
        const double angular = is_bent ? std::max(0.0, 1.0 - cosine * cosine) : 0.0;
        weights[arc] = (1.0 - alpha) * geodesic + alpha * angular;  // eq. 6
      }
    }
  });
}

double quantize_weights(std::span<const double> weights, ThreadTeam& team,
                        std::span<float> lengths) {
  // A power of two: rounding then only cuts the last bits of a weight, and a sum that differs in
  // its last bits, because arcs come in another order, gives the same unit.
  const double total = sum_of(weights, team);
  const double unit = total > 0.0 ? std::ldexp(1.0, std::ilogb(total) + 1 - kTotalBits) : 1.0;
  const auto n_arcs = static_cast<std::int64_t>(weights.size());
  team.for_each_block(n_arcs, [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t arc = begin; arc < end; ++arc) {
      // A float keeps 24 bits of a whole number of any size. Never 0: paths get strictly longer.
      lengths[arc] = static_cast<float>(std::max(1.0, round_to_whole(weights[arc] / unit)));
    }
  });
  return unit;
}

}  // namespace superfacets
