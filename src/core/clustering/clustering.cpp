#include "clustering/clustering.hpp"

#include "clustering/relocation.hpp"

namespace superfacets {

Clustering::Clustering(const OrderedGraph& graph, std::span<const Cell> centers, double reach,
                       Islands islands, PathArrays* paths, int n_threads)
    : graph_(graph),
      team_(useful_threads(graph.n_cells(), n_threads)),
      classification_(graph, reach, islands, paths, team_),
      means_(graph, team_) {
  classify(centers);
}

void Clustering::classify(std::span<const Cell> centers) {
  SUPERFACETS_ASSERT(all_below(centers, graph_.n_cells()));
  classification_.classify(graph_.places_of(centers));
}

std::vector<Cell> Clustering::centers() const {
  return graph_.cells_at(classification_.centers());
}

std::vector<Cell> Clustering::update() {
  means_.resize(classification_.centers().size());
  auto take_over = [&](Place begin, Place end) {
    means_.take_over(begin, end, [&](Place place) { return classification_.path(place).label; });
  };
  classification_.take_changes(take_over);
  return graph_.cells_at(means_.nearest(classification_.centers()));
}

std::vector<Cell> Clustering::relocate(std::int64_t n_moves, ThreadTeam& team) {
  Buffer<Path> paths(graph_.n_cells());
  team.for_each_index(graph_.n_cells(),
                      [&](Place place) { paths[place] = classification_.path(place); });
  return graph_.cells_at(
      relocate_centers(graph_, paths.span(), classification_.centers(), n_moves, team));
}

Buffer<Label> Clustering::labels() {
  Buffer<Label> labels(graph_.n_cells());
  team_.for_each_index(graph_.n_cells(), [&](std::int64_t cell) {
    labels[cell] = classification_.path(graph_.place_of(cell)).label;
  });
  return labels;
}

Buffer<PathLength> Clustering::lengths() {
  Buffer<PathLength> lengths(graph_.n_cells());
  team_.for_each_index(graph_.n_cells(), [&](std::int64_t cell) {
    lengths[cell] = classification_.path(graph_.place_of(cell)).length;
  });
  return lengths;
}

}  // namespace superfacets
