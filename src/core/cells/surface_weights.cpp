#include "cells/surface_weights.hpp"

#include "cells/components.hpp"
#include "cells/ridges.hpp"

namespace superfacets {
namespace {

// Provides the angle and convexity of each edge to the class Ridges.
struct SurfaceBends {
  const Surface& surface;

  double angle(Cell cell, std::int64_t arc, Cell) const {
    return std::abs(surface.angle(cell, arc));
  }
  bool is_convex(Cell cell, std::int64_t arc, Cell) const { return surface.angle(cell, arc) < 0.0; }
};

// Computes weights of arcs, and sums over edges.
class SurfaceWeigher {
 public:
  SurfaceWeigher(const Surface& surface, const EdgeFactors& factors, bool wants_sums,
                 const CrowdedFaces& crowded)
      : surface_(surface),
        factors_(factors),
        wants_sums_(wants_sums),
        net_turn_(factors.diagonal),
        bends_{surface},
        ridges_(surface, bends_, crowded) {}

  const EdgeSums& sums() const { return sums_; }

  double weight(Cell cell, std::int64_t arc, Cell to) {
    const double angle = surface_.angle(cell, arc);
    const bool is_sharp = factors_.has_ridges() && angle <= -kSharpAngle;
    const bool is_ridge = is_sharp && ridges_.crosses(cell, arc);
    if (wants_sums_ && cell < to) {
      const double border = surface_.border_length(cell, arc);
      if (factors_.has_ridges()) count_edge(std::abs(angle), border);
      if (!is_ridge) sums_.turn += turn(-angle * border);
    }
    const double eta = is_ridge ? factors_.ridges : factors_.eta(angle, std::abs(angle));
    const double length =
        factors_.crease_length > 0.0 ? factors_.crease_length : surface_.border_length(cell, arc);
    const double angular = factors_.angular(eta, length, std::abs(angle));
    const double step = factors_.is_straight ? norm(surface_.position(to) - surface_.position(cell))
                                             : surface_.step_length(cell, arc);
    return (step + angular) / factors_.diagonal;
  }

 private:
  void count_edge(double bend, double length) {
    ++sums_.n_edges;
    sums_.n_flat += static_cast<std::int64_t>(bend < kFlatAngle);
    const std::int64_t bent = turn(bend * length);
    sums_.bent += bent;
    if (bend >= kSharpAngle) sums_.sharp += bent;
  }
  std::int64_t turn(double term) const {
    return static_cast<std::int64_t>(net_turn_.rounded(term));
  }

  const Surface& surface_;
  const EdgeFactors& factors_;
  const bool wants_sums_;
  const NetTurn net_turn_;
  const SurfaceBends bends_;
  const Ridges<Surface, SurfaceBends> ridges_;
  EdgeSums sums_;
};

// Minimum share of the area of a flat patch that counts as a flat side for any neighbors, such as a
// side of a gable roof. Triangles of organic meshes, even subdivided, have a smaller share.
constexpr double kLargeShare = 0.02;

// Up to four different neighbors of a flat patch of faces.
struct PatchNeighbors {
  std::array<Cell, 4> patches{kNoCell, kNoCell, kNoCell, kNoCell};
  std::uint8_t n = 0;
  bool has_boundary = false;

  void add(Cell patch) {
    const auto end = patches.begin() + n;
    if (n < patches.size() && std::find(patches.begin(), end, patch) == end) patches[n++] = patch;
  }
  bool are_many() const { return n + int{has_boundary} >= 4; }
};

}  // namespace

WeighedArcs surface_weights(const Surface& surface, const EdgeFactors& factors, bool wants_sums,
                            ThreadTeam& team) {
  SUPERFACETS_ASSERT(factors.diagonal > 0.0);
  const CrowdedFaces crowded = crowded_faces(surface.arcs(), SurfaceBends{surface}, factors);
  WeighedArcs weighed;
  weighed.weights = Buffer<double>(surface.arcs().n_arcs());
  std::mutex adding;  // protects the sums; sums of integers do not depend on the order of terms
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    SurfaceWeigher weigher(surface, factors, wants_sums, crowded);
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      for (const auto [arc, to] : surface.arcs().steps(cell)) {
        weighed.weights[arc] = weigher.weight(cell, arc, to);
      }
    }
    const std::scoped_lock lock(adding);
    weighed.sums.add(weigher.sums());
  });
  return weighed;
}

double share_of_flat_sides(const Surface& surface, std::span<const double> areas_of_cells,
                           std::span<const Point> normals, ThreadTeam& team) {
  const Arcs& arcs = surface.arcs();
  Buffer<char> is_flat(arcs.n_arcs());
  Buffer<char> is_open(surface.n_cells());
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      is_open[cell] = static_cast<char>(surface.open_length(cell) > 0.0);
      for (const auto [arc, to] : arcs.steps(cell)) {
        // If one face is turned over, the cosine is near -1.
        const double cosine = normals.empty() ? -1.0 : dot(normals[cell], normals[to]);
        is_flat[arc] = static_cast<char>(
            cosine > kFlatCosine ||
            (cosine < -kFlatCosine && std::abs(surface.angle(cell, arc)) < kFlatAngle));
      }
    }
  });
  const auto for_each_flat = [&](Cell cell, const auto& visit) {
    for (const auto [arc, to] : arcs.steps(cell)) {
      if (is_flat[arc] != 0) visit(to);
    }
  };
  const Components patches = unite_neighbors(surface.n_cells(), for_each_flat, team);
  std::vector<PatchNeighbors> neighbors(patches.n_components);
  std::vector<double> areas(patches.n_components, 0.0);
  double total = 0.0;
  for (Cell cell = 0; cell < surface.n_cells(); ++cell) {
    PatchNeighbors& around = neighbors[patches.of[cell]];
    for (const auto [arc, to] : arcs.steps(cell)) {
      if (patches.of[to] != patches.of[cell]) around.add(patches.of[to]);
    }
    around.has_boundary |= is_open[cell] != 0;
    areas[patches.of[cell]] += areas_of_cells[cell];
    total += areas_of_cells[cell];
  }
  double in_sides = 0.0;
  for (Cell patch = 0; patch < patches.n_components; ++patch) {
    const bool is_large = areas[patch] >= kLargeShare * total;
    if (is_large || neighbors[patch].are_many()) in_sides += areas[patch];
  }
  return total > 0.0 ? in_sides / total : 0.0;
}

}  // namespace superfacets
