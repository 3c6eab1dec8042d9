// Computes the paper's halted expansions as corrections to the exact classification.
#pragma once

#include <vector>

#include "paths/expansion.hpp"
#include "paths/source_paths.hpp"

namespace superfacets {

// In the halted mode each center expands separately. A place at a Euclidean distance of more than
// `reach` from the center is labeled but not expanded. Where expansions overlap, the better path
// wins. A direct implementation takes about five expansions per place, and most of these confirm
// the exact classification: if the exact path to a place stays within reach of its center, the
// halted result is the same path, because no other center has a better one. All other places are
// uncertain. Their paths are found as in the paper, by separate expansions from the centers that
// may reach an uncertain place.
class HaltedPaths {
 public:
  HaltedPaths(const OrderedGraph& graph, double reach, ThreadTeam& team);

  // Finds the paths that differ from the exact paths. `exact` holds the exact classification by the
  // centers, in which cells of components without a center are unreached.
  void correct(const Expansion& exact, std::span<const Place> centers);

  // Must be called after `correct`. Repeatedly makes the lowest unreached cell a center and appends
  // it to `centers`, until all cells are reached.
  void adopt_orphans(const Expansion& exact, std::vector<Place>& centers);

  // The path to a place, after all corrections.
  Path path(const Expansion& exact, Place place) const {
    return doubt_of_[place] == kNoDoubt ? exact.path(place) : doubts_[doubt_of_[place]].path;
  }

 private:
  static constexpr std::int32_t kNoDoubt = -1;

  struct Doubt {
    Place place;
    Path path;  // the best halted path so far
  };

  bool is_within_reach(Place center, Place place) const {
    return squared_norm(graph_.positions[place] - graph_.positions[center]) <= squared_reach_;
  }
  void add_doubt(Place place, const Path& path);
  void find_doubts(const Expansion& exact, std::span<const Place> centers);
  std::vector<Label> centers_in_doubt(std::span<const Place> centers) const;
  void expand(Place center, SourcePaths& worker) const;
  void expand_all(std::span<const Label> labels, std::span<const Place> centers);

  const OrderedGraph& graph_;
  const double squared_reach_;
  ThreadTeam& team_;
  Buffer<std::int32_t> doubt_of_;  // (N,) index of a place among the uncertain places
  std::vector<Doubt> doubts_;
  const std::int64_t n_workers_;
  PerThread<SourcePaths> workers_;
};

}  // namespace superfacets
