#include "cells/far_arcs.hpp"

namespace superfacets {
namespace {

// Walks do not pass through cells with more than kMaxArcs arcs, so the number of walks grows
// linearly with the number of cells.
constexpr std::size_t kMaxArcs = 24;

// Number of cells per block. The arcs of a block fit into the second-level cache. Small graphs have
// smaller blocks, so that each thread gets several blocks.
std::int64_t block_size(const OrderedGraph& graph) {
  return graph.n_cells() < (1 << 15) ? 1 << 8 : 1 << 10;
}

// Crease cost of each arc (see OrderedGraph::crease_cost), in the order of graph.arcs. Costs are
// rounded to whole numbers, so that sums do not depend on the order of the terms.
Buffer<float> crease_costs(const OrderedGraph& graph, ThreadTeam& team) {
  Buffer<float> costs(graph.arcs.size());
  team.for_each_slow(graph.n_cells(), [&](Place place) {
    std::size_t next = graph.first_arc(place);
    for (const Arc arc : graph.arcs_of(place)) {
      costs[next++] = static_cast<float>(round_to_whole(graph.crease_cost(place, arc)));
    }
  });
  return costs;
}

// Computes the length of each arc from the squared distance between its cells and its crease cost.
struct AddStraight {
  SUPERFACETS_ALWAYS_INLINE void operator()(const double* squared, const double* costs, double unit,
                                            std::span<float> lengths) const {
    for (std::size_t i = 0; i < lengths.size(); ++i) {
      const double length = std::sqrt(squared[i]) / unit + costs[i];
      lengths[i] = static_cast<float>(std::max(1.0, round_to_whole(length)));
    }
  }
};

// Finds the far arcs of one cell after another. Lists are written without branches, because it is
// unpredictable whether a walk turns back or reaches a new cell.
class ArcFinder {
 public:
  ArcFinder(const OrderedGraph& graph, std::span<const float> costs, int n_steps)
      : graph_(graph), costs_(costs), n_steps_(n_steps), least_(graph.n_cells(), kNone) {}

  // Appends the arcs of the cell at `place` to the list that take() writes. Returns the number of
  // appended arcs.
  std::int64_t find(Place place) {
    n_walks_ = 0;
    const std::size_t first = n_reached_;
    least_[place] = 0.0;
    extend({place, place, 0.0});
    std::size_t begin = 0;
    for (int step = 2; step <= n_steps_; ++step) {
      const std::size_t end = n_walks_;
      for (; begin < end; ++begin) {
        const Walk walk = walks_[begin];
        if (graph_.arcs_of(walk.here).size() <= kMaxArcs) extend(walk);
      }
    }
    least_[place] = kNone;
    const Point position = graph_.positions[place];
    reserve(squared_, n_reached_);
    reserve(sums_, n_reached_);
    for (std::size_t i = first; i < n_reached_; ++i) {
      squared_[i] = squared_norm(graph_.positions[reached_[i]] - position);
      sums_[i] = std::exchange(least_[reached_[i]], kNone);
    }
    return static_cast<std::int64_t>(n_reached_ - first);
  }

  // Writes all arcs found since the last call to the beginning of `taken`, which grows if needed.
  void take(std::vector<Arc>& taken) {
    reserve(taken, n_reached_);
    std::array<float, 512> lengths;
    for (std::size_t first = 0; first < n_reached_; first += lengths.size()) {
      const std::size_t n = std::min(lengths.size(), n_reached_ - first);
      run_version(best_instruction_set(), AddStraight(), squared_.data() + first,
                  sums_.data() + first, graph_.straight_unit, std::span(lengths).first(n));
      for (std::size_t i = 0; i < n; ++i) taken[first + i] = {reached_[first + i], lengths[i]};
    }
    n_reached_ = 0;
  }

 private:
  struct Walk {
    Place before;
    Place here;
    double cost;  // sum of crease costs; exact, because all costs are integers
  };
  static constexpr double kNone = HUGE_VAL;

  template <typename T>
  static void reserve(std::vector<T>& list, std::size_t size) {
    if (list.size() < size) list.resize(2 * size);
  }

  // Extends a walk by each arc that leaves its last cell. A new walk is not stored if the arc leads
  // back to the previous cell, or if it is a padding arc, which leads from a cell to itself.
  void extend(const Walk walk) {
    const ArcList arcs = graph_.arcs_of(walk.here);
    const float* cost = costs_.data() + graph_.first_arc(walk.here);
    reserve(walks_, n_walks_ + arcs.size());
    reserve(reached_, n_reached_ + arcs.size());
    for (const Arc& arc : arcs) {
      const double sum = walk.cost + double{*cost++};
      walks_[n_walks_] = {walk.here, arc.to, sum};
      n_walks_ += static_cast<std::size_t>(arc.to != walk.here) &
                  static_cast<std::size_t>(arc.to != walk.before);
      double& least = least_[arc.to];
      reached_[n_reached_] = arc.to;
      n_reached_ += static_cast<std::size_t>(least == kNone);
      least = std::min(least, sum);
    }
  }

