#include "spatial/point_tiles.hpp"

#include "spatial/neighbor_search.hpp"
#include "spatial/normals.hpp"

namespace superfacets {
namespace {

// The index of each point among the wanted points, or kNoCell if the point is not wanted.
Buffer<Cell> rows_of_wanted(std::span<const std::uint8_t> is_wanted, std::size_t& n_wanted) {
  Buffer<Cell> rows(is_wanted.size());
  n_wanted = 0;
  for (std::size_t i = 0; i < is_wanted.size(); ++i) {
    rows[i] = is_wanted[i] != 0 ? static_cast<Cell>(n_wanted++) : kNoCell;
  }
  return rows;
}

}  // namespace

NearestRows nearest_in_part(std::span<const Point> positions,
                            std::span<const std::uint8_t> is_wanted, std::size_t n_nearest,
                            ThreadTeam& team) {
  SUPERFACETS_ASSERT(is_wanted.size() == positions.size() && n_nearest >= 1);
  std::size_t n_wanted = 0;
  const Buffer<Cell> row_of = rows_of_wanted(is_wanted, n_wanted);
  std::vector<Cell> every(positions.size());
  std::iota(every.begin(), every.end(), 0);
  const NeighborSearch search(positions, every, team);
  NearestRows found{Buffer<Cell>(n_wanted * n_nearest), Buffer<double>(n_wanted * n_nearest)};
  std::ranges::fill(found.points, kNoCell);
  std::ranges::fill(found.squared, kInfinity);
  search.for_each_wanted(
      n_nearest, [&](Place place) { return row_of[search.point_at(place)] != kNoCell; },
      [&](Place place, std::span<const Neighbor> nearest, int) {
        std::size_t next = n_nearest * row_of[search.point_at(place)];
        for (const Neighbor& neighbor : nearest) {
          found.points[next] = neighbor.point;
          found.squared[next++] = neighbor.squared;
        }
      },
      team);
  return found;
}

Buffer<Point> directions_around(std::span<const Point> positions, std::span<const Point> axes,
                                std::span<const Cell> centers, std::span<const Cell> rows,
                                ThreadTeam& team) {
  SUPERFACETS_ASSERT(all_below(centers, static_cast<Cell>(positions.size())));
  Buffer<Point> directions(centers.size());
  const std::size_t n_columns = centers.empty() ? 0 : rows.size() / centers.size();
  team.for_each_index(std::ssize(centers), [&](std::int64_t i) {
    NormalFit fit(axes, positions[centers[i]]);
    fit.include(positions[centers[i]], centers[i]);
    for (const Cell near : rows.subspan(n_columns * i, n_columns)) {
      if (near == kNoCell) break;
      fit.include(positions[near], near);
    }
    directions[i] = fit.normal();
  });
  return directions;
}

Lists<Place> sorted_lists(Cell n_cells, std::span<const Cell> sources,
                          std::span<const Place> targets) {
  SUPERFACETS_ASSERT(sources.size() == targets.size() && all_below(sources, n_cells));
  Lists<Place> lists = group<Place>(n_cells, [&](const auto& add) {
    for (std::size_t i = 0; i < sources.size(); ++i) add(sources[i], targets[i]);
  });
  ThreadTeam alone(1);
  sort_unique(lists, alone);
  return lists;
}

}  // namespace superfacets
