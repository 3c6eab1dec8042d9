#include "paths/tile_paths.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/assert.hpp"
#include "cells/weights.hpp"

namespace superfacets {
namespace {

// As many arcs as lengths of this mean have in all together, wherever tiles are cut: by this the
// queues of an expansion choose the width of their buckets.
std::int64_t n_arcs_of_all(std::span<const float> lengths) {
  const double total = std::accumulate(lengths.begin(), lengths.end(), 0.0);
  if (total <= 0.0) return 1;
  return std::llround(std::ldexp(static_cast<double>(lengths.size()) / total, kTotalBits));
}

bool fits_rows(const PathArcs& input) {
  for (std::size_t cell = 0; cell + 1 < input.offsets.size(); ++cell) {
    if (input.offsets[cell + 1] - input.offsets[cell] > OrderedGraph::kRow) return false;
  }
  return true;
}

void copy_rows(const PathArcs& input, OrderedGraph& graph) {
  graph.arcs = Buffer<Arc>(std::size_t{OrderedGraph::kRow} * graph.n_cells());
  const auto n_own = static_cast<Place>(input.offsets.size() - 1);
  Arc* row = graph.arcs.data();
  for (Place place = 0; place < graph.n_cells(); ++place, row += OrderedGraph::kRow) {
    const std::int64_t begin = input.offsets[std::min(place, n_own)];
    const std::int64_t end = place < n_own ? input.offsets[place + 1] : begin;
    for (std::int64_t i = 0; i < OrderedGraph::kRow; ++i) {
      const std::int64_t arc = begin + i;
      row[i] = arc < end ? Arc{input.targets[arc], input.lengths[arc]} : Arc{place, 1.0F};
    }
  }
}

void copy_lists(const PathArcs& input, OrderedGraph& graph) {
  graph.offsets = Buffer<std::int64_t>(std::size_t{1} + graph.n_cells());
  std::copy(input.offsets.begin(), input.offsets.end(), graph.offsets.begin());
  std::fill(graph.offsets.begin() + input.offsets.size(), graph.offsets.end(),
            input.offsets.back());
  graph.arcs = Buffer<Arc>(input.targets.size());
  for (std::size_t arc = 0; arc < input.targets.size(); ++arc) {
    graph.arcs[arc] = {input.targets[arc], input.lengths[arc]};
  }
}

// What paths need of a graph: no positions.
OrderedGraph graph_of_paths(const PathArcs& input, std::size_t n_cells) {
  OrderedGraph graph;
  graph.cells = Buffer<Cell>(n_cells);  // their number; they are not read
  if (fits_rows(input)) {
    copy_rows(input, graph);
  } else {
    copy_lists(input, graph);
  }
  graph.n_arcs = n_arcs_of_all(input.lengths);
  return graph;
}

}  // namespace

TilePaths improve_paths(const PathArcs& arcs, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team) {
  SUPERFACETS_ASSERT(proposals.lengths.size() == proposals.places.size() &&
                     proposals.labels.size() == proposals.places.size());
  SUPERFACETS_ASSERT(arcs.lengths.size() == arcs.targets.size() &&
                     arcs.offsets.size() <= lengths.size() + 1 &&
                     all_below(arcs.targets, lengths.size()));
  const OrderedGraph graph = graph_of_paths(arcs, lengths.size());
  Expansion expansion(graph, team);
  expansion.restore(lengths, labels);
  for (std::size_t i = 0; i < proposals.places.size(); ++i) {
    expansion.propose(proposals.places[i], {proposals.lengths[i], proposals.labels[i]});
  }
  expansion.run();
  TilePaths paths{Buffer<PathLength>(graph.n_cells()), Buffer<Label>(graph.n_cells())};
  for (Place place = 0; place < graph.n_cells(); ++place) {
    const Path path = expansion.path(place);
    paths.lengths[place] = path.length;
    paths.labels[place] = path.label;
  }
  return paths;
}

}  // namespace superfacets
