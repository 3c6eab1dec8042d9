// Stage 5: cost of area changes of regions, and of cells far from the centroids of their regions.
#pragma once

#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

struct AreaChange {
  Label region;
  double change;
};

// Data of a cell that may move to another region, for StiffGain.
struct StiffCell {
  double area = 0.0;  // area of the cell, or its size if there are target sizes
  double gain = 0.0;  // decrease of the roundness cost if the cell moves
};

// Decrease of the stiffness and roundness cost when a cell moves from one region to another, as a
// quadratic function of its area.
struct StiffGain {
  double slope = 0.0;
  double curvature = 0.0;
  double of(const StiffCell& cell) const {
    return cell.gain - cell.area * (slope + curvature * cell.area);
  }
};

// The cost is the sum over all regions of stiffness * m * (A / A_0 - 1)^2 / 2 + roundness *
// integral of |x - x_0|^2 over the region, where A is the area of a region, A_0 and x_0 are its
// initial area and centroid, and m is the mean area of regions. The first term preserves areas. It
// counts relative changes, so that small regions do not shrink to single cells. The second term
// favors round regions. The second term is needed on regular grids, where borders of many different
// shapes have equal length.
struct StiffnessOptions {
  double stiffness = 0.0;  // factor of the first term, in 1 / length; if 0, both terms are off
  double roundness = 0.0;  // factor of the second term, in 1 / length^3
  // Optional target sizes. If they are given, the size of a region is the sum of `sizes` over its
  // cells. The first term is then stiffness * (A - A_0)^2 / (2 A_0), where A is this size and A_0
  // is the target size.
  std::span<const double> sizes;  // (N,) size of each cell
  std::span<const double> goals;  // (K,) target size of each region
};

// Sums over the cells of each region. The sums do not depend on the number of threads.
struct RegionSums {
  std::vector<double> areas;   // (K,) total area of the cells of each region
  std::vector<Point> moments;  // (K,) sum of area times position over the cells of each region
};
RegionSums sums_of_regions(const Surface& surface, std::span<const Label> labels, ThreadTeam& team);

class Stiffness {
 public:
  // `at_first` contains the initial sums of all regions, and is not used if stiffness is 0.
  // `labels` is only used if there are goals.
  Stiffness(const Surface& surface, const RegionSums& at_first, std::span<const Label> labels,
            const StiffnessOptions& options);

  bool is_off() const { return weights_.empty(); }
  Label n_regions() const { return static_cast<Label>(weights_.size()); }

  StiffCell cell(Cell cell, Label from, Label to) const;

  // `changes` contains area changes that have not been added to this object yet.
  StiffGain gain(Label from, Label to, std::span<const double> changes) const {
    return {weights_[to] * (changes_[to] + changes[to]) -
                weights_[from] * (changes_[from] + changes[from]),
            0.5 * (weights_[to] + weights_[from])};
  }

  void add(std::span<const AreaChange> changes) {
    for (const auto [region, change] : changes) changes_[region] += change;
  }

 private:
  void set_goals(std::span<const Label> labels, const StiffnessOptions& options, double least);

  const Surface& surface_;
  const double roundness_;
  std::span<const double> sizes_;  // (N,) size of each cell; empty if areas are used
  std::vector<double> weights_;    // (K,) curvature of the first term; empty if stiffness is off
  std::vector<Point> centroids_;   // (K,) x_0 of each region
  std::vector<double> changes_;    // (K,) A - A_0 of each region
};

}  // namespace superfacets
