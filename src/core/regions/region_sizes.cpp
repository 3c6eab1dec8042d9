#include "regions/region_sizes.hpp"

#include "regions/chains.hpp"

namespace superfacets {
namespace {

// Tolerance for comparing sizes, as a fraction of the mean size of a region. The tolerance is
// larger than rounding errors.
constexpr double kRounding = 1e-9;

// Maximum number of stuck paths of all regions, divided by the number of regions. A path is stuck
// if cells cannot be moved up to its end, so that the excess is only moved to another region. After
// this number of stuck paths, the next LeaveTest is used, and counting restarts.
constexpr std::int64_t kMaxStuck = 4;

// Tests of whether a cell may leave its region, from the strictest to the least strict.
enum class LeaveTest : std::uint8_t { kLocal, kExact, kNone };

template <typename T>
bool contains(const std::vector<T>& list, const T& value) {
  return std::ranges::find(list, value) != list.end();
}

// The cells of each region, and the test of whether a cell may leave its region.
class Members {
 public:
  Members(MovingRegions& regions, std::size_t n_regions)
      : regions_(regions),
        lists_(n_regions),
        slots_(regions.labels().size()),
        seen_(regions.labels().size(), 0) {
    for (Cell cell = 0; std::cmp_less(cell, slots_.size()); ++cell) add(cell);
  }

  LeaveTest test() const { return test_; }
  void set_test(LeaveTest test) { test_ = test; }
  const std::vector<Cell>& of(Label region) const { return lists_[region]; }

  void move(Cell cell, Label to) {
    std::vector<Cell>& list = lists_[regions_.label(cell)];
    list[slots_[cell]] = list.back();
    slots_[list.back()] = slots_[cell];
    list.pop_back();
    regions_.move(cell, to, 0.0F);
    add(cell);
  }

  bool may_leave(Cell cell) {
    if (lists_[regions_.label(cell)].size() < 2) return false;
    if (test_ == LeaveTest::kNone || regions_.may_leave(cell)) return true;
    return test_ == LeaveTest::kExact && are_joined_without(cell);
  }

 private:
  void add(Cell cell) {
    std::vector<Cell>& list = lists_[regions_.label(cell)];
    slots_[cell] = list.size();
    list.push_back(cell);
  }

  // Exact test: whether the neighbors of a cell in its region are connected within the region
  // without the cell. Returns false if there is no such neighbor.
  bool are_joined_without(Cell cell) {
    const Label label = regions_.label(cell);
    std::size_t n_missing = 0;
    ++stamp_;
    front_.clear();
    for (const Cell near : regions_.arcs().neighbors(cell)) {
      if (near == cell || regions_.label(near) != label || seen_[near] == stamp_) continue;
      seen_[near] = stamp_;  // the mark is replaced when the search reaches the cell
      if (front_.empty()) {
        front_.push_back(near);
      } else {
        ++n_missing;
      }
    }
    return !front_.empty() && reaches(cell, label, n_missing);
  }

  // Breadth-first search in a region from the cells in front_. Returns whether the search reaches
  // n_missing cells whose seen_ equals the current stamp. Reached cells get the next stamp.
  bool reaches(Cell without, Label label, std::size_t n_missing) {
    const std::int64_t wanted = stamp_++;
    seen_[without] = seen_[front_.front()] = stamp_;
    for (std::size_t i = 0; i < front_.size() && n_missing > 0; ++i) {
      for (const Cell near : regions_.arcs().neighbors(front_[i])) {
        if (regions_.label(near) != label || seen_[near] == stamp_) continue;
        if (seen_[near] == wanted) --n_missing;
        seen_[near] = stamp_;
        front_.push_back(near);
      }
    }
    return n_missing == 0;
  }

