// Stage 4b: computes centers from labels.
#pragma once

#include "clustering/sums.hpp"

namespace superfacets {

// The measure-weighted mean position of all cells, or the unweighted mean if all measures are 0.
Point weighted_mean(const OrderedGraph& graph, ThreadTeam& team);

// For each region 0..n_regions-1, the cell nearest to the measure-weighted mean position of the
// region's cells (the unweighted mean, if all measures are 0). If several cells are equally near,
// the result is the lowest. `labels` and the result refer to cells in the sorted order of the
// graph. Every region must have a cell.
std::vector<Place> update_centers(const OrderedGraph& graph, std::span<const Label> labels,
                                  Label n_regions, ThreadTeam& team);

// Incremental version of update_centers, for labels that change little between calls. Only cells
// with a new label change the sums, and the cell nearest to the mean is searched again only for
// changed regions. Regions of nearly zero measure are summed from scratch each time, in a pass over
// all cells. Uses 4 bytes per cell.
class RegionMeans {
 public:
  // Initially, no cell has a label.
  RegionMeans(const OrderedGraph& graph, ThreadTeam& team);

  // Sets the number of regions, which must not decrease.
  void resize(std::size_t n_regions);

  // Sets the label of each cell begin .. end-1 to label_of(place). Several threads may call this
  // function for different ranges at the same time.
  template <typename LabelOf>
  void take_over(Place begin, Place end, const LabelOf& label_of) {
    Change gained, lost;
    for (Place place = begin; place < end; ++place) {
      const Label now = label_of(place);
      if (now == labels_[place]) continue;
      const FixedSum sum = fixed_.of(place);
      collect(lost, labels_[place], sum, -1);
      collect(gained, now, sum, 1);
      labels_[place] = now;
    }
    apply(lost, -1);
    apply(gained, 1);
  }

  // For each region, the cell nearest to the mean position of the region. `members` contains any
  // cell of each region. If a region has no cells, its entry of `members` is a cell of another
  // region, and is returned unchanged.
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
  Buffer<Label> labels_;                   // (N,) last label of each cell
  std::vector<FixedSum> sums_;             // (K,) sum over the cells of each region
  std::vector<std::uint8_t> has_changed_;  // (K,) 1 if a region has changed since the last search
  std::vector<Place> nearest_;             // (K,) result of the last search
};

}  // namespace superfacets