  const OrderedGraph& graph_;
  const std::span<const float> costs_;
  const int n_steps_;
  std::vector<Walk> walks_;  // walks from the current cell; the first n_walks_ entries are in use
  std::size_t n_walks_ = 0;
  std::vector<Place>
      reached_;  // targets of the found arcs; the first n_reached_ entries are in use
  std::size_t n_reached_ = 0;
  std::vector<double> squared_;  // squared length of each found arc
  std::vector<double> sums_;  // lowest total crease cost of a walk to the target of each found arc
  // (N,) lowest total crease cost of a walk to each cell; kNone if no walk has reached the cell.
  std::vector<double> least_;
};

// Maximum number of arcs per walk, chosen so that walks from a cell reach about 20 cells.
int steps_of(const OrderedGraph& graph) {
  const double n_arcs = static_cast<double>(graph.n_arcs) / std::max(graph.n_cells(), 1);
  if (n_arcs > 8.0) return 1;
  return n_arcs > 3.5 ? 2 : 3;
}

// Upper bound of the number of walks of up to n_steps arcs that do not turn back. `n_ways_on`
// returns the number of arcs by which a walk can continue from a cell.
std::size_t most_walks(const OrderedGraph& graph, int n_steps, ThreadTeam& team) {
  const auto n_ways_on = [&](Place place) {
    const std::size_t n_arcs = graph.arcs_of(place).size();
    return n_arcs > kMaxArcs ? 0.0 : static_cast<double>(n_arcs - 1);
  };
  const auto n_walks_from = [&](Place place) {
    double n_walks = 0.0;
    for (const Arc arc : graph.arcs_of(place)) {
      n_walks += 1.0 + n_ways_on(place) * (n_steps > 2 ? 1.0 + n_ways_on(arc.to) : 1.0);
    }
    return n_walks;
  };
  return static_cast<std::size_t>(sum_over(graph.n_cells(), n_walks_from, team));
}

}  // namespace

// For a few blocks at a time, arcs are collected in one list per block, which stays in the cache,
// and then copied to the result.
void add_far_arcs(OrderedGraph& graph, int most_steps, ThreadTeam& team) {
  SUPERFACETS_ASSERT(graph.is_symmetric && graph.straight_unit > 0.0);
  const int n_steps = std::min(steps_of(graph), most_steps);
  if (n_steps == 1) return;
  graph.own_arcs(team);
  const Buffer<float> costs = crease_costs(graph, team);
  const std::int64_t size = block_size(graph);
  std::vector<std::vector<Arc>> found(std::size_t{8} * team.size());
  PerThread<ArcFinder> finders(team.size());
  Buffer<std::int64_t> offsets(graph.n_cells() + 1);
  Buffer<Arc> arcs(most_walks(graph, n_steps, team));
  offsets[0] = 0;
  for (Place first = 0; first < graph.n_cells();) {
    const auto n_places = static_cast<Place>(
        std::min(size * std::ssize(found), std::int64_t{graph.n_cells()} - first));
    const std::int64_t n_blocks = (n_places + size - 1) / size;
    const Place last = first + n_places;
    const auto end_of = [&](std::int64_t block) {
      return static_cast<Place>(std::min<std::int64_t>(first + (block + 1) * size, last));
    };
    team.for_each(n_blocks, [&](std::int64_t block, int thread) {
      ArcFinder& finder = finders.get(thread, graph, costs.span(), n_steps);
      for (auto place = static_cast<Place>(first + block * size); place < end_of(block); ++place) {
        offsets[place + 1] = finder.find(place);
      }
      finder.take(found[block]);
    });
    for (Place place = first; place < last; ++place) offsets[place + 1] += offsets[place];
    team.for_each(n_blocks, [&](std::int64_t block, int) {
      const std::int64_t begin = offsets[first + block * size];
      std::copy_n(found[block].begin(), offsets[end_of(block)] - begin, arcs.data() + begin);
    });
    first = last;
  }
  arcs.shrink(offsets[graph.n_cells()]);
  graph.offsets = std::move(offsets);
  graph.arcs = std::move(arcs);
  graph.n_arcs = std::ssize(graph.arcs);
}

}  // namespace superfacets
