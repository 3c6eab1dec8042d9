#include "regions/local_connectivity.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace superfacets {
namespace {

// Neighbors in the region that are looked at: a cell with more is left where it is.
constexpr int kMostNeighbors = 16;

// A way around a corner that is longer than this is not looked for: on real meshes 6 faces meet at
// a corner.
constexpr int kLongestFan = 64;

class Neighborhood {
 public:
  Neighborhood(const Surface& surface, std::span<const Label> labels, Cell cell)
      : surface_(surface), labels_(labels), cell_(cell) {
    // With neighbors in the region across all sides a cell is not at a border; where several cells
    // meet at one of its sides, it is not worth the look.
    limit_ = surface.has_corners() ? std::min(surface.n_sides(cell) - 1, kMostNeighbors)
                                   : kMostNeighbors;
    for (const Step step : surface.arcs().steps(cell)) {
      if (labels[step.to] == labels[cell]) add(step);
    }
  }

  bool is_joined() const {
    if (n_steps_ == 0 || n_steps_ > limit_) return false;
    // Grows what is joined with the first neighbor until nothing more is.
    std::array<bool, kMostNeighbors> is_reached{true};
    int n_reached = 1;
    for (bool has_grown = true; has_grown && n_reached < n_steps_;) {
      has_grown = false;
      for (int i = 0; i < n_steps_; ++i) {
        if (is_reached[i] || !joins_any(i, is_reached)) continue;
        is_reached[i] = true;
        ++n_reached;
        has_grown = true;
      }
    }
    return n_reached == n_steps_;
  }

 private:
  void add(const Step& step) {
    for (int i = 0; i < std::min(n_steps_, limit_); ++i) {
      if (steps_[i].to == step.to) return;
    }
    if (n_steps_ < limit_) steps_[n_steps_] = step;
    ++n_steps_;
  }

  bool joins_any(int i, const std::array<bool, kMostNeighbors>& is_reached) const {
    for (int j = 0; j < n_steps_; ++j) {
      if (is_reached[j] && joins(steps_[j], steps_[i])) return true;
    }
    return false;
  }

  bool joins(const Step& first, const Step& second) const {
    if (surface_.has_corners()) return joins_around_corner(first, second);
    const auto neighbors = surface_.arcs().neighbors(first.to);
    return std::find(neighbors.begin(), neighbors.end(), second.to) != neighbors.end();
  }

  // Whether two neighbors are joined by cells of the region, other than this one, around the corner
  // that their sides share. Walks from one to the other; where a border has several ways on, it
  // gives up.
  bool joins_around_corner(const Step& first, const Step& second) const {
    const Corner corner = surface_.corner_between(cell_, surface_.side(cell_, first.arc),
                                                  surface_.side(cell_, second.arc));
    if (corner == kNoCorner) return false;
    Cell before = cell_;
    Cell here = first.to;
    for (int n_steps = 0; here != second.to; ++n_steps) {
      const Cell next =
          n_steps < kLongestFan ? surface_.next_around(corner, before, here) : kNoCell;
      if (next == kNoCell || next == cell_ || labels_[next] != labels_[cell_]) return false;
      before = std::exchange(here, next);
    }
    return true;
  }

  const Surface& surface_;
  const std::span<const Label> labels_;
  const Cell cell_;
  int limit_ = 0;
  int n_steps_ = 0;  // to different neighbors in the region; of more than the limit, not all
  std::array<Step, kMostNeighbors> steps_{};
};

}  // namespace

bool stays_connected_without(const Surface& surface, std::span<const Label> labels, Cell cell) {
  return Neighborhood(surface, labels, cell).is_joined();
}

}  // namespace superfacets
