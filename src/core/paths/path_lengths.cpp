#include "paths/path_lengths.hpp"

#include <numeric>

#include "paths/source_paths.hpp"

namespace superfacets {
namespace {

// Number of source cells per task. The number is large enough that few lists have to be
// concatenated.
constexpr std::int64_t kBlock = 64;

// Calls work(first, last, paths) for blocks of 0..n_sources-1, on any thread.
template <typename Work>
void for_each_source_block(const OrderedGraph& graph, std::int64_t n_sources, const Work& work,
                           ThreadTeam& team) {
  PerThread<SourcePaths> paths(team.size());
  team.for_each((n_sources + kBlock - 1) / kBlock, [&](std::int64_t block, int thread) {
    work(block * kBlock, std::min(n_sources, (block + 1) * kBlock), paths.get(thread, graph));
  });
}

float in_units(PathLength length, double unit) {
  return static_cast<float>(static_cast<double>(length) * unit);
}

struct Entry {
  Cell column;
  float value;
};

// The matrix rows of kBlock consecutive cells.
struct Block {
  std::vector<std::int64_t> ends;  // end of each row in `entries`
  std::vector<Entry> entries;
};

void append_row(const OrderedGraph& graph, Cell source, double squared_reach, double unit,
                SourcePaths& paths, Block& block) {
  const Point center = graph.positions[graph.place_of[source]];
  auto is_within_reach = [&](Place place) {
    return squared_norm(graph.positions[place] - center) <= squared_reach;
  };
  paths.expand(graph.place_of[source],
               [&](Place place, PathLength) { return is_within_reach(place); });
  const auto begin = static_cast<std::ptrdiff_t>(block.entries.size());
  paths.take([&](Place place, PathLength length) {
    if (is_within_reach(place)) {
      block.entries.push_back({graph.cells[place], in_units(length, unit)});
    }
  });
  std::sort(block.entries.begin() + begin, block.entries.end(),
            [](const Entry& a, const Entry& b) { return a.column < b.column; });
  block.ends.push_back(static_cast<std::int64_t>(block.entries.size()));
}

}  // namespace

SparseRows path_lengths_within(const OrderedGraph& graph, double reach, double unit,
                               ThreadTeam& team) {
  SUPERFACETS_ASSERT(reach >= 0.0);
  const std::int64_t n_cells = graph.n_cells();
  std::vector<Block> blocks((n_cells + kBlock - 1) / kBlock);
  auto append_rows = [&](std::int64_t first, std::int64_t last, SourcePaths& paths) {
    for (std::int64_t cell = first; cell < last; ++cell) {
      append_row(graph, static_cast<Cell>(cell), reach * reach, unit, paths, blocks[cell / kBlock]);
    }
  };
  for_each_source_block(graph, n_cells, append_rows, team);

  std::vector<std::int64_t> begins(blocks.size() + 1, 0);  // index of the first entry of each block
  std::transform_inclusive_scan(
      blocks.begin(), blocks.end(), begins.begin() + 1, std::plus<>(),
      [](const Block& block) { return static_cast<std::int64_t>(block.entries.size()); },
      std::int64_t{0});
  SparseRows rows{Buffer<std::int64_t>(n_cells + 1), Buffer<Cell>(begins.back()),
                  Buffer<float>(begins.back())};
  rows.offsets[0] = 0;
  team.for_each(std::ssize(blocks), [&](std::int64_t index, int) {
    const Block block = std::move(blocks[index]);  // moved, so that its memory is freed after use
    for (std::size_t row = 0; row < block.ends.size(); ++row) {
      rows.offsets[index * kBlock + row + 1] = begins[index] + block.ends[row];
    }
    for (std::size_t i = 0; i < block.entries.size(); ++i) {
      rows.columns[begins[index] + i] = block.entries[i].column;
      rows.values[begins[index] + i] = block.entries[i].value;
    }
  });
  return rows;
}

}  // namespace superfacets
