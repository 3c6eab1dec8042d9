// Stage 2 for cells of any kind: eq. 1-3 of the measures of arcs.
#pragma once

#include "base/threads.hpp"
#include "cells/polygon_surface.hpp"
#include "cells/weights.hpp"

namespace superfacets {

// weights[a] = (step + alpha eta b theta / pi) / d, with the length of the step and of the border b
// of an arc and the angle theta (see Surface); eta is 1 if theta is positive. For faces, the same
// bits as triangle_weights of weights.hpp. crease_length replaces b if given. Ridges may cost
// more than other convex edges. Returns sums over edges; their turn is 0 if net_turn is null.
EdgeSums surface_weights(const Surface& surface, const WeightOptions& options,
                         const NetTurn* net_turn, ThreadTeam& team, std::span<double> weights);

// Like stk02_weights of triangles.
void stk02_weights(const PolygonSurface& surface, double alpha, ThreadTeam& team,
                   std::span<double> weights);

}  // namespace superfacets
