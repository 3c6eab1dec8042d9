// Stage 5: cost of changes of region areas, and of cells far from the centroids of their regions.
#pragma once

#include "base/threads.hpp"
#include "cells/surface.hpp"

namespace superfacets {

struct AreaChange {
  Label region;
  double change;
};

// Input of StiffGain for a cell that may move to another region.
struct StiffCell {
  double area = 0.0;
  double gain = 0.0;  // decrease of the roundness cost by the move
};

// Decrease of the stiffness cost when a cell moves from one region to another.
struct StiffGain {
  double slope = 0.0;
  double curvature = 0.0;
  double of(const StiffCell& cell) const {
    return cell.gain - cell.area * (slope + curvature * cell.area);
  }
};

// The cost is the sum over all regions of
//   stiffness * (A - A_0)^2 / (2 A_0) + roundness * integral of |x - x_0|^2 over the region,
// where A is the area of a region, and A_0 and x_0 are its initial area and centroid. The first
// term preserves areas. The second term makes regions round where borders of many shapes have equal
// length, as in a regular grid.
struct StiffnessOptions {
  double stiffness = 0.0;  // per unit of length; 0 turns both terms off
  double roundness = 0.0;  // per unit of length, cubed
  // Target sizes, which replace the initial areas A_0. The sum of the sizes of its cells then
  // replaces the area of a region. Either both arrays are empty, or neither.
  std::span<const double> sizes;  // (N,) size of each cell
  std::span<const double> goals;  // (K,) target size of each region
};

// The area of each region, and the area-weighted sum of the positions of its cells. Cells are
// summed in fixed blocks, in ascending order, so that the sums do not depend on the number of
// threads.
struct RegionSums {
  std::vector<double> areas;
  std::vector<Point> moments;
};
RegionSums sums_of_regions(const Surface& surface, std::span<const Label> labels, ThreadTeam& team);

class Stiffness {
 public:
  // `at_first` holds the initial sums of all regions. It is not read if stiffness is 0. Labels are
  // read only if there are goals.
  Stiffness(const Surface& surface, const RegionSums& at_first, std::span<const Label> labels,
            const StiffnessOptions& options);

  bool is_off() const { return weights_.empty(); }
  Label n_regions() const { return static_cast<Label>(weights_.size()); }

  StiffCell cell(Cell cell, Label from, Label to) const;

  // `changes` holds changes of areas that are not yet part of this object.
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
  std::vector<double> weights_;    // (K,) stiffness / A_0; empty if stiffness is off
  std::vector<Point> centroids_;   // x_0
  std::vector<double> changes_;    // A - A_0
};

}  // namespace superfacets
