#include "regions/rings.hpp"

#include <algorithm>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {

Buffer<std::uint8_t> cells_at_borders(std::span<const std::int64_t> offsets,
                                      std::span<const Cell> targets,
                                      std::span<const Label> labels) {
  SUPERFACETS_ASSERT(offsets.size() <= labels.size() + 1 && all_below(targets, labels.size()));
  Buffer<std::uint8_t> are_at_borders(offsets.size() - 1);
  for (std::size_t cell = 0; cell + 1 < offsets.size(); ++cell) {
    bool differs = false;
    for (std::int64_t arc = offsets[cell]; arc < offsets[cell + 1]; ++arc) {
      differs |= labels[targets[arc]] != labels[cell];
    }
    are_at_borders[cell] = static_cast<std::uint8_t>(differs);
  }
  return are_at_borders;
}

void spread_rings(const CellCorners& cells, std::span<std::uint8_t> rings) {
  SUPERFACETS_ASSERT(all_below(cells.corners, rings.size()));
  // In rounds from the largest number down: what a round writes is smaller, and read by the next.
  for (int ring = rings.empty() ? 0 : *std::max_element(rings.begin(), rings.end()); ring > 1;
       --ring) {
    const auto less = static_cast<std::uint8_t>(ring - 1);
    for (std::size_t cell = 0; cell + 1 < cells.offsets.size(); ++cell) {
      const std::span<const Vertex> corners = cells.of(cell);
      int largest = 0;
      for (const Vertex corner : corners) largest = std::max<int>(largest, rings[corner]);
      if (largest != ring) continue;  // where it is larger, all are as large as this already
      for (const Vertex corner : corners) rings[corner] = std::max(rings[corner], less);
    }
  }
}

namespace {

class BandCutter {
 public:
  BandCutter(const CellCorners& cells, std::span<const std::uint8_t> rings,
             std::span<const std::int64_t> arc_offsets, std::span<const std::int32_t> sides)
      : cells_(cells), rings_(rings), arc_offsets_(arc_offsets), sides_(sides) {}

  BandOfTile cut() {
    for (std::size_t cell = 0; cell + 1 < cells_.offsets.size(); ++cell) {
      const std::span<const Vertex> corners = cells_.of(cell);
      const auto is_marked = [&](Vertex corner) { return rings_[corner] != 0; };
      if (std::none_of(corners.begin(), corners.end(), is_marked)) continue;
      const bool is_at_rim = !std::all_of(corners.begin(), corners.end(), is_marked);
      if (is_at_rim) band_.rim.push_back(std::ssize(band_.cells));
      band_.cells.push_back(static_cast<std::int64_t>(cell));
      band_.corner_counts.push_back(static_cast<std::int32_t>(corners.size()));
      band_.corners.insert(band_.corners.end(), corners.begin(), corners.end());
      take_arcs(cell, is_at_rim);
    }
    number_vertices();
    return std::move(band_);
  }

 private:
  void take_arcs(std::size_t cell, bool is_at_rim) {
    const std::size_t n_before = band_.arcs.size();
    const std::span<const Vertex> corners = cells_.of(cell);
    for (std::int64_t arc = arc_offsets_[cell]; arc < arc_offsets_[cell + 1]; ++arc) {
      const std::size_t side = sides_[arc];
      const std::size_t next = side + 1 == corners.size() ? 0 : side + 1;
      if (is_at_rim && rings_[corners[side]] == 0 && rings_[corners[next]] == 0) continue;
      band_.arcs.push_back(arc);
    }
    band_.arc_counts.push_back(static_cast<std::int32_t>(band_.arcs.size() - n_before));
  }

  void number_vertices() {
    std::vector<Vertex> numbers(rings_.size(), -1);
    for (const Vertex corner : band_.corners) numbers[corner] = 0;
    for (std::size_t vertex = 0; vertex < numbers.size(); ++vertex) {
      if (numbers[vertex] != 0) continue;
      numbers[vertex] = static_cast<Vertex>(band_.vertices.size());
      band_.vertices.push_back(static_cast<std::int64_t>(vertex));
    }
    for (Vertex& corner : band_.corners) corner = numbers[corner];
  }

  const CellCorners& cells_;
  const std::span<const std::uint8_t> rings_;
  const std::span<const std::int64_t> arc_offsets_;
  const std::span<const std::int32_t> sides_;
  BandOfTile band_;
};

}  // namespace

BandOfTile cut_band(const CellCorners& cells, std::span<const std::uint8_t> rings,
                    std::span<const std::int64_t> arc_offsets,
                    std::span<const std::int32_t> sides) {
  SUPERFACETS_ASSERT(cells.offsets.size() == arc_offsets.size() &&
                     std::ssize(sides) == arc_offsets.back());
  return BandCutter(cells, rings, arc_offsets, sides).cut();
}

}  // namespace superfacets
