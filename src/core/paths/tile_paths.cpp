#include "paths/tile_paths.hpp"

namespace superfacets {
namespace {

// The mean arc length is estimated from every kStep-th arc. A sample of a few thousand arcs
// suffices.
constexpr std::size_t kStep = 61;

// Estimated number of arcs of the whole graph. All lengths sum to about 2^kTotalBits, which is
// divided by the mean length of the sample. Queues derive their bucket width from this number, so
// the width does not depend on the size of the tile.
std::int64_t n_arcs_of_all(std::span<const float> lengths) {
  double total = 0.0;
  std::int64_t n_lengths = 0;
  for (std::size_t arc = 0; arc < lengths.size(); arc += kStep, ++n_lengths) total += lengths[arc];
  if (n_lengths == 0) return 1;
  return std::llround(std::ldexp(static_cast<double>(n_lengths) / total, kTotalBits));
}

bool fits_rows(const PathArcs& input) {
  std::int64_t most = 0;
  for (std::size_t cell = 0; cell + 1 < input.offsets.size(); ++cell) {
    most = std::max(most, input.offsets[cell + 1] - input.offsets[cell]);
  }
  return most <= OrderedGraph::kRow;
}

void copy_rows(const PathArcs& input, OrderedGraph& graph) {
  constexpr std::int64_t kRow = OrderedGraph::kRow;
  graph.arcs = Buffer<Arc>(kRow * static_cast<std::size_t>(graph.n_cells()));
  const auto n_own = static_cast<Place>(input.offsets.size() - 1);
  Arc* row = graph.arcs.data();
  for (Place place = 0; place < n_own; ++place, row += kRow) {
    const std::int64_t begin = input.offsets[place];
    const std::int64_t n_arcs = input.offsets[place + 1] - begin;
    for (std::int64_t i = 0; i < n_arcs; ++i) {
      row[i] = {input.targets[begin + i], input.lengths[begin + i]};
    }
    std::fill(row + n_arcs, row + kRow, Arc{place, 1.0F});
  }
  for (Place place = n_own; place < graph.n_cells(); ++place, row += kRow) {
    std::fill_n(row, kRow, Arc{place, 1.0F});
  }
}

void copy_lists(const PathArcs& input, OrderedGraph& graph) {
  graph.offsets = Buffer<std::int64_t>(std::size_t{1} + graph.n_cells());
  std::ranges::copy(input.offsets, graph.offsets.begin());
  std::fill(graph.offsets.begin() + input.offsets.size(), graph.offsets.end(),
            input.offsets.back());
  graph.arcs = Buffer<Arc>(input.targets.size());
  for (std::size_t arc = 0; arc < input.targets.size(); ++arc) {
    graph.arcs[arc] = {input.targets[arc], input.lengths[arc]};
  }
}

}  // namespace

OrderedGraph graph_of_arcs(const PathArcs& input, std::size_t n_cells) {
  OrderedGraph graph;
  // Only the size of this array is used; its entries are never read.
  graph.cells = Buffer<Cell>(n_cells);
  if (fits_rows(input)) {
    copy_rows(input, graph);
  } else {
    copy_lists(input, graph);
  }
  graph.n_arcs = n_arcs_of_all(input.lengths);
  return graph;
}

TilePaths improve_paths(const PathArcs& arcs, std::span<const PathLength> lengths,
                        std::span<const Label> labels, const PathProposals& proposals,
                        ThreadTeam& team) {
  SUPERFACETS_ASSERT(proposals.lengths.size() == proposals.places.size() &&
                     proposals.labels.size() == proposals.places.size());
  SUPERFACETS_ASSERT(arcs.lengths.size() == arcs.targets.size() &&
                     arcs.offsets.size() <= lengths.size() + 1 &&
                     all_below(arcs.targets, lengths.size()));
  const OrderedGraph graph = graph_of_arcs(arcs, lengths.size());
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