  MovingRegions& regions_;
  LeaveTest test_ = LeaveTest::kLocal;
  std::vector<std::vector<Cell>> lists_;
  std::vector<std::size_t> slots_;  // (N,) index of each cell in the list of its region
  std::vector<std::int64_t> seen_;  // (N,) stamp of the last search that reached each cell
  std::int64_t stamp_ = 0;
  std::vector<Cell> front_;
};

// Regions from which searches have failed since the last move of a cell or change of the test.
// Further searches would reach the same regions, and fail. Without this set, time would grow with
// the square of the number of regions.
class DeadEnds {
 public:
  explicit DeadEnds(std::size_t n_regions) : is_dead_(n_regions) {}

  bool has(Label region) const { return is_dead_[region] != 0; }
  void add(std::span<const Label> regions) {
    for (const Label region : regions) is_dead_[region] = 1;
    regions_.insert(regions_.end(), regions.begin(), regions.end());
  }
  void clear() {
    for (const Label region : regions_) is_dead_[region] = 0;
    regions_.clear();
  }

 private:
  std::vector<std::uint8_t> is_dead_;
  std::vector<Label> regions_;
};

class CellTransfer {
 public:
  CellTransfer(MovingRegions& regions, const SizeBounds& bounds)
      : regions_(regions),
        bounds_(bounds),
        members_(regions, bounds.lows.size()),
        totals_(bounds.lows.size(), 0.0),
        exits_(totals_.size()),
        parents_(totals_.size(), kNoLabel),
        sinks_(totals_.size()),
        sources_(totals_.size()) {
    for (std::size_t cell = 0; cell < bounds.sizes.size(); ++cell) {
      totals_[regions.label(static_cast<Cell>(cell))] += bounds.sizes[cell];
    }
    const double sum = std::accumulate(totals_.begin(), totals_.end(), 0.0);
    rounding_ = kRounding * sum / static_cast<double>(totals_.size());
    step_ = sum / static_cast<double>(bounds.sizes.size()) - rounding_;
  }

  void run() {
    for (const LeaveTest test : {LeaveTest::kLocal, LeaveTest::kExact, LeaveTest::kNone}) {
      if (test == LeaveTest::kNone && !bounds_.may_split) return;
      members_.set_test(test);
      for (Exits& exits : exits_) exits.are_known = false;
      forget_dead_ends();
      n_stuck_ = 0;
      while (sweep()) {
      }
    }
  }

 private:
  struct Exits {
    std::vector<Label> to;  // regions to which some cell of the region may move
    bool are_known = false;
  };

  // Tries to bring each region within its bounds. Returns whether any cell has moved and another
  // sweep may succeed.
  bool sweep() {
    bool has_moved = false;
    for (Label region = 0; std::cmp_less(region, totals_.size()); ++region) {
      blocked_.clear();
      while (excess(region) > rounding_ && may_go_on() && drain(region)) has_moved = true;
      blocked_.clear();
      while (lack(region) > rounding_ && may_go_on() && fill(region)) has_moved = true;
    }
    return has_moved && may_go_on();
  }

  void forget_dead_ends() {
    sinks_.clear();
    sources_.clear();
  }

  bool may_go_on() const { return n_stuck_ < kMaxStuck * std::ssize(totals_); }
  double excess(Label region) const { return totals_[region] - bounds_.highs[region]; }
  double lack(Label region) const { return bounds_.lows[region] - totals_[region]; }

  // drain() moves cells out of a region that is above its upper bound. fill() moves cells into a
  // region that is below its lower bound. Both functions return whether any cell has moved.
  bool drain(Label region) {
    const auto has_room = [&](Label other) { return -excess(other) >= step_; };
    const auto next_of = [&](Label at, const auto& take) {
      for (const Label to : exits(at)) {
        if (!is_blocked({at, to})) take(to);
      }
    };
    const auto push_on = [&](std::vector<Label> path) {
      std::ranges::reverse(path);
      return push(path, std::min(excess(region), -excess(path.back())));
    };
    return push_over_paths(region, sinks_, has_room, next_of, push_on);
  }

