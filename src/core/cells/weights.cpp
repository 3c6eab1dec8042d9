#include "cells/weights.hpp"

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include "base/arctangent.hpp"
#include "base/assert.hpp"
#include "base/buffer.hpp"
#include "base/prefetch.hpp"
#include "base/threads.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// For faces with more arcs than this, as around an edge of many faces, searching the reverse arc
// would cost more than computing the weight twice.
constexpr std::int64_t kFewArcs = 8;

// Faces per block: their data and that of their neighbors fit into the nearest cache.
constexpr std::int64_t kFacesPerList = 64;

// Arcs whose angles are computed at once: all of a list on most meshes.
constexpr std::size_t kArcsPerBlock = 128;

constexpr double kNotYetWeighed = -1.0;

Buffer<Point> unit_normals(const TriangleSurface& surface, ThreadTeam& team) {
  Buffer<Point> normals(surface.n_cells());  // zero where a face has none
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    for (std::int64_t face = begin; face < end; ++face) {
      normals[face] = unit_normal(surface.vertices(), surface.faces()[face]);
    }
  });
  return normals;
}

// The data of a mesh for eq. 1-3.
struct Geometry {
  const TriangleSurface& surface;
  const FaceMeasures& faces;
  std::span<const Point> normals;

  const Arcs& arcs() const { return surface.arcs(); }
};

// The terms of eq. 1-3 that do not depend on the angle theta. Each is symmetric in the two faces,
// bit for bit.
struct ArcTerms {
  double geodesic;  // eq. 1
  double price;     // alpha eta |e|, of eq. 2
  Fold fold;
};

ArcTerms arc_terms(const Geometry& geometry, Face from, std::int64_t arc,
                   const WeightOptions& options) {
  const auto& [centroids, areas] = geometry.faces;
  const Face to = geometry.arcs().targets[arc];
  const Edge edge = geometry.surface.edge(from, arc);
  Point normal_from = geometry.normals[from];
  Point normal_to = geometry.normals[to];
  if (geometry.surface.same_turn(arc)) {
    Point& turned = turns_second(from, to, areas[from], areas[to]) ? normal_to : normal_from;
    turned = -1.0 * turned;
  }
  const Fold fold = fold_of(normal_from, normal_to, centroids[to] - centroids[from]);
  // No branch, because the sign is hard to predict.
  const double etas[] = {options.eta_convex, 1.0};
  const double eta = etas[static_cast<int>(fold.is_concave(geometry.surface.is_inside_out()))];
  const double length = options.crease_length > 0.0 ? options.crease_length : edge.length();
  return {way_over(edge, centroids[from], centroids[to]), options.alpha * eta * length, fold};
}

// The weight of an arc whose normals are at the angle theta.
double arc_weight(double geodesic, double price, double theta, const WeightOptions& options) {
  const double angular = price * theta / std::numbers::pi;  // eq. 2
  return (geodesic + angular) / options.diagonal;           // eq. 3
}

