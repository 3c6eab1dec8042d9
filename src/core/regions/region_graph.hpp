// Stage 5: the region graph. Nodes are regions with their measures, and arcs are borders between
// neighbors. Cells with kNoLabel belong to no region.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

struct RegionShape {
  double measure;
  Point centroid;    // mean position, weighted by measure; unweighted if all measures are 0
  Point squares;     // xx, yy, zz of the covariance, with the same weights
  Point products;    // xy, xz, yz of the covariance
  Point normal_sum;  // sum of the area vectors
  Point low;         // corners of the bounding box of the vertices
  Point high;
  double open_length;  // length of border that no arc crosses
  Cell center;         // the cell nearest to the centroid; ties go to the lowest index
};

// Measures regions 0..n_regions-1. Each region must have a cell. Time O(N). The result has the same
// bits for any number of threads. Memory: 4 bytes per cell.
std::vector<RegionShape> measure_regions(const Surface& surface, std::span<const Label> labels,
                                         Label n_regions, ThreadTeam& team);

// The border between two regions. Angles are signed dihedral angles (see Surface::angle). Means are
// weighted by border length, or unweighted if the length is 0.
struct RegionArc {
  Label low;
  Label high;  // > low
  double border_length;
  double mean_angle;    // mean of the absolute angles
  double signed_angle;  // the mean of the angles
  double max_angle;     // angle of largest absolute value; ties go to the positive one
  std::int64_t n_sides;
};

// The borders between neighboring regions, sorted. A side where several cells meet counts once for
// each pair of regions at the side, with the mean angle over the pairs of cells. An arc counts
// once, with or without a reverse arc. Time O(N + M), and O(n log n) for n arcs that cross borders.
// The result has the same bits for any number of threads.
std::vector<RegionArc> region_arcs(const Surface& surface, std::span<const Label> labels,
                                   ThreadTeam& team);

}  // namespace superfacets
