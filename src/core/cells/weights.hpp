// Stage 2: the formula of arc weights, and its kernel for triangles. The kernel for cells of any
// kind is in surface_weights.hpp. Equations are numbered as in Simari, Picciau and De Floriani,
// "Fast and Scalable Mesh Superfacets", 2014: eq. 1 is the geodesic term of a weight, eq. 2 the
// angular term, and eq. 3 the normalized sum of both.
#pragma once

#include <numbers>
#include <numeric>

#include "base/versions.hpp"
#include "cells/quantization.hpp"
#include "cells/triangle_surface.hpp"

namespace superfacets {

// Smallest angle of a sharp edge: 40 degrees, so both edges of a 45-degree chamfer are sharp. Edges
// on rounded limbs have smaller angles, except on coarse meshes.
inline constexpr double kSharpAngle = std::numbers::pi * 2.0 / 9.0;

// Upper bound of the angle of a flat edge: 0.05 degrees. Rounding of vertices to single precision
// bends edges less, unless they are shorter than 1e-4 of the diagonal.
inline constexpr double kFlatAngle = std::numbers::pi / 3600.0;

struct EdgeFactors {
  double alpha = 200.0;     // factor of the angular term, >= 0
  double eta_convex = 0.2;  // eta of convex edges; eta of concave edges is 1 (but see convex_share)
  double crease_length = 0.0;  // replaces the edge length |e| in eq. 2 if > 0
  double diagonal = 1.0;       // d, the diagonal of the bounding box of the vertices used by faces
  double ridges = 0.0;         // eta of ridges (ridges.hpp); only used if larger than eta_convex
  // Subtracted from eta of smooth concave edges, and a lower bound of eta of smooth convex edges.
  double convex_share = 0.0;
  // If true, a step is the straight line from centroid to centroid, not the path via the edge.
  bool is_straight = false;
  double slack = 0.0;  // angle in radians that is subtracted from the angle of each edge
  // If positive, weights on large graphs are rounded at once to this factor times unit_of_lengths.
  double unit_factor = 0.0;

  // eta of an edge with angle theta that is not a ridge. The edge is concave if rise > 0. An edge
  // is smooth if its angle is less than kSharpAngle.
  SUPERFACETS_ALWAYS_INLINE double eta(double rise, double theta) const {
    const double of_concave = theta < kSharpAngle ? 1.0 - convex_share : 1.0;
    const double of_convex = theta < kSharpAngle ? std::max(eta_convex, convex_share) : eta_convex;
    return rise > 0.0 ? of_concave : of_convex;
  }

  // The angular term of eq. 2, for an edge with the given eta, length and angle.
  SUPERFACETS_ALWAYS_INLINE double angular(double eta_of_edge, double length, double theta) const {
    return alpha * eta_of_edge * length * std::max(0.0, theta - slack) / std::numbers::pi;
  }

  // Whether ridges cost more than other convex edges.
  bool has_ridges() const { return alpha > 0.0 && ridges > eta_convex; }

  // Returns a copy of the factors in which convex edges have the eta of ridges.
  EdgeFactors of_ridges() const {
    EdgeFactors factors = *this;
    factors.eta_convex = ridges;
    return factors;
  }
};

// Sums over edges. Each edge is counted once, at the face with the lower index. Turns are sums of
// angle times length, in the units of class NetTurn. If the factors do not use ridges, only `turn`
// is computed.
struct EdgeSums {
  std::int64_t turn = 0;     // net turn
  std::int64_t n_edges = 0;  // number of all edges
  std::int64_t n_flat = 0;   // number of edges with an angle below kFlatAngle
  std::int64_t bent = 0;     // sum of the turns of all edges, all positive
  std::int64_t sharp = 0;    // the same for edges with an angle of at least kSharpAngle

  void add(const EdgeSums& other) {
    turn += other.turn;
    n_edges += other.n_edges;
    n_flat += other.n_flat;
    bent += other.bent;
    sharp += other.sharp;
  }
};

// Net outward turn of a surface: the sum over edges of angle times length, where concave edges are
// negative. The sum is twice the total mean curvature of the surface. If the factors use ridges,
// ridges are left out of the sum. Each edge is counted once, at the face with the lower index. Each
// term is rounded to a whole number of units, so that sums are exact, in any order.
class NetTurn {
 public:
  explicit NetTurn(double diagonal) : units_(std::ldexp(1.0, kTurnBits - std::ilogb(diagonal))) {
    SUPERFACETS_ASSERT(diagonal > 0.0);
  }

