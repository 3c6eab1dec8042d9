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

// Of what a cell's sides cost together, the part that a move must win: less may be rounding, and
// two moves that undo each other would go on for ever.
constexpr double kLeastGain = 1e-9;

constexpr float kNotYetKnown = -1.0F;

// A chain is given up when it has lost this part of what the sides of its first cell cost. Without
// the limit compactness would be 0.007 less on the benchmark models, and time half as much again.
constexpr double kDeepest = 0.5;

// A cell that may be next in a chain.
struct Candidate {
  Cell cell = kNoCell;
  double gain = 0.0;
  float travel = 0.0F;  // known when it is its turn
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

  // Moves a cell, and what is won by moving it as well, to the first neighboring region where that
  // pays.
  void try_moves(Cell cell) {
    // A chain begins with this cell, whatever region it is for. Where hundreds of cells are
    // neighbors of each other, to find out for each of their regions would take most of all time.
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

  // Moves cells one after the other, each the best that is next to those moved, and takes back what
  // comes after the best state. That a step on the way may lose is what gets a border over a row of
  // triangles (Kernighan and Lin 1970 do so with pairs); as each step keeps regions connected, so
  // does every state. Returns whether something has moved.
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

  // Returns how many of the moves of the chain make borders cheapest; 0 if none do.
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

  // The best candidate that may move, out of the list; kNoCell if none wins as much as it has to.
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

  // Neighbors of a cell that has just moved: what they win is now more than it was.
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

  // How much cheaper borders get if a cell moves.
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

  // Costs are found when first asked for: few arcs are near a border.
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

  // How far a cell would be from the border that a region had at first, on a path along cells that
  // have moved to it.
  double travel_of(Cell cell, Label to) const {
    if (first_labels_[cell] == to) return 0.0;
    double shortest = std::numeric_limits<double>::infinity();
    for (const auto [arc, neighbor] : surface_.arcs().steps(cell)) {
      if (labels_[neighbor] != to) continue;
      const double step = border_cost_.weights[arc] * border_cost_.weight_unit;
      const bool is_at_border = first_labels_[neighbor] == to;  // which is half way
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
  Buffer<float> travels_;            // of cells that are not in their first region: travel_of
  Buffer<std::uint8_t> is_waiting_;  // for the next sweep
  Buffer<std::uint8_t> is_fixed_;
  Buffer<float> costs_;      // of arcs, kNotYetKnown at first
  std::vector<Cell> next_;   // cells to look at in the next sweep
  std::vector<Move> chain_;  // moved, in this order, and their travel before
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
