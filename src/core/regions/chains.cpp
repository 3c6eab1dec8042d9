#include "regions/chains.hpp"

#include <array>

namespace superfacets {
namespace {

// Minimum gain of a move, as a fraction of the cost of all sides of the cell. A smaller gain may be
// a rounding error, and two opposite moves could then alternate forever.
constexpr double kMinGain = 1e-9;

// A chain ends before a move that would raise the cost, over its initial value, by more than this
// fraction of the cost of the sides of its first cell. Without this limit, compactness on the
// benchmark models would improve by only 0.007, and the run time would be 1.5 times as long.
constexpr double kDeepest = 0.5;

// A cell with more arcs does not move, because each of its neighbors might try to move it.
constexpr std::size_t kMaxArcs = 256;

// Maximum number of neighbors of a cell in its region that are examined. A cell with more neighbors
// in its region does not move.
constexpr int kMaxNeighbors = 16;

class Neighborhood {
 public:
  Neighborhood(const Surface& surface, std::span<const Label> labels, Cell cell)
      : surface_(surface), labels_(labels), cell_(cell) {
    // If a cell has a neighbor of its region across every side, it is not at a border. (It may be
    // at a border if more than two cells share a side. This rare case is ignored.)
    limit_ =
        surface.has_corners() ? std::min(surface.n_sides(cell) - 1, kMaxNeighbors) : kMaxNeighbors;
    for (const Step step : surface.arcs().steps(cell)) {
      if (labels[step.to] == labels[cell]) add(step);
    }
  }

