#include "regions/smooth.hpp"

#include <algorithm>
#include <limits>
#include <mutex>
#include <utility>

#include "base/assert.hpp"
#include "base/threads.hpp"
#include "regions/local_connectivity.hpp"

namespace superfacets {
namespace {

// The least gain of a move, as a fraction of the cost of all sides of the cell. A smaller gain may
// be a rounding error, and two moves that undo each other would alternate forever.
constexpr double kLeastGain = 1e-9;

constexpr float kNotYetKnown = -1.0F;

// A chain ends when its loss exceeds this fraction of the cost of the sides of its first cell.
// Without the limit compactness would be lower (better) by 0.007 on the benchmark models, at 1.5
// times the run time.
constexpr double kDeepest = 0.5;

// A candidate for the next move of a chain.
struct Candidate {
  Cell cell = kNoCell;
  double gain = 0.0;
  float travel = 0.0F;  // computed when it is examined
};

struct Move {
  Cell cell;
  float travel_before;
};

class Smoother {
 public:
  Smoother(const Surface& surface, const BorderCost& cost, std::span<const Label> first_labels,
           std::span<const Cell> fixed, const SmoothOptions& options, ThreadTeam& team)
      : surface_(surface),
        border_cost_(cost),
        first_labels_(first_labels),
        options_(options),
        labels_(first_labels.size()),
        travels_(first_labels.size()),
        is_waiting_(first_labels.size()),
        is_fixed_(first_labels.size()),
        costs_(surface.arcs().n_arcs()) {
    const auto n_cells = static_cast<std::int64_t>(first_labels.size());
    team.for_each_block(n_cells, [&](std::int64_t begin, std::int64_t end) {
      std::copy(first_labels.begin() + begin, first_labels.begin() + end, labels_.begin() + begin);
      std::fill(travels_.begin() + begin, travels_.begin() + end, 0.0F);
      std::fill(is_waiting_.begin() + begin, is_waiting_.begin() + end, 0);
      std::fill(is_fixed_.begin() + begin, is_fixed_.begin() + end, 0);
    });
    team.fill(costs_.span(), kNotYetKnown);
    for (const Cell cell : fixed) is_fixed_[cell] = 1;
  }

  Buffer<Label> run(ThreadTeam& team) {
    std::vector<Cell> waiting = border_cells(team);
    for (int sweep = 0; sweep < options_.max_sweeps && !waiting.empty(); ++sweep) {
      for (const Cell cell : waiting) is_waiting_[cell] = 0;
      next_.clear();
      for (const Cell cell : waiting) try_moves(cell);
      std::sort(next_.begin(), next_.end());
      waiting.swap(next_);
    }
    return std::move(labels_);
  }

 private:
  std::vector<Cell> border_cells(ThreadTeam& team) const {
    std::vector<Cell> found;
    std::mutex mutex;
    const auto n_cells = static_cast<std::int64_t>(labels_.size());
    team.for_each_block(n_cells, [&](std::int64_t begin, std::int64_t end) {
      std::vector<Cell> part;
      for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) {
        if (is_at_border(cell)) part.push_back(cell);
      }
      const std::scoped_lock lock(mutex);
      found.insert(found.end(), part.begin(), part.end());
    });
    std::sort(found.begin(), found.end());
    return found;
  }

  bool is_at_border(Cell cell) const {
    for (const Cell neighbor : surface_.arcs().neighbors(cell)) {
      if (labels_[neighbor] != labels_[cell]) return true;
    }
    return false;
  }

  // Tries chains that begin with a cell, one for each neighboring region, and keeps the first that
  // makes borders cheaper.
  void try_moves(Cell cell) {
    // Every chain begins by moving this cell, so that is tested once. To test it for each of the
    // regions would take most of the time where hundreds of cells are neighbors of each other.
    if (!may_leave(cell)) return;
    const Label from = labels_[cell];
    Label tried = from;
    for (const Cell neighbor : surface_.arcs().neighbors(cell)) {
      const Label to = labels_[neighbor];
      if (to == from || to == tried) continue;
      if (move_chain(cell, to)) return;
      tried = to;
    }
  }

  // Moves one cell at a time, each the best candidate next to those moved, and undoes the moves
  // after the best state. Single moves may lose, which lets a border cross a row of triangles
  // (Kernighan and Lin 1970 do so with pairs). Each move keeps regions connected, so every state
  // is. Returns whether a cell has moved.
  bool move_chain(Cell first, Label to) {
    const Label from = labels_[first];
    const std::size_t best_size = grow_chain(first, from, to);
    for (std::size_t i = best_size; i < chain_.size(); ++i) {
      labels_[chain_[i].cell] = from;
      travels_[chain_[i].cell] = chain_[i].travel_before;
    }
    for (std::size_t i = 0; i < best_size; ++i) look_again_around(chain_[i].cell);
    return best_size > 0;
  }

