// Stage 2: the length of each arc (eq. 1-3 of the paper), and its rounding to whole units.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/assert.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "base/versions.hpp"
#include "cells/triangle_surface.hpp"

namespace superfacets {

// The sum of all weights is less than 2 to this power, in units, and so is any path: it fits into
// 64 bits, and a double holds it exactly. On meshes of millions of faces a mean arc still has 2^23
// units, and a typical arc has enough of them even if a few arcs are 2^20 times as long.
inline constexpr int kTotalBits = 48;

// What a sharp edge bends by at least: 40 degrees, so that both edges of a chamfer of 45 count.
// Edges of rounded limbs bend by less on all but coarse meshes.
inline constexpr double kSharpAngle = std::numbers::pi * 2.0 / 9.0;

struct WeightOptions {
  double alpha = 200.0;        // weight of the angular term, >= 0
  double eta_convex = 0.2;     // what a convex edge counts, against 1 for a concave one
  double crease_length = 0.0;  // what stands for |e| in eq. 2; 0: the length of each edge itself
  double diagonal = 1.0;       // d, of the bounding box of the vertices that faces use
  double ridges = 0.0;         // what a ridge (ridges.hpp) counts, if that is more than eta_convex
  double evened = 0.0;         // what smooth concave edges count less, and smooth convex ones count

  // What an edge counts that bends by theta, but for ridges; it is concave where rise > 0. Smooth
  // ones bend by less than kSharpAngle.
  SUPERFACETS_ALWAYS_INLINE double eta(double rise, double theta) const {
    const double of_concave = theta < kSharpAngle ? 1.0 - evened : 1.0;
    const double of_convex = theta < kSharpAngle ? std::max(eta_convex, evened) : eta_convex;
    return rise > 0.0 ? of_concave : of_convex;
  }

  // Whether ridges count more than other convex edges.
  bool has_ridges() const { return alpha > 0.0 && ridges > eta_convex; }

  // The options for ridges.
  WeightOptions of_ridges() const {
    WeightOptions options = *this;
    options.eta_convex = ridges;
    return options;
  }
};

// How much a surface turns outward, in net: the sum over edges of theta times their length,
// negative where they are concave, without the ridges that options count. That is twice the total
// mean curvature of what is left. An edge is counted with its lower face. Each term is rounded to a
// whole number of units, so that sums over parts add up to that over all, in any order.
class NetTurn {
 public:
  NetTurn() = default;
  NetTurn(double diagonal, std::span<const std::uint8_t> is_counted)
      : units_(std::ldexp(1.0, kTurnBits - std::ilogb(diagonal))), is_counted_(is_counted) {
    SUPERFACETS_ASSERT(diagonal > 0.0);
  }

  // A whole number of units. An edge folds back at most, and is no longer than the diagonal: the
  // sum over 2^19 of them is exact in a double, that over 2^29 fits into 64 bits.
  SUPERFACETS_ALWAYS_INLINE double rounded(double turn) const {
    constexpr double kNoFraction = 0x1.8p52;  // no call, as in round_weights, and of either sign
    return (turn * units_ + kNoFraction) - kNoFraction;
  }
  // Whether the edges between a face and higher ones are among those that are summed up.
  bool counts(Cell face) const { return is_counted_.empty() || is_counted_[face] != 0; }

 private:
  static constexpr int kTurnBits = 31;

  double units_ = 1.0;                        // in one unit of length
  std::span<const std::uint8_t> is_counted_;  // (N,), or empty: all
};

// Centroids, areas and unit normals of faces, computed once because each arc needs them. Normals
// may be empty: they are then computed, which takes 24 bytes a face.
struct FaceMeasures {
  std::span<const Point> centroids;
  std::span<const double> areas;
  std::span<const Point> normals;
};

// The weight of an arc by eq. 6; normals are zero where there are none.
inline double stk02_weight(double geodesic, const Point& normal_from, const Point& normal_to,
                           double alpha) {
  const double cosine = dot(normal_from, normal_to);
  const bool is_bent = squared_norm(normal_from) > 0.0 && squared_norm(normal_to) > 0.0;
  // Rounding can take the squared cosine of equal normals above 1.
  const double angular = is_bent ? std::max(0.0, 1.0 - cosine * cosine) : 0.0;
  return (1.0 - alpha) * geodesic + alpha * angular;
}

// weights[a] = (|c_i - m| + |m - c_j| + alpha eta |e| theta / pi) / d, finite and >= 0, where
// options may put another length in the place of |e|. theta is in [0, pi] and 0 where a face has no
// normal. The two arcs of a pair get the same bits. Options may let ridges count more than other
// convex edges. Returns the net turn of what is counted, in units; 0 if it is not wanted.
std::int64_t superfacet_weights(const TriangleSurface& surface, const FaceMeasures& faces,
                                const WeightOptions& options, const NetTurn* net_turn,
                                ThreadTeam& team, std::span<double> weights);

// weights[a] = (1 - alpha) (|c_i - m| + |m - c_j|) + alpha (1 - (n_i . n_j)^2), the weighting of
// Shlafman, Tal and Katz 2002 (eq. 6 of the paper), 0 <= alpha <= 1; finite and >= 0. The second
// term is 0 where a face has no normal. Memory: 24 bytes per face.
void stk02_weights(const TriangleSurface& surface, std::span<const Point> centroids, double alpha,
                   ThreadTeam& team, std::span<double> weights);

// Rounds finite weights >= 0 to whole numbers >= 1 of a unit, which is returned: the power of two
// that is 2^47 to 2^48 times smaller than the sum of the weights (1 if all are 0). The same bits on
// any number of threads.
double quantize_weights(std::span<const double> weights, ThreadTeam& team,
                        std::span<float> lengths);

// The unit for weights of this sum, and the rounding to a unit that is known.
double unit_of_lengths(double total_weight);
void round_weights(std::span<const double> weights, double unit, ThreadTeam& team,
                   std::span<float> lengths);

}  // namespace superfacets
