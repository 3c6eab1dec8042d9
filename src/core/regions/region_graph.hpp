// Stage 5: the region graph: measures of regions, and of the borders between neighbors. A cell with
// kNoLabel is in no region.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "base/types.hpp"
#include "cells/surface.hpp"

namespace superfacets {

struct RegionShape {
  double measure;
  Point centroid;    // weighted by measure; the plain mean where all measures are 0
  Point squares;     // xx, yy, zz of the covariance, weighted likewise
  Point products;    // xy, xz, yz
  Point normal_sum;  // the sum of area vectors
  Point low;         // of the box around the vertices
  Point high;
  double open_length;  // of border that no arc crosses
  Cell center;         // the cell nearest to the centroid, the lowest among equals
};

// Measures regions 0..n_regions-1, each of which has a cell. Time O(N); the same bits on any number
// of threads. Memory: 4 bytes per cell.
std::vector<RegionShape> measure_regions(const Surface& surface, std::span<const Label> labels,
                                         Label n_regions, ThreadTeam& team);

// The border between two regions. Angles are those of Surface::angle; means are weighted by border
// length, or plain if that is 0.
struct RegionArc {
  Label low;
  Label high;  // > low
  double border_length;
  double mean_angle;    // of the absolute values
  double signed_angle;  // the mean of the angles
  double max_angle;     // of largest absolute value, the positive one of two equals
  std::int64_t n_sides;
};

// The borders between neighboring regions, sorted. If several cells meet at one side, the side
// counts once for each pair of regions there, with the mean over the pairs of their cells. An arc
// without a reverse arc counts as if it had one. Time O(N + M), and O(n log n) for n arcs that
// cross borders; the same bits for any number of threads.
std::vector<RegionArc> region_arcs(const Surface& surface, std::span<const Label> labels,
                                   ThreadTeam& team);

}  // namespace superfacets