  // Converts a term (angle times edge length) to a whole number of units. The angle is at most pi,
  // and an edge is not longer than the diagonal of the bounding box. So sums of 2^19 terms are
  // exact in a double, and sums of 2^29 terms fit into 64 bits.
  SUPERFACETS_ALWAYS_INLINE double rounded(double turn) const {
    // doubles near this number have no fraction bits, for either sign of turn
    constexpr double kNoFraction = 0x1.8p52;
    return (turn * units_ + kNoFraction) - kNoFraction;
  }

 private:
  static constexpr int kTurnBits = 31;

  double units_;  // number of units per radian and unit of length
};

struct WeighedArcs {
  Buffer<double> weights;  // (M,) weight of each arc, finite and >= 0; empty if there are lengths
  Buffer<float> lengths;   // (M,) weights rounded by round_weights, or empty
  double unit = 0.0;       // the unit of lengths
  EdgeSums sums;           // 0 if they are not wanted
};

// Writes the weight of an arc to one of two arrays, or nowhere if both are empty.
struct ArcWriter {
  std::span<double> weights;
  std::span<float> lengths;
  double unit = 1.0;

  void write(std::int64_t arc, double weight) const {
    if (!lengths.empty()) lengths[arc] = rounded_weight(weight, unit);
    if (!weights.empty()) weights[arc] = weight;
  }
};

// Smallest graph whose weights may be rounded at once, and inverse of the fraction of its cells
// from whose arcs the unit is estimated. The estimate is rarely wrong, and then the weights are
// computed again.
inline constexpr std::int64_t kMinRounded = 1 << 17;
inline constexpr std::int64_t kSampled = 32;

// Weighs all arcs, without an array of weights if they may be rounded at once, which takes 4
// instead of 12 bytes per arc. weigh(writer, every) must write the weights of all arcs of one block
// of cells in `every` blocks, with sum_of_sample, and return their sum.
template <typename Weigh>
WeighedArcs weigh_arcs(const Arcs& arcs, double unit_factor, const Weigh& weigh) {
  WeighedArcs found;
  if (unit_factor > 0.0 && arcs.n_cells() >= kMinRounded) {
    double total = kSampled * weigh(ArcWriter(), kSampled);
    found.lengths = Buffer<float>(arcs.n_arcs());
    while (std::isfinite(total)) {
      found.unit = unit_factor * unit_of_lengths(total);
      total = weigh(ArcWriter{{}, found.lengths.span(), found.unit}, 1);
      if (found.unit == unit_factor * unit_of_lengths(total)) return found;
    }
    found.lengths = {};  // Python refuses weights that are not finite
  }
  found.weights = Buffer<double>(arcs.n_arcs());
  weigh(ArcWriter{found.weights.span(), {}}, 1);
  return found;
}

// The sum of sum(begin, end) over blocks of cells: over all, or over one small block in `every`.
template <typename Sum>
double sum_of_sample(std::int64_t n, std::int64_t every, const Sum& sum, ThreadTeam& team) {
  const std::int64_t size = every == 1 ? 1 << 14 : 1 << 6;
  std::vector<double> partial((n + size * every - 1) / (size * every));
  team.for_each(std::ssize(partial), [&](std::int64_t task, int) {
    const std::int64_t begin = task * size * every;
    partial[task] = sum(begin, std::min(n, begin + size));
  });
  return std::accumulate(partial.begin(), partial.end(), 0.0);
}

// Centroids and areas of faces. The caller computes them once, because each arc needs them.
struct FaceMeasures {
  std::span<const Point> centroids;
  std::span<const double> areas;
};

// weights[a] = (|c_i - m| + |m - c_j| + alpha eta |e| theta / pi) / d. A positive crease_length
// replaces |e|. If steps are straight, |c_i - c_j| replaces the distance via m, and crease_length
// must be positive. theta is in [0, pi]; it is 0 if one of the faces has no normal. The slack of
// the factors is subtracted from theta, but not below 0. An arc and its reverse arc get
// bit-identical weights. Ridges may cost more than other convex edges.
WeighedArcs triangle_weights(const TriangleSurface& surface, const FaceMeasures& faces,
                             const EdgeFactors& factors, bool wants_sums, ThreadTeam& team);

}  // namespace superfacets