// The only arc from one face to another; -1 if there are several, or too many arcs to search.
std::int64_t only_arc(const Arcs& arcs, Face from, Face to) {
  const auto neighbors = arcs.neighbors(from);
  if (std::cmp_greater(neighbors.size(), kFewArcs)) return -1;
  std::int64_t n_found = 0;
  std::int64_t sum = 0;
  for (const auto [arc, neighbor] : arcs.steps(from)) {
    // No branch, because the position in the list is hard to predict.
    const std::int64_t is_found = neighbor == to;
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

// Lists the arcs from a range of faces to higher ones, and prefetches the data of those: neighbors
// are anywhere in memory, and waiting for it would take longer than the arithmetic.
void list_rising_arcs(const Geometry& geometry, std::int64_t begin, std::int64_t end,
                      std::vector<RisingArc>& rising) {
  const Arcs& arcs = geometry.arcs();
  const auto vertices = geometry.surface.vertices();
  rising.resize(arcs.offsets[end] - arcs.offsets[begin]);
  std::size_t n_rising = 0;
  for (std::int64_t face = begin; face < end; ++face) {
    for (const Vertex corner : geometry.surface.faces()[face].corners) prefetch(&vertices[corner]);
    for (const auto [arc, neighbor] : arcs.steps(static_cast<Face>(face))) {
      rising[n_rising] = {static_cast<Face>(face), neighbor, arc};
      n_rising += static_cast<std::size_t>(face < neighbor);  // no branch, as above
    }
  }
  rising.resize(n_rising);
  for (const RisingArc& step : rising) {
    prefetch(&arcs.offsets[step.to]);
    prefetch(&geometry.faces.centroids[step.to]);
    prefetch(&geometry.normals[step.to]);
  }
  // Where a list is empty, maybe behind the last arc: asked for by address, not by index.
  for (const RisingArc& step : rising) prefetch(arcs.targets.data() + arcs.offsets[step.to]);
}

// Computes the weights of up to kArcsPerBlock arcs, and of their reverse arcs if there is one arc
// each way. The angles are computed in one call.
void weigh_block(const Geometry& geometry, const WeightOptions& options,
                 std::span<const RisingArc> rising, std::span<double> weights) {
  using Block = std::array<double, kArcsPerBlock>;
  Block geodesics;
  Block prices;
  Block sines;
  Block cosines;
  Block angles;
  const std::size_t n = rising.size();
  for (std::size_t i = 0; i < n; ++i) {
    const ArcTerms terms = arc_terms(geometry, rising[i].from, rising[i].arc, options);
    geodesics[i] = terms.geodesic;
    prices[i] = terms.price;
    sines[i] = terms.fold.sine;
    cosines[i] = terms.fold.cosine;
  }
  arctangents({sines.data(), n}, {cosines.data(), n}, {angles.data(), n});
  for (std::size_t i = 0; i < n; ++i) {
    const RisingArc& step = rising[i];
    const double weight = arc_weight(geodesics[i], prices[i], angles[i], options);
    weights[step.arc] = weight;
    const std::int64_t back = only_arc(geometry.arcs(), step.to, step.from);
    const bool is_pair = back >= 0 && only_arc(geometry.arcs(), step.from, step.to) == step.arc;
    if (is_pair) weights[back] = weight;
  }
}

// Computes the weights of the arcs from a range of faces to higher ones, and of their reverse arcs
// if there is one arc each way.
void weigh_rising_arcs(const Geometry& geometry, const WeightOptions& options, std::int64_t begin,
                       std::int64_t end, std::span<double> weights) {
  std::vector<RisingArc> listed;
  for (std::int64_t first = begin; first < end; first += kFacesPerList) {
    list_rising_arcs(geometry, first, std::min(end, first + kFacesPerList), listed);
    for (std::span<const RisingArc> rest = listed; !rest.empty();) {
      const auto block = rest.first(std::min(rest.size(), kArcsPerBlock));
      weigh_block(geometry, options, block, weights);
      rest = rest.subspan(block.size());
    }
  }
}

// Computes the remaining weights: arcs to lower faces that are not unique, or have no reverse arc.
void weigh_other_arcs(const Geometry& geometry, const WeightOptions& options, std::int64_t begin,
                      std::int64_t end, std::span<double> weights) {
  for (auto face = static_cast<Face>(begin); face < end; ++face) {
    for (const auto [arc, neighbor] : geometry.arcs().steps(face)) {
      if (weights[arc] != kNotYetWeighed) continue;
      const ArcTerms terms = arc_terms(geometry, face, arc, options);
      // atan2 keeps full precision near 0 and pi, where acos of the cosine loses half the digits.
      const double theta = arctangent(terms.fold.sine, terms.fold.cosine);
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

void superfacet_weights(const TriangleSurface& surface, const FaceMeasures& faces,
                        const WeightOptions& options, ThreadTeam& team, std::span<double> weights) {
  SUPERFACETS_ASSERT(std::cmp_equal(faces.centroids.size(), surface.n_cells()) &&
                     faces.areas.size() == faces.centroids.size());
  SUPERFACETS_ASSERT(std::ssize(weights) == surface.arcs().n_arcs() && options.diagonal > 0.0);
  const Buffer<Point> normals = unit_normals(surface, team);
  const Geometry geometry{surface, faces, normals.span()};
  team.fill(weights, kNotYetWeighed);
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    weigh_rising_arcs(geometry, options, begin, end, weights);
  });
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    weigh_other_arcs(geometry, options, begin, end, weights);
  });
}

void stk02_weights(const TriangleSurface& surface, std::span<const Point> centroids, double alpha,
                   ThreadTeam& team, std::span<double> weights) {
  SUPERFACETS_ASSERT(std::cmp_equal(centroids.size(), surface.n_cells()));
  SUPERFACETS_ASSERT(std::ssize(weights) == surface.arcs().n_arcs());
  const Buffer<Point> normals = unit_normals(surface, team);
  const auto has_normal = [&](Face face) { return squared_norm(normals[face]) > 0.0; };
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    for (auto face = static_cast<Face>(begin); face < end; ++face) {
      for (const auto [arc, to] : surface.arcs().steps(face)) {
        const double geodesic = way_over(surface.edge(face, arc), centroids[face], centroids[to]);
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
  SUPERFACETS_ASSERT(lengths.size() == weights.size());
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
