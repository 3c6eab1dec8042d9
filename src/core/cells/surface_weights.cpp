#include "cells/surface_weights.hpp"

#include <cmath>
#include <numbers>

#include "base/assert.hpp"
#include "cells/ridges.hpp"

namespace superfacets {
namespace {

// Calls weight(cell, arc, target) for all arcs.
template <typename Weight>
void weigh_arcs(const Surface& surface, ThreadTeam& team, std::span<double> weights,
                const Weight& weight) {
  SUPERFACETS_ASSERT(std::ssize(weights) == surface.arcs().n_arcs());
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
      for (const auto [arc, to] : surface.arcs().steps(cell)) weights[arc] = weight(cell, arc, to);
    }
  });
}

// What ridges are found by.
struct SurfaceBends {
  const Surface& surface;

  double angle(Cell cell, std::int64_t arc, Cell) const {
    return std::abs(surface.angle(cell, arc));
  }
  bool is_convex(Cell cell, std::int64_t arc, Cell) const { return surface.angle(cell, arc) < 0.0; }
};

}  // namespace

void surface_weights(const Surface& surface, const WeightOptions& options, ThreadTeam& team,
                     std::span<double> weights) {
  SUPERFACETS_ASSERT(options.diagonal > 0.0);
  const SurfaceBends bends{surface};
  const Ridges ridges(surface, bends);
  const auto counts_as_ridge = [&](Cell cell, std::int64_t arc, double angle) {
    return options.has_ridges() && angle <= -kSharpAngle && ridges.crosses(cell, arc);
  };
  weigh_arcs(surface, team, weights, [&](Cell cell, std::int64_t arc, Cell) {
    const double angle = surface.angle(cell, arc);
    const double of_convex =
        counts_as_ridge(cell, arc, angle) ? options.ridges : options.eta_convex;
    const double eta = angle > 0.0 ? 1.0 : of_convex;
    const double length =
        options.crease_length > 0.0 ? options.crease_length : surface.border_length(cell, arc);
    const double price = options.alpha * eta * length;
    const double angular = price * std::abs(angle) / std::numbers::pi;  // eq. 2
    return (surface.step_length(cell, arc) + angular) / options.diagonal;
  });
}

void stk02_weights(const PolygonSurface& surface, double alpha, ThreadTeam& team,
                   std::span<double> weights) {
  weigh_arcs(surface, team, weights, [&](Cell face, std::int64_t arc, Cell to) {
    return stk02_weight(surface.step_length(face, arc), surface.normal(face), surface.normal(to),
                        alpha);
  });
}

}  // namespace superfacets
