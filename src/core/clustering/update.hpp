// Stage 4b: centers from labels.
#pragma once

#include <algorithm>
#include <vector>

#include "cells/ordered_graph.hpp"
#include "clustering/sums.hpp"

namespace superfacets {

// The measure-weighted mean of the positions of all cells; the plain mean where all measures are 0.
Point weighted_mean(const OrderedGraph& graph, ThreadTeam& team);

// For each region 0..n_regions-1 of these labels (by place) the place nearest to the
// measure-weighted mean of the positions of its cells, lowest cell among equals; the plain mean
// where all measures are 0. Every region must have a cell.
std::vector<Place> update_centers(const OrderedGraph& graph, std::span<const Label> labels,
                                  Label n_regions, ThreadTeam& team);

// The same, incrementally, for labels of which few change between calls: only cells with a new
// label are added and subtracted, and only regions that changed search their nearest place. Regions
// of nearly zero measure are summed again each time, which takes a pass over all cells. Memory: 4
// bytes per cell.
class RegionMeans {
 public:
  // At first, no cell has a label.
  RegionMeans(const OrderedGraph& graph, ThreadTeam& team);

  void resize(std::size_t n_regions);

  // Sets the labels of places begin to end - 1 to label_of(place). Safe on several threads at once.
  template <typename LabelOf>
  void take_over(Place begin, Place end, const LabelOf& label_of) {
    Change gained, lost;
    for (Place place = begin; place < end; ++place) {
      const Label now = label_of(place);
      if (now == labels_[place]) continue;
      const FixedSum sum = fixed_.of(graph_, place);
      collect(lost, labels_[place], sum, -1);
      collect(gained, now, sum, 1);
      labels_[place] = now;
    }
    apply(lost, -1);
    apply(gained, 1);
  }

  // The places nearest to the means. `members` holds any place of each region.
  const std::vector<Place>& nearest(std::span<const Place> members);

 private:
  // Consecutive cells that change to or from the same label.
  struct Change {
    Label label = kNoLabel;
    FixedSum sum;
  };

  void collect(Change& change, Label label, const FixedSum& sum, std::int64_t sign);
  void apply(const Change& change, std::int64_t sign);
  std::vector<Point> means_of(std::span<const Label> regions) const;

  const OrderedGraph& graph_;
  ThreadTeam& team_;
  const FixedPoint fixed_;
  Buffer<Label> labels_;                   // (N,)
  std::vector<FixedSum> sums_;             // (K,)
  std::vector<std::uint8_t> has_changed_;  // (K,) since the nearest place was found
  std::vector<Place> nearest_;             // (K,)
};

}  // namespace superfacets
