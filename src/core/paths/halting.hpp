// Halted expansions (Simari et al. 2014), computed as corrections to exact shortest paths.
#pragma once

#include "paths/source_paths.hpp"

namespace superfacets {

// In a halted expansion, each center expands separately. A cell whose Euclidean distance from the
// center is larger than `reach` gets a path, but the path is not continued. Where expansions
// overlap, the best path is used. A direct implementation would expand each cell about five times.
// Most results equal the exact shortest paths: if the exact path to a cell stays within the radius
// `reach` of its center, the halted result is the same path, because no other center has a better
// path. All other cells are uncertain. Their paths are found with separate expansions from the
// centers that may reach an uncertain cell.
class HaltedPaths {
 public:
  HaltedPaths(const OrderedGraph& graph, double reach, ThreadTeam& team);

  // Finds the paths that differ from the exact paths. `exact` contains the exact shortest paths
  // from the given centers.
  void correct(const Expansion& exact, std::span<const Place> centers);

  // Repeatedly makes the lowest unreached cell a center and appends the cell to `centers`, until
  // all cells are reached. Must be called after correct().
  void adopt_orphans(const Expansion& exact, std::vector<Place>& centers);

  // The path to a cell, after all corrections.
  Path path(const Expansion& exact, Place place) const {
    return doubt_of_[place] == kNoDoubt ? exact.path(place) : doubts_[doubt_of_[place]].path;
  }

 private:
  static constexpr std::int32_t kNoDoubt = -1;

  struct Doubt {
    Place place;
    Path path;  // best path so far from the halted expansions
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
  Buffer<std::int32_t> doubt_of_;  // (N,) index of each cell in doubts_, or kNoDoubt
  std::vector<Doubt> doubts_;
  const std::int64_t n_workers_;
  PerThread<SourcePaths> workers_;
};

}  // namespace superfacets
