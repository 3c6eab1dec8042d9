// Stage 5: the region graph. Nodes are regions, and arcs are borders between neighboring regions.
// Cells with kNoLabel belong to no region.
#pragma once

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

struct RegionShape {
  double measure;    // total area or volume of the cells
  Point centroid;    // mean position, weighted by measure; unweighted if all measures are 0
  Point squares;     // entries xx, yy, zz of the covariance of positions, weighted like `centroid`
  Point products;    // entries xy, xz, yz of the covariance
  Point normal_sum;  // sum of the area vectors of the cells
  Point low;         // lower corner of the bounding box of the vertices
  Point high;        // upper corner of the bounding box
  double open_length;  // total length of sides that no arc crosses (boundary of the mesh)
  Cell center;         // the cell nearest to the centroid, the lowest if several are equally near
};

// Computes the RegionShape of regions 0..n_regions-1. Each region must have a cell. Time O(N). The
// result has the same bits for any number of threads. Memory: 4 bytes per cell.
std::vector<RegionShape> measure_regions(const Surface& surface, std::span<const Label> labels,
                                         Label n_regions, ThreadTeam& team);

// The border between two regions. Angles are signed dihedral angles (see Surface::angle). Means are
// weighted by border length, or unweighted if the length is 0.
struct RegionArc {
  Label low;
  Label high;            // higher label than `low`
  double border_length;  // total length of the border
  double mean_angle;     // mean of the absolute angles, in radians
  double signed_angle;   // mean of the signed angles, in radians
  double max_angle;      // signed angle with the largest absolute value, in radians
  std::int64_t n_sides;  // number of sides that form the border
};

// Returns the borders between neighboring regions, sorted by (low, high). A side where more than
// two cells meet is counted once for each pair of regions at the side, with the mean angle over the
// pairs of cells. An arc and its reverse arc are counted once. Time O(N + M), and O(n log n) for n
// arcs that cross borders. The result has the same bits for any number of threads.
std::vector<RegionArc> region_arcs(const Surface& surface, std::span<const Label> labels,
                                   ThreadTeam& team);

}  // namespace superfacets
