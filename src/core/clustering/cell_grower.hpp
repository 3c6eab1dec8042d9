// Divides a range of places into small connected cells around centers.
#pragma once

#include "cells/ordered_graph.hpp"
#include "cells/weights.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// Divides ranges of places among centers, one range after another. Each place goes to the center
// with the shortest path within the range. Ties go to the first center. A range should fit into the
// first-level cache.
class CellGrower {
 public:
  static constexpr int kRangeBits = 12;  // a range has at most 2^kRangeBits places

  // Centers are `spacing` places apart.
  CellGrower(const OrderedGraph& graph, Place spacing) : graph_(graph), spacing_(spacing) {}

  // Divides the places begin to end - 1. While paths leave some place unreached, the first such
  // place becomes another center.
  void divide(Place begin, Place end);

  // Results for the last range: its centers, and for each place the index of its center and the
  // length of the path from that center.
  std::span<const Place> centers() const { return centers_; }
  std::size_t cell(Place place) const { return paths_[place - begin_] & kCellMask; }
  PathLength length(Place place) const { return paths_[place - begin_] >> kRangeBits; }
  // The sum of the prices of the arcs on the path to a place. Only graphs with prices have it.
  float price(Place place) const { return prices_[place - begin_]; }

 private:
  // A path length and the index of a center, packed into one integer that compares like (length,
  // center).
  using PackedPath = std::uint64_t;
  static_assert(kTotalBits + 1 + kRangeBits < 64);
  static constexpr PackedPath kCellMask = (PackedPath{1} << kRangeBits) - 1;
  static constexpr PackedPath kNoPath = ~PackedPath{0};

  // Limit of expansions per place of the range. At this limit the search switches to Dijkstra's
  // algorithm. On meshes a place is expanded once or twice.
  static constexpr std::size_t kMaxExpanded = 4;

  // The index of a place within the range. All places outside share one extra entry, which no path
  // improves.
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
  std::size_t size_ = 0;  // number of places in the range
  std::vector<Place> centers_;
  std::vector<PackedPath> paths_;            // by index, plus one entry for all places outside
  std::vector<float> prices_;                // by index, if arcs have prices
  std::vector<std::uint8_t> is_waiting_;     // by index
  std::vector<std::size_t> waiting_, next_;  // indices with an improved path, not yet expanded
  RadixHeap heap_;
};

}  // namespace superfacets