  bool fill(Label region) {
    const auto can_spare = [&](Label other) { return -lack(other) >= step_; };
    const auto next_of = [&](Label at, const auto& take) {
      for (const Label from : neighbors(at)) {
        if (std::ranges::binary_search(exits(from), at) && !is_blocked({from, at})) take(from);
      }
    };
    const auto push_on = [&](const std::vector<Label>& path) {
      return push(path, std::min(lack(region), -lack(path.front())));
    };
    return push_over_paths(region, sources_, can_spare, next_of, push_on);
  }

  // Tries paths between a region and the regions for which is_wanted is true, in ascending order of
  // length, until a cell moves. push_on(path) moves cells along a path that ends at the region.
  template <typename IsWanted, typename NextOf, typename PushOn>
  bool push_over_paths(Label region, DeadEnds& dead_ends, const IsWanted& is_wanted,
                       const NextOf& next_of, const PushOn& push_on) {
    while (may_go_on()) {
      const Label end = search(region, dead_ends, is_wanted, next_of);
      if (end == kNoLabel) return false;
      std::vector<Label> path{end};
      while (path.back() != region) path.push_back(parents_[path.back()]);
      if (push_on(path)) return true;
    }
    return false;
  }

  using Leg = std::pair<Label, Label>;

  bool is_blocked(const Leg& leg) const { return contains(blocked_, leg); }

  // Breadth-first search over regions. Returns the first region for which is_wanted is true, or
  // kNoLabel. The path to this region is stored in parents_.
  template <typename IsWanted, typename ForEachNext>
  Label search(Label first, DeadEnds& dead_ends, const IsWanted& is_wanted,
               const ForEachNext& for_each_next) {
    if (dead_ends.has(first)) return kNoLabel;
    for (const Label visited : queue_) parents_[visited] = kNoLabel;
    parents_[first] = first;
    queue_.assign({first});
    Label found = kNoLabel;
    for (std::size_t i = 0; i < queue_.size() && found == kNoLabel; ++i) {
      const Label at = queue_[i];
      for_each_next(at, [&](Label next) {
        if (found != kNoLabel || parents_[next] != kNoLabel || dead_ends.has(next)) return;
        parents_[next] = at;
        queue_.push_back(next);
        if (is_wanted(next)) found = next;
      });
    }
    if (found == kNoLabel && blocked_.empty()) dead_ends.add(queue_);
    return found;
  }

  // Moves cells from each region of a path to the next region. Returns whether any cell has moved.
  bool push(const std::vector<Label>& path, double amount) {
    const double room = std::max(-excess(path.back()), 0.0);
    for (std::size_t i = 0; i + 1 < path.size(); ++i) {
      const bool is_last = i + 2 == path.size();
      const double most = is_last ? room : std::numeric_limits<double>::infinity();
      amount = move_between(path[i], path[i + 1], amount, most);
      if (amount > 0.0) continue;
      ++n_stuck_;
      blocked_.emplace_back(path[i], path[i + 1]);
      return i > 0;
    }
    blocked_.clear();
    return true;
  }

  // Moves cells from one region to another, until their total size is at least `amount` or no cell
  // can move. The total size is at most `most`. Returns the total size.
  double move_between(Label from, Label to, double amount, double most) {
    candidates_.clear();
    for (const Cell cell : members_.of(from)) add_candidate(cell, to);
    double moved = 0.0;
    while (moved < amount - rounding_) {
      const Cell cell = take_candidate(from, to, most - moved);
      if (cell == kNoCell) break;
      const double size = bounds_.sizes[cell];
      members_.move(cell, to);
      totals_[from] -= size;
      totals_[to] += size;
      moved += size;
      forget_dead_ends();
      for (const Cell near : regions_.arcs().neighbors(cell)) {
        exits_[regions_.label(near)].are_known = false;
        if (regions_.label(near) == from) add_candidate(near, to);
      }
      exits_[from].are_known = exits_[to].are_known = false;
    }
    return moved;
  }

