// Small connected cells around centers, within a range of places.
#pragma once

#include <vector>

#include "cells/ordered_graph.hpp"
#include "cells/weights.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// Divides one range of places after another among centers, each place to the nearest one by paths
// within the range, the first center among equals. Ranges should fit into a first-level cache.
class CellGrower {
 public:
  static constexpr int kRangeBits = 12;  // a range has at most 2^kRangeBits places

  // Centers are `spacing` places apart.
  CellGrower(const OrderedGraph& graph, Place spacing) : graph_(graph), spacing_(spacing) {}

  // Divides a range. Places without a path from a center are reached by repeatedly making the first
  // of them a center.
  void divide(Place begin, Place end);

  // The centers of the last range and, for each place, the number of its center and the length of
  // the path from there.
  std::span<const Place> centers() const { return centers_; }
  std::size_t cell(Place place) const { return paths_[place - begin_] & kCellMask; }
  PathLength length(Place place) const { return paths_[place - begin_] >> kRangeBits; }
  // The sum of the prices of the arcs on this path, for graphs that have prices.
  float price(Place place) const { return prices_[place - begin_]; }

 private:
  // A path length and a center number packed into one integer, so that integers compare like
  // (length, center).
  using PackedPath = std::uint64_t;
  static_assert(kTotalBits + 1 + kRangeBits < 64);
  static constexpr PackedPath kCellMask = (PackedPath{1} << kRangeBits) - 1;
  static constexpr PackedPath kNoPath = ~PackedPath{0};

  // Number of expanded places, per place of the range, at which the search switches to Dijkstra's
  // algorithm. On meshes it is one to two.
  static constexpr std::size_t kMaxExpanded = 4;

  // The index of a place in the range, or of an entry that nothing improves if it is outside.
  std::size_t index_of(Place place) const {
    return std::min(static_cast<std::size_t>(static_cast<std::uint32_t>(place - begin_)), size_);
  }
  void start(Place center);
  void expand_waiting();
  void expand_in_order();
  void prefetch_arcs(std::size_t index) const;
  template <typename Push>
  void expand(std::size_t index, const Push& push);

  const OrderedGraph& graph_;
  const Place spacing_;
  Place begin_ = 0;
  std::size_t size_ = 0;  // of the range
  std::vector<Place> centers_;
  std::vector<PackedPath> paths_;            // by index, plus one entry for all places outside
  std::vector<float> prices_;                // by index, if arcs have prices
  std::vector<std::uint8_t> is_waiting_;     // by index
  std::vector<std::size_t> waiting_, next_;  // indices with an improved path, not yet expanded
  RadixHeap heap_;
};

}  // namespace superfacets
