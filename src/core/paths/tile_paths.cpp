#include "paths/tile_paths.hpp"

#include "base/assert.hpp"

namespace superfacets {

TilePaths improve_paths(const OrderedGraph& tile, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team) {
  SUPERFACETS_ASSERT(proposals.lengths.size() == proposals.places.size() &&
                     proposals.labels.size() == proposals.places.size());
  Expansion expansion(tile, team);
  expansion.restore(lengths, labels);
  for (std::size_t i = 0; i < proposals.places.size(); ++i) {
    expansion.propose(proposals.places[i], {proposals.lengths[i], proposals.labels[i]});
  }
  expansion.run();
  TilePaths paths{Buffer<PathLength>(tile.n_cells()), Buffer<Label>(tile.n_cells())};
  for (Place place = 0; place < tile.n_cells(); ++place) {
    const Path path = expansion.path(place);
    paths.lengths[place] = path.length;
    paths.labels[place] = path.label;
  }
  return paths;
}

}  // namespace superfacets
