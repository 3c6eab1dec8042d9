#include "cells/weights.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numbers>

#include "base/arctangent.hpp"
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

// Angles are taken of so many arcs at once: those of a list on most meshes.
constexpr std::size_t kArcsPerBlock = 128;

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

// What of eq. 1-3 is known of an arc before the angle theta is. Each number is symmetric in the two
// faces, bit for bit.
struct ArcTerms {
  double geodesic;  // eq. 1
  double price;     // alpha eta |e|, of eq. 2
  double sine;      // |n_i x n_j|, 0 where a normal is missing
  double cosine;    // n_i . n_j
};

// alpha eta |e|
double angular_price(Point normal_from, Point normal_to, Point step, double edge_length,
                     const WeightOptions& options) {
  // Positive if each centroid lies above the plane of the other face, summed over both.
  const double rise = dot(normal_from - normal_to, step);
  const bool concave = options.inside_out ? rise < 0.0 : rise > 0.0;
  const double etas[] = {options.eta_convex, 1.0};
  const double eta = etas[static_cast<int>(concave)];  // no branch: on most meshes it is a toss-up
  return options.alpha * eta * edge_length;
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

ArcTerms arc_terms(const ArcGeometry& arcs, std::span<const Point> normals, Face from,
                   std::int64_t arc, const WeightOptions& options) {
  const Face to = arcs.neighbors[arc];
  const Edge edge = crossed_edge(arcs, from, arc);
  Point normal_from = normals[from];
  Point normal_to = normals[to];
  if (!arcs.same_turn.empty() && arcs.same_turn[arc] != 0) {
    Point& turned = turns_second(from, to, arcs.areas) ? normal_to : normal_from;
    turned = -1.0 * turned;
  }
  const double length =
      options.crease_length > 0.0 ? options.crease_length : norm(edge.end - edge.start);
  const Point step = arcs.centroids[to] - arcs.centroids[from];
  return {geodesic_term(arcs, from, to, edge),
          angular_price(normal_from, normal_to, step, length, options),
          norm(cross(normal_from, normal_to)), dot(normal_from, normal_to)};
}

// The weight of an arc whose normals are at the angle theta.
double arc_weight(double geodesic, double price, double theta, const WeightOptions& options) {
  const double angular = price * theta / std::numbers::pi;  // eq. 2
  return (geodesic + angular) / options.diagonal;           // eq. 3
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

// Weighs some arcs, kArcsPerBlock at most, and the arcs back where there is one each way. The
// angles are taken all at once.
void weigh_block(const ArcGeometry& arcs, std::span<const Point> normals,
                 const WeightOptions& options, std::span<const RisingArc> rising,
                 std::span<double> weights) {
  using Block = std::array<double, kArcsPerBlock>;
  Block geodesics;
  Block prices;
  Block sines;
  Block cosines;
  Block angles;
  const std::size_t n = rising.size();
  for (std::size_t i = 0; i < n; ++i) {
    const ArcTerms terms = arc_terms(arcs, normals, rising[i].from, rising[i].arc, options);
    geodesics[i] = terms.geodesic;
    prices[i] = terms.price;
    sines[i] = terms.sine;
    cosines[i] = terms.cosine;
  }
  arctangents({sines.data(), n}, {cosines.data(), n}, {angles.data(), n});
  for (std::size_t i = 0; i < n; ++i) {
    const RisingArc& step = rising[i];
    const double weight = arc_weight(geodesics[i], prices[i], angles[i], options);
    weights[step.arc] = weight;
    const std::int64_t back = only_arc(arcs, step.to, step.from);
    const bool is_pair = back >= 0 && only_arc(arcs, step.from, step.to) == step.arc;
    if (is_pair) weights[back] = weight;
  }
}

// Weighs the arcs that lead from a range of faces to higher ones, and the arcs back where there is
// one each way.
void weigh_rising_arcs(const ArcGeometry& arcs, std::span<const Point> normals,
                       const WeightOptions& options, std::int64_t begin, std::int64_t end,
                       std::span<double> weights) {
  std::vector<RisingArc> listed;
  for (std::int64_t first = begin; first < end; first += kFacesPerList) {
    list_rising_arcs(arcs, normals, first, std::min(end, first + kFacesPerList), listed);
    for (std::span<const RisingArc> rest = listed; !rest.empty();) {
      const auto block = rest.first(std::min(rest.size(), kArcsPerBlock));
      weigh_block(arcs, normals, options, block, weights);
      rest = rest.subspan(block.size());
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
      const ArcTerms terms = arc_terms(arcs, normals, static_cast<Face>(face), arc, options);
      // atan2 keeps full precision near 0 and pi, where acos of the cosine loses half the digits.
      const double theta = arctangent(terms.sine, terms.cosine);
      weights[arc] = arc_weight(terms.geodesic, terms.price, theta, options);
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