  // Returns the number of moves after which borders are cheapest; 0 if no state is cheaper.
  std::size_t grow_chain(Cell first, Label from, Label to) {
    const double cost = cost_of_sides(first);
    double gain = 0.0;
    double best_gain = kLeastGain * cost;
    std::size_t best_size = 0;
    chain_.clear();
    candidates_.assign({{first, gain_of(first, from, to), 0.0F}});
    while (chain_.size() < options_.max_chain) {
      const Candidate next = take_candidate(to, -kDeepest * cost - gain);
      if (next.cell == kNoCell) break;
      gain += next.gain;
      chain_.push_back({next.cell, travels_[next.cell]});
      travels_[next.cell] = next.travel;
      labels_[next.cell] = to;
      if (gain > best_gain) {
        best_gain = gain;
        best_size = chain_.size();
      }
      add_candidates(next.cell, from, to);
    }
    return best_size;
  }

  // Removes and returns the best candidate that may move; kNoCell if no gain is large enough.
  Candidate take_candidate(Label to, double least_gain) {
    while (!candidates_.empty()) {
      const auto best = std::max_element(
          candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
            return std::pair(a.gain, b.cell) < std::pair(b.gain, a.cell);
          });
      Candidate taken = *best;
      if (taken.gain < least_gain) break;
      *best = candidates_.back();
      candidates_.pop_back();
      const double travel = travel_of(taken.cell, to);
      taken.travel = static_cast<float>(travel);
      if (travel <= options_.max_distance && may_leave(taken.cell)) return taken;
    }
    return {};
  }

  // Updates the neighbors of a cell that has just moved, whose gain is larger now.
  void add_candidates(Cell moved, Label from, Label to) {
    for (const Cell cell : surface_.arcs().neighbors(moved)) {
      if (labels_[cell] != from) continue;
      const Candidate candidate{cell, gain_of(cell, from, to), 0.0F};
      const auto known = std::find_if(candidates_.begin(), candidates_.end(),
                                      [&](const Candidate& other) { return other.cell == cell; });
      if (known == candidates_.end()) {
        candidates_.push_back(candidate);
      } else {
        *known = candidate;
      }
    }
  }

  // By how much a move of a cell reduces the cost of borders.
  double gain_of(Cell cell, Label from, Label to) {
    double gain = 0.0;
    for (const auto [arc, neighbor] : surface_.arcs().steps(cell)) {
      const Label label = labels_[neighbor];
      if (label == to) gain += cost_of(cell, arc);
      if (label == from) gain -= cost_of(cell, arc);
    }
    return gain;
  }

  double cost_of_sides(Cell cell) {
    double sum = 0.0;
    for (const auto [arc, neighbor] : surface_.arcs().steps(cell)) {
      sum += cost_of(cell, arc);
    }
    return sum;
  }

  // Costs are computed on first use, because few arcs are near a border.
  double cost_of(Cell cell, std::int64_t arc) {
    float& cost = costs_[arc];
    if (cost == kNotYetKnown) {
      cost = static_cast<float>(border_cost_(surface_, cell, arc));
    }
    return cost;
  }

  bool may_leave(Cell cell) const {
    return !is_fixed_[cell] && stays_connected_without(surface_, labels_.span(), cell);
  }

  // The distance that a cell would have from the first border of a region, on a path along cells
  // that have moved to the region.
  double travel_of(Cell cell, Label to) const {
    if (first_labels_[cell] == to) return 0.0;
    double shortest = std::numeric_limits<double>::infinity();
    for (const auto [arc, neighbor] : surface_.arcs().steps(cell)) {
      if (labels_[neighbor] != to) continue;
      const double step = border_cost_.weights[arc] * border_cost_.weight_unit;
      const bool is_at_border = first_labels_[neighbor] == to;  // the border is half way
      shortest = std::min(shortest, is_at_border ? 0.5 * step : step + travels_[neighbor]);
    }
    return shortest;
  }

  void look_again_around(Cell cell) {
    look_again_at(cell);
    for (const Cell neighbor : surface_.arcs().neighbors(cell)) {
      look_again_at(neighbor);
    }
  }

  void look_again_at(Cell cell) {
    if (is_waiting_[cell]) return;
    is_waiting_[cell] = 1;
    next_.push_back(cell);
  }

  const Surface& surface_;
  const BorderCost border_cost_;
  const std::span<const Label> first_labels_;
  const SmoothOptions options_;
  Buffer<Label> labels_;
  Buffer<float> travels_;            // travel_of, of cells not in their first region
  Buffer<std::uint8_t> is_waiting_;  // for the next sweep
  Buffer<std::uint8_t> is_fixed_;
  Buffer<float> costs_;      // of arcs, kNotYetKnown at first
  std::vector<Cell> next_;   // cells to examine in the next sweep
  std::vector<Move> chain_;  // moves in this order, with the travel before each
  std::vector<Candidate> candidates_;
};

}  // namespace

Buffer<Label> smooth_borders(const Surface& surface, const BorderCost& cost,
                             std::span<const Label> labels, std::span<const Cell> fixed,
                             const SmoothOptions& options, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  SUPERFACETS_ASSERT(std::ssize(cost.weights) == surface.arcs().n_arcs() &&
                     cost.crease_scale > 0.0);
  SUPERFACETS_ASSERT(all_below(fixed, surface.n_cells()) && options.max_distance >= 0.0);
  return Smoother(surface, cost, labels, fixed, options, team).run(team);
}

}  // namespace superfacets
