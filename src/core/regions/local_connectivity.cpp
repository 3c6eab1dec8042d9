#include "regions/local_connectivity.hpp"

#include <algorithm>
#include <array>

namespace superfacets {
namespace {

// Most neighbors in the region that are examined; a cell with more is not moved.
constexpr int kMostNeighbors = 16;

class Neighborhood {
 public:
  Neighborhood(const Surface& surface, std::span<const Label> labels, Cell cell)
      : surface_(surface), labels_(labels), cell_(cell) {
    // A cell whose neighbors across all sides are in the region is not at a border, unless several
    // cells meet at one of its sides, which is too rare to examine.
    limit_ = surface.has_corners() ? std::min(surface.n_sides(cell) - 1, kMostNeighbors)
                                   : kMostNeighbors;
    for (const Step step : surface.arcs().steps(cell)) {
      if (labels[step.to] == labels[cell]) add(step);
    }
  }

  bool is_joined() const {
    if (n_steps_ == 0 || n_steps_ > limit_) return false;
    // Grows the set of neighbors joined with the first one until it does not change.
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
    return std::ranges::find(neighbors, second.to) != neighbors.end();
  }

  // Whether two neighbors are joined around the corner of their sides, by cells of the region other
  // than this one.
  bool joins_around_corner(const Step& first, const Step& second) const {
    const Corner corner = surface_.corner_between(cell_, surface_.side(cell_, first.arc),
                                                  surface_.side(cell_, second.arc));
    return corner != kNoCorner &&
           surface_.leads_around(corner, cell_, first.to, second.to, labels_);
  }

  const Surface& surface_;
  const std::span<const Label> labels_;
  const Cell cell_;
  int limit_ = 0;
  int n_steps_ = 0;  // to different neighbors in the region, up to the limit
  std::array<Step, kMostNeighbors> steps_{};
};

}  // namespace

bool stays_connected_without(const Surface& surface, std::span<const Label> labels, Cell cell) {
  const std::span<const Cell> neighbors = surface.arcs().neighbors(cell);
  const auto n_same = std::ranges::count_if(
      neighbors, [&](Cell neighbor) { return labels[neighbor] == labels[cell]; });
  if (n_same <= 1) return n_same == 1;  // most cells at borders
  return Neighborhood(surface, labels, cell).is_joined();
}

}  // namespace superfacets
