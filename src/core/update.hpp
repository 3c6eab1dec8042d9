// Stage 4b: centers from labels.
#pragma once

#include "types.hpp"

namespace superfacets {

// For each region 0..n_regions-1 the cell nearest to the measure-weighted mean of the positions of
// its cells, lowest index among equals; the plain mean where all measures are 0. Every region must
// have a cell. Sums run over the cells in the order of their indices.
std::vector<Cell> update_centers(std::span<const Point> positions, std::span<const double> measures,
                                 std::span<const Label> labels, Label n_regions);

// The measure-weighted mean of all positions, by the same rules.
Point weighted_mean(std::span<const Point> positions, std::span<const double> measures);

}  // namespace superfacets