  void add_candidate(Cell cell, Label to) {
    if (touches(cell, to) && !contains(candidates_, cell)) candidates_.push_back(cell);
  }

  // Whether a cell may leave its region after the region has gained another cell. With
  // LeaveTest::kNone, even the only cell of a region may then leave.
  bool may_pass(Cell cell) {
    return members_.test() == LeaveTest::kNone || members_.may_leave(cell);
  }

  bool touches(Cell cell, Label region) const {
    const std::span<const Cell> near = regions_.arcs().neighbors(cell);
    return std::ranges::any_of(near, [&](Cell other) { return regions_.label(other) == region; });
  }

  // Removes and returns the candidate with the largest gain among the candidates that may leave and
  // have a size of at most `most`. Returns kNoCell if there is no such candidate.
  Cell take_candidate(Label from, Label to, double most) {
    ranked_.clear();
    for (const Cell cell : candidates_)
      ranked_.emplace_back(-regions_.gain_of(cell, from, to), cell);
    std::ranges::sort(ranked_);
    for (const auto& [loss, cell] : ranked_) {
      const double size = bounds_.sizes[cell];
      if (size > most + rounding_ || size > -lack(from) + rounding_) continue;
      if (!members_.may_leave(cell)) continue;
      std::erase(candidates_, cell);
      return cell;
    }
    return kNoCell;
  }

  // The regions to which a cell of this region may move, ascending.
  const std::vector<Label>& exits(Label region) {
    Exits& exits = exits_[region];
    if (exits.are_known) return exits.to;
    exits.to.clear();
    exits.are_known = true;
    for (const Cell cell : members_.of(region)) {
      const std::size_t n_before = exits.to.size();
      add_regions_around(cell, exits.to);
      if (exits.to.size() > n_before && !may_pass(cell)) exits.to.resize(n_before);
    }
    std::ranges::sort(exits.to);
    return exits.to;
  }

  // The regions adjacent to a region, ascending.
  std::vector<Label> neighbors(Label region) const {
    std::vector<Label> found;
    for (const Cell cell : members_.of(region)) add_regions_around(cell, found);
    std::ranges::sort(found);
    return found;
  }

  // Appends the regions adjacent to a cell, except those that are in the list already.
  void add_regions_around(Cell cell, std::vector<Label>& found) const {
    for (const Cell near : regions_.arcs().neighbors(cell)) {
      const Label label = regions_.label(near);
      if (label != regions_.label(cell) && !contains(found, label)) found.push_back(label);
    }
  }

  MovingRegions& regions_;
  const SizeBounds& bounds_;
  Members members_;
  std::vector<double> totals_;  // (K,) size of each region
  std::vector<Exits> exits_;    // (K,) cached exits of each region
  // (K,) predecessor of each region in the last search; kNoLabel if not reached
  std::vector<Label> parents_;
  std::vector<Label> queue_;  // regions in the order in which the last search reached them
  DeadEnds sinks_;            // regions without a path to a region with room
  DeadEnds sources_;          // regions without a path from a region with cells to spare
  // pairs of regions between which no cell could move since the last successful path
  std::vector<Leg> blocked_;
  std::vector<Cell> candidates_;
  std::vector<std::pair<double, Cell>> ranked_;
  std::int64_t n_stuck_ = 0;
  double rounding_ = 0.0;
  // mean size of a cell; a region at the end of a path must have room for this size
  double step_ = 0.0;
};

}  // namespace

Buffer<Label> move_cells(const Surface& surface, const BorderCosts& costs,
                         std::span<const Label> labels, const SizeBounds& bounds,
                         ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  SUPERFACETS_ASSERT(bounds.sizes.size() == labels.size());
  SUPERFACETS_ASSERT(bounds.lows.size() == bounds.highs.size());
  SUPERFACETS_ASSERT(all_below(labels, bounds.lows.size()));
  MovingRegions regions(surface, costs, labels, {}, team);
  CellTransfer(regions, bounds).run();
  return std::move(regions).take_labels();
}

}  // namespace superfacets