  bool is_joined() const {
    if (n_steps_ == 0 || n_steps_ > limit_) return false;
    // The search starts with the first neighbor, and repeatedly adds neighbors that are joined to a
    // reached neighbor.
    std::array<bool, kMaxNeighbors> is_reached{true};
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

  bool joins_any(int i, const std::array<bool, kMaxNeighbors>& is_reached) const {
    for (int j = 0; j < n_steps_; ++j) {
      if (is_reached[j] && joins(steps_[j], steps_[i])) return true;
    }
    return false;
  }

  bool joins(const Step& first, const Step& second) const {
    if (surface_.has_corners()) return joins_around_corner(first, second);
    return surface_.arcs().leads_to(first.to, second.to);
  }

  // Whether other cells of the region connect two neighbors around the corner between the two sides
  // of the cell.
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
  // Number of neighbors in the region. Duplicates are counted only above limit_.
  int n_steps_ = 0;
  std::array<Step, kMaxNeighbors> steps_{};
};

// Local test of whether a region stays connected and non-empty when a cell leaves it. The test
// succeeds if the cell's neighbors in the region are connected around the corners of the cell (or
// by arcs between neighbors, if the surface has no corners). The test is conservative: it also
// fails if the neighbors are only connected by a longer path, or if the cell has too many
// neighbors. The cell then does not move.
bool stays_connected_without(const Surface& surface, std::span<const Label> labels, Cell cell) {
  const std::span<const Cell> neighbors = surface.arcs().neighbors(cell);
  const auto n_same = std::ranges::count_if(
      neighbors, [&](Cell neighbor) { return labels[neighbor] == labels[cell]; });
  if (n_same <= 1) return n_same == 1;  // this test suffices for most cells at borders
  return Neighborhood(surface, labels, cell).is_joined();
}

}  // namespace

MovingRegions::MovingRegions(const Surface& surface, const BorderCosts& costs,
                             std::span<const Label> first_labels, std::span<const Cell> fixed,
                             ThreadTeam& team)
    : surface_(surface),
      border_costs_(costs),
      first_labels_(first_labels),
      labels_(first_labels.size()),
      marks_(first_labels.size()),
      travels_(first_labels.size()),
      costs_(surface.arcs().n_arcs()) {
  const auto n_cells = static_cast<std::int64_t>(first_labels.size());
  team.for_each_block(n_cells, [&](std::int64_t begin, std::int64_t end) {
    std::copy(first_labels.begin() + begin, first_labels.begin() + end, labels_.begin() + begin);
    std::fill(marks_.begin() + begin, marks_.begin() + end, 0);
  });
  for (const Cell cell : fixed) marks_[cell] = kFixed;
}

void MovingRegions::prefetch_arcs(Cell cell) const {
  const std::int64_t arc = arcs().offsets[cell];
  prefetch(arcs().targets.data() + arc);  // prefetching an address beyond the array is harmless
  prefetch(border_costs_.lengths.data() + arc);
  prefetch(costs_.data() + arc);
  surface_.prefetch_cell(cell, arc);
}

bool MovingRegions::may_leave(Cell cell) const {
  if ((marks_[cell] & kFixed) != 0 || arcs().neighbors(cell).size() > kMaxArcs) return false;
  return stays_connected_without(surface_, labels_.span(), cell);
}

std::span<const float> MovingRegions::costs_of(Cell cell) {
  const std::int64_t begin = arcs().offsets[cell];
  const std::span<float> costs = costs_.span().subspan(begin, arcs().offsets[cell + 1] - begin);
  if ((marks_[cell] & kHasCosts) == 0) {
    border_costs_.write(surface_, cell, begin, costs);
    marks_[cell] |= kHasCosts;
  }
  return costs;
}

double MovingRegions::gain_of(Cell cell, Label from, Label to) {
  const std::span<const float> costs = costs_of(cell);
  const std::span<const Cell> neighbors = arcs().neighbors(cell);
  double gain = 0.0;
  for (std::size_t i = 0; i < costs.size(); ++i) {
    const Label label = labels_[neighbors[i]];
    // Computed without branches, because the label is unpredictable.
    gain += double{costs[i]} * (static_cast<int>(label == to) - static_cast<int>(label == from));
  }
  return gain;
}

double MovingRegions::cost_of_sides(Cell cell) {
  double sum = 0.0;
  for (const float cost : costs_of(cell)) sum += cost;
  return sum;
}

double MovingRegions::travel_to(Cell cell, Label to) const {
  if (first_labels_[cell] == to) return 0.0;
  double shortest = std::numeric_limits<double>::infinity();
  for (const auto [arc, neighbor] : arcs().steps(cell)) {
    if (labels_[neighbor] != to) continue;
    const double step = border_costs_.length(arc);
    // at the initial border, the cell is half a step away from the border
    const bool is_at_border = first_labels_[neighbor] == to;
    shortest = std::min(shortest, is_at_border ? 0.5 * step : step + travels_[neighbor]);
  }
  return shortest;
}

std::span<const Cell> ChainMover::try_moves(Cell cell) {
  chain_.clear();
  // Every chain begins with this cell, so may_leave is called once, before the loop over regions.
  // Otherwise these calls would dominate the run time where hundreds of cells are mutual neighbors.
  if (!regions_.may_leave(cell)) return {};
  const double cost = regions_.cost_of_sides(cell);
  const Label from = regions_.label(cell);
  Label tried = from;
  for (const Cell neighbor : regions_.arcs().neighbors(cell)) {
    const Label to = regions_.label(neighbor);
    if (to == from || to == tried) continue;
    if (move_chain(cell, to, cost)) return chain_;
    tried = to;
  }
  return {};
}

// Repeatedly moves the best candidate adjacent to the cells moved before, then undoes all moves
// after the state with the lowest cost. A single move may increase the cost, so that a border can
// cross a row of triangles (like the swaps of Kernighan and Lin 1970). Every move keeps regions
// connected. Returns whether any cell has moved.
bool ChainMover::move_chain(Cell first, Label to, double cost) {
  const Label from = regions_.label(first);
  const std::size_t best_size = grow_chain(first, from, to, cost);
  for (std::size_t i = best_size; i < chain_.size(); ++i) {
    regions_.move(chain_[i], from, travels_before_[i]);
  }
  chain_.resize(best_size);
  return best_size > 0;
}

// Moves the cells of a chain. Returns the number n of moves after which the cost is lowest, or 0 if
// no state has a lower cost than the initial state. Records the area changes of the first n moves.
std::size_t ChainMover::grow_chain(Cell first, Label from, Label to, double cost) {
  double gain = 0.0;
  double area = 0.0;
  double best_gain = kMinGain * cost;
  double best_area = 0.0;
  std::size_t best_size = 0;
  chain_.clear();
  travels_before_.clear();
  candidates_.assign({candidate(first, from, to)});
  while (chain_.size() < options_.max_chain) {
    const StiffGain stiff = stiff_gain(from, to);
    const Candidate next = take_candidate(from, to, stiff, -kDeepest * cost - gain);
    if (next.cell == kNoCell) break;
    gain += next.gain + stiff.of(next.stiff);
    area += next.stiff.area;
    chain_.push_back(next.cell);
    travels_before_.push_back(regions_.travel(next.cell));
    regions_.move(next.cell, to, next.travel);
    change_areas(from, to, next.stiff.area);
    if (gain > best_gain) {
      best_gain = gain;
      best_area = area;
      best_size = chain_.size();
    }
    add_candidates(next.cell, from, to);
  }
  change_areas(from, to, best_area - area);
  return best_size;
}

ChainMover::Candidate ChainMover::candidate(Cell cell, Label from, Label to) {
  const StiffCell stiff = stiffness_.is_off() ? StiffCell{} : stiffness_.cell(cell, from, to);
  return {cell, regions_.gain_of(cell, from, to), stiff, 0.0F};
}

// Removes and returns the candidate with the largest gain that may move. The cell is kNoCell if no
// candidate with a gain of at least least_gain may move.
ChainMover::Candidate ChainMover::take_candidate(Label from, Label to, StiffGain stiff,
                                                 double least_gain) {
  const auto gain_of = [&](const Candidate& of) { return of.gain + stiff.of(of.stiff); };
  while (!candidates_.empty()) {
    auto best = candidates_.begin();
    double best_gain = gain_of(*best);
    for (auto other = best + 1; other != candidates_.end(); ++other) {
      const double gain = gain_of(*other);
      if (gain < best_gain || (gain == best_gain && other->cell > best->cell)) continue;
      best = other;
      best_gain = gain;
    }
    if (best_gain < least_gain) break;
    Candidate taken = *best;
    *best = candidates_.back();
    candidates_.pop_back();
    const double travel = regions_.travel_to(taken.cell, to);
    taken.travel = static_cast<float>(travel);
    if (travel > options_.max_distance || would_join_patches(taken.cell, from, to)) continue;
    // The first cell of a chain has already been tested by try_moves.
    if (chain_.empty() || regions_.may_leave(taken.cell)) return taken;
  }
  return {};
}

// Adds or updates the candidates adjacent to a cell that has just moved. The move has increased
// their gain.
void ChainMover::add_candidates(Cell moved, Label from, Label to) {
  for (const Cell cell : regions_.arcs().neighbors(moved)) {
    if (regions_.label(cell) != from || regions_.arcs().neighbors(cell).size() > kMaxArcs) continue;
    const auto known = std::ranges::find_if(
        candidates_, [&](const Candidate& other) { return other.cell == cell; });
    if (known == candidates_.end()) {
      candidates_.push_back(candidate(cell, from, to));
    } else {
      known->gain = regions_.gain_of(cell, from, to);
    }
  }
}

StiffGain ChainMover::stiff_gain(Label from, Label to) const {
  return stiffness_.is_off() ? StiffGain{} : stiffness_.gain(from, to, changes_);
}

void ChainMover::change_areas(Label from, Label to, double area) {
  if (stiffness_.is_off()) return;
  changes_[from] -= area;
  changes_[to] += area;
  changed_.push_back(from);
  changed_.push_back(to);
}

std::vector<AreaChange> ChainMover::take_changes() {
  std::vector<AreaChange> taken;
  for (const Label region : changed_) {
    if (const double change = std::exchange(changes_[region], 0.0); change != 0.0) {
      taken.push_back({region, change});
    }
  }
  changed_.clear();
  return taken;
}

// Whether adding a cell to a region would make its patch touch another patch of the same color.
bool ChainMover::would_join_patches(Cell cell, Label from, Label to) const {
  const Patch patch = patches_.of_region[to];
  const std::span<const Cell> neighbors = regions_.arcs().neighbors(cell);
  return std::ranges::any_of(neighbors, [&](Cell neighbor) {
    const Label label = regions_.label(neighbor);
    if (label == from || label == to) return false;
    const Patch other = patches_.of_region[label];
    return other != patch && patches_.colors[other] == patches_.colors[patch];
  });
}

}  // namespace superfacets
