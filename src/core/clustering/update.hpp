// Stage 4b: computes centers from labels.
#pragma once

#include "cells/ordered_graph.hpp"
#include "clustering/sums.hpp"

namespace superfacets {

// The measure-weighted mean position of all cells, or the unweighted mean if all measures are 0.
Point weighted_mean(const OrderedGraph& graph, ThreadTeam& team);

// For each region 0..n_regions-1, the place nearest to the measure-weighted mean position of its
// cells (the unweighted mean, if all measures are 0). Ties go to the lowest cell. `labels` is
// indexed by place. Every region must have a cell.
std::vector<Place> update_centers(const OrderedGraph& graph, std::span<const Label> labels,
                                  Label n_regions, ThreadTeam& team);

// Computes update_centers incrementally, for labels that change little between calls. Only cells
// with a new label change the sums, and only changed regions search for their nearest place.
// Regions of nearly zero measure are summed from scratch each time, in a pass over all cells.
// Memory: 4 bytes per cell.
class RegionMeans {
 public:
  // Initially, no cell has a label.
  RegionMeans(const OrderedGraph& graph, ThreadTeam& team);

  void resize(std::size_t n_regions);

  // Sets the labels of the places begin to end - 1 to label_of(place). Several threads may call it
  // at once.
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

  // For each region, the place nearest to its mean position. `members` holds any place of each
  // region. For a region without cells, `members` holds a place of another region, which becomes
  // the result.
  const std::vector<Place>& nearest(std::span<const Place> members);

 private:
  // Sum over a run of consecutive cells that change to or from the same label.
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
  std::vector<std::uint8_t> has_changed_;  // (K,) 1: changed since its nearest place was found
  std::vector<Place> nearest_;             // (K,)
};

}  // namespace superfacets
