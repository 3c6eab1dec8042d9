// Stage 5: straight borders between regions.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "regions/borders.hpp"

namespace superfacets {

struct SmoothOptions {
  BorderCost border_cost;
  double max_distance = 0.0;  // how far borders may go, as a path length, in the vertices' unit
  std::size_t max_chain = 1;  // at most so many faces move at once
  int max_sweeps = 1;         // at most so often a border is gone over
};

// Moves faces at borders between regions, each time a chain of neighbors from one region to
// another, as long as that makes the borders cheaper.
//
// Kept at every step: faces that hung together in a region still do, no region loses its last face,
// faces in `fixed` stay, and a face moves only to a region whose first border is within
// max_distance, on a path along the faces that moved before it.
//
// Time O(F + M) and, for each sweep, O(max_chain^2) per face at a border or next to what has just
// moved; memory about 10 bytes per face and 4 per arc. Borders are found on several threads and
// moved on one: the result depends on nothing but the input.
Buffer<Label> smooth_borders(const ArcGeometry& arcs, std::span<const double> weights,
                             std::span<const Label> labels, std::span<const Face> fixed,
                             const SmoothOptions& options, ThreadTeam& team);

}  // namespace superfacets
