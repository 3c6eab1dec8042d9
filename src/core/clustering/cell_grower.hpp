// Divides a range of fine cells into small connected coarse cells.
#pragma once

#include "cells/ordered_graph.hpp"
#include "cells/quantization.hpp"
#include "paths/radix_heap.hpp"

namespace superfacets {

// Divides ranges of consecutive cells among centers, one range after another. Each cell is assigned
// to the center with the shortest path within the range; if two paths are equally short, to the
// center that comes first. A range should fit into the first-level cache.
class CellGrower {
 public:
  static constexpr int kRangeBits = 12;  // a range has at most 2^kRangeBits cells

  // `spacing` is the distance between consecutive centers, counted in cells of the sorted order.
  CellGrower(const OrderedGraph& graph, Place spacing) : graph_(graph), spacing_(spacing) {}

  // Divides the cells begin .. end-1. As long as some cell is not reached by any path, the first
  // such cell becomes another center.
  void divide(Place begin, Place end);

  // Results for the last range: the centers, and for each fine cell the index of its center and the
  // length of the path from that center.
  std::span<const Place> centers() const { return centers_; }
  std::size_t cell(Place place) const { return paths_[place - begin_] & kCellMask; }
  PathLength length(Place place) const { return paths_[place - begin_] >> kRangeBits; }
  // Sum of the crease costs on the path to a cell. Only available if the graph has a straight_unit
  // > 0 (see OrderedGraph).
  float crease_cost(Place place) const { return costs_[place - begin_]; }

 private:
  // A path length and the index of a center, packed into one integer that compares like (length,
  // center).
  using PackedPath = std::uint64_t;
  static_assert(kTotalBits + 1 + kRangeBits < 64);
  static constexpr PackedPath kCellMask = (PackedPath{1} << kRangeBits) - 1;
  static constexpr PackedPath kNoPath = ~PackedPath{0};

  // Maximum number of expansions per cell of the range. Above this number, the search switches to
  // Dijkstra's algorithm. On meshes, a cell is expanded once or twice.
  static constexpr std::size_t kMaxExpanded = 4;

  // The index of a cell within the range. All cells outside the range share one extra index, whose
  // path is never improved.
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
  std::size_t size_ = 0;  // number of cells in the range
  std::vector<Place> centers_;
  std::vector<PackedPath>
      paths_;  // best path to each cell of the range, plus one entry for all cells outside
  std::vector<float> costs_;  // sum of crease costs of each path; empty if straight_unit is 0
  std::vector<std::uint8_t> is_waiting_;     // 1 if a cell is in the list of the next round
  std::vector<std::size_t> waiting_, next_;  // cells to expand in this round and in the next round
  RadixHeap heap_;
};

}  // namespace superfacets
