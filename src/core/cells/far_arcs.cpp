#include "cells/far_arcs.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/assert.hpp"
#include "base/elementary.hpp"

namespace superfacets {
namespace {

// Walks do not pass through cells with more arcs, so the number of walks is linear in the number of
// cells.
constexpr std::size_t kMostArcs = 24;

constexpr std::int64_t kBlock = 1 << 10;  // places

// Prices of all arcs, by place and in their order: whole numbers, so that sums do not depend on the
// order of the terms.
Buffer<float> prices_of(const OrderedGraph& graph, ThreadTeam& team) {
  Buffer<float> prices(graph.arcs.size());
  team.for_each_index(graph.n_cells(), [&](Place place) {
    auto next = static_cast<std::size_t>(graph.arcs_of(place).data() - graph.arcs.data());
    for (const Arc& arc : graph.arcs_of(place)) {
      prices[next++] = static_cast<float>(round_to_whole(graph.price(place, arc)));
    }
  });
  return prices;
}

// Finds the arcs of one place after another.
class ArcFinder {
 public:
  ArcFinder(const OrderedGraph& graph, std::span<const float> prices, int n_steps)
      : graph_(graph), prices_(prices), n_steps_(n_steps), least_(graph.n_cells(), kNone) {}

  // The number of arcs of a place.
  std::int64_t count(Place place) {
    reach(place);
    for (const Place to : reached_) least_[to] = kNone;
    return std::ssize(reached_);
  }

  // Writes the arcs of a place.
  void write(Place place, Arc* arcs) {
    reach(place);
    for (const Place to : reached_) {
      *arcs++ = {to, length_between(place, to, least_[to])};
      least_[to] = kNone;
    }
  }

 private:
  struct Walk {
    Place before;
    Place here;
    double price;  // sums of whole numbers are exact
  };
  static constexpr double kNone = HUGE_VAL;

  // Finds the cells that arcs lead to, and the prices of the arcs.
  void reach(Place place) {
    walks_.clear();
    reached_.clear();
    least_[place] = 0.0;
    extend<true>({place, place, 0.0});
    std::size_t begin = 0;
    for (int step = 2; step <= n_steps_; ++step) {
      const std::size_t end = walks_.size();
      for (; begin < end; ++begin) {
        const Walk walk = walks_[begin];
        if (graph_.arcs_of(walk.here).size() > kMostArcs) continue;
        if (step < n_steps_) {
          extend<true>(walk);
        } else {
          extend<false>(walk);
        }
      }
    }
    least_[place] = kNone;
  }

  // Adds an arc to a walk, in all ways. The longer walks are kept if they are to be extended, too.
  template <bool kKeeps>
  void extend(const Walk walk) {
    const std::span<const Arc> arcs = graph_.arcs_of(walk.here);
    const float* price = prices_.data() + (arcs.data() - graph_.arcs.data());
    for (const Arc& arc : arcs) {
      const double sum = walk.price + double{*price++};
      if (arc.to == walk.here || arc.to == walk.before) continue;  // padding, or back
      if constexpr (kKeeps) walks_.push_back({walk.here, arc.to, sum});
      double& least = least_[arc.to];
      if (least == kNone) reached_.push_back(arc.to);
      least = std::min(least, sum);
    }
  }

  float length_between(Place place, Place to, double price) const {
    const double straight = norm(graph_.positions[to] - graph_.positions[place]);
    const double length = straight / graph_.straight_unit + price;
    return static_cast<float>(std::max(1.0, round_to_whole(length)));
  }

  const OrderedGraph& graph_;
  const std::span<const float> prices_;
  const int n_steps_;
  std::vector<Walk> walks_;
  std::vector<Place> reached_;
  std::vector<double> least_;  // by place: the lowest price of a walk; kNone if there is none
};

// Walks of this many arcs reach about 20 cells, whatever the number of arcs of a cell.
int steps_of(const OrderedGraph& graph) {
  const double n_arcs = static_cast<double>(graph.n_arcs) / std::max(graph.n_cells(), 1);
  if (n_arcs > 8.0) return 1;
  return n_arcs > 3.5 ? 2 : 3;
}

}  // namespace

void add_far_arcs(OrderedGraph& graph, int most_steps, ThreadTeam& team) {
  SUPERFACETS_ASSERT(graph.is_symmetric && graph.straight_unit > 0.0);
  const int n_steps = std::min(steps_of(graph), most_steps);
  if (n_steps == 1) return;
  const Buffer<float> prices = prices_of(graph, team);
  PerThread<ArcFinder> finders(team.size());
  Buffer<std::int64_t> offsets(graph.n_cells() + 1);
  offsets[0] = 0;
  const auto for_each_place = [&](const auto& work) {
    team.for_each((graph.n_cells() + kBlock - 1) / kBlock, [&](std::int64_t block, int thread) {
      ArcFinder& finder = finders.get(thread, graph, prices.span(), n_steps);
      const std::int64_t end = std::min<std::int64_t>((block + 1) * kBlock, graph.n_cells());
      for (auto place = static_cast<Place>(block * kBlock); place < end; ++place) {
        work(finder, place);
      }
    });
  };
  // Arcs are counted first: writing new memory takes longer than finding arcs again.
  for_each_place([&](ArcFinder& finder, Place place) { offsets[place + 1] = finder.count(place); });
  for (Place place = 0; place < graph.n_cells(); ++place) offsets[place + 1] += offsets[place];
  Buffer<Arc> arcs(offsets[graph.n_cells()]);
  for_each_place(
      [&](ArcFinder& finder, Place place) { finder.write(place, arcs.data() + offsets[place]); });
  graph.offsets = std::move(offsets);
  graph.arcs = std::move(arcs);
  graph.n_arcs = std::ssize(graph.arcs);
}

}  // namespace superfacets
