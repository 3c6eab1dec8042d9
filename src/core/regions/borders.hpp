// Stage 5: borders between regions with their costs, and perimeters of regions.
#pragma once

#include <tuple>

#include "base/buffer.hpp"
#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

// Computes the cost of the border across each arc: the length of the border times exp(-excess /
// crease_scale). The excess is the weight of the arc minus its step length (Surface::step_length),
// in the unit of the positions. So the excess is the angular term of the weight (eq. 2).
struct BorderCosts {
  std::span<const float> lengths;  // (M,) quantized weight of each arc (see quantize_weights)
  double unit = 1.0;               // size of one unit of `lengths`, in the unit of the positions
  double crease_scale = 1.0;       // excess at which the cost is divided by e

  // The weight of an arc, in the unit of the positions.
  double length(std::int64_t arc) const { return double{lengths[arc]} * unit; }

  double operator()(const Surface& surface, Cell from, std::int64_t arc) const;

  // Writes the costs, rounded to float, of consecutive arcs of a cell, beginning with `arc`.
  void write(const Surface& surface, Cell from, std::int64_t arc, std::span<float> costs) const;
};

// Sorts arcs that cross borders by their two regions, then by arc, so that the order of summation
// does not depend on the number of threads.
template <typename Crossing>
void sort_crossings(Buffer<Crossing>& crossings) {
  std::ranges::sort(crossings, {}, [](const Crossing& crossing) {
    return std::tuple(crossing.low, crossing.high, crossing.arc);
  });
}

struct RegionBorder {
  Label low;    // the lower label of the two regions
  Label high;   // the higher label of the two regions
  double cost;  // sum of the costs of the arcs from `low` to `high`
};

// Returns the borders between regions, sorted by (low, high). Time O(N + M), and O(n log n) for n
// arcs that cross borders. The result has the same bits for any number of threads.
std::vector<RegionBorder> region_borders(const Surface& surface, const BorderCosts& costs,
                                         std::span<const Label> labels, ThreadTeam& team);

// Returns the perimeter of each region 0..n_regions-1. Cells may have kNoLabel. A side shared by
// several regions is included once in the perimeter of each region. Sides without arcs (the
// boundary of an open mesh) are included too. Time O(N + M). The result has the same bits for any
// number of threads.
std::vector<double> region_perimeters(const Surface& surface, std::span<const Label> labels,
                                      Label n_regions, ThreadTeam& team);

}  // namespace superfacets
