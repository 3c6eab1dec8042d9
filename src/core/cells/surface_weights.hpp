// Stage 2 for cells of any kind: arc weights of all kinds (see weights.hpp).
#pragma once

#include "cells/polygon_surface.hpp"
#include "cells/weights.hpp"

namespace superfacets {

// weights[a] = (step + alpha eta b |theta| / pi) / d. The step, the border length b and the angle
// |theta| are measures of the arc (see Surface). EdgeFactors defines eta, and the slack that is
// subtracted from |theta|. For triangles, the result has the same bits as triangle_weights of
// weights.hpp. A positive crease_length of the factors replaces b. Ridges may cost more than other
// convex edges.
WeighedArcs surface_weights(const Surface& surface, const EdgeFactors& factors, bool wants_sums,
                            ThreadTeam& team);

// Returns the share of the area that belongs to flat sides, as on a box. A flat side is a set of
// faces connected across flat edges that has at least four neighbors, where a boundary counts as
// one, or at least 2 % of the area. Subdivision of faces does not change the share: a subdivided
// triangle has three neighbors. If `normals` is empty, flat edges are found by angles.
double share_of_flat_sides(const Surface& surface, std::span<const double> areas_of_cells,
                           std::span<const Point> normals, ThreadTeam& team);

}  // namespace superfacets
