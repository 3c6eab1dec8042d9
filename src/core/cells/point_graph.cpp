#include "cells/point_graph.hpp"

#include <algorithm>
#include <atomic>
#include <numbers>
#include <numeric>

#include "base/assert.hpp"
#include "cells/neighbor_search.hpp"
#include "cells/normals.hpp"
#include "cells/turning.hpp"
#include "mesh/weld.hpp"

namespace superfacets {
namespace {

constexpr std::int64_t kPlacesPerTask = 1 << 12;

// What is found of the points at different positions, by place along the curve.
struct Found {
  Buffer<Place> rows;     // (P * n_neighbors,) nearest neighbors; kNoPlace where dropped
  Buffer<double> areas;   // (P,)
  Buffer<Point> normals;  // (P,) or empty
};

// The mean area per point from squared distances of the nearest neighbors, in rising order. With
// points on a plane at random the k-th is k / (pi density) on average, and their mean is
// (n + 1) / 2 times 1 / (pi density).
double area_around(double sum_of_squares, std::size_t n) {
  if (n == 0) return 0.0;
  const auto count = static_cast<double>(n);
  return 2.0 * std::numbers::pi * sum_of_squares / (count * (count + 1.0));
}

// The lowest points at their positions, in rising order.
std::vector<Cell> points_apart(std::span<const Vertex> representative) {
  std::vector<Cell> points;
  points.reserve(representative.size());
  for (Cell point = 0; std::cmp_less(point, representative.size()); ++point) {
    if (representative[point] == point) points.push_back(point);
  }
  return points;
}

Point normal_around(const NeighborSearch& search, Place place, std::span<const Neighbor> nearest) {
  Spread spread(search.position_at(place));
  spread.include(search.position_at(place));
  for (const Neighbor& neighbor : nearest) spread.include(search.position_at(neighbor.place));
  return direction_of_least_spread(spread);
}

Found find_neighbors(const NeighborSearch& search, const PointGraphOptions& options,
                     ThreadTeam& team) {
  const std::size_t n_places = search.n_points();
  const std::size_t n_columns = options.n_neighbors;
  Found found{Buffer<Place>(n_places * n_columns), Buffer<double>(n_places),
              Buffer<Point>(options.has_normals ? 0 : n_places)};
  const auto take = [&](Place place, std::span<const Neighbor> nearest, int) {
    const auto joined = nearest.first(std::min(n_columns, nearest.size()));
    Place* row = found.rows.data() + n_columns * place;
    double sum_of_squares = 0.0;
    for (const Neighbor& neighbor : joined) {
      *row++ = neighbor.place;
      sum_of_squares += neighbor.squared;
    }
    std::fill_n(row, n_columns - joined.size(), kNoPlace);
    found.areas[place] = area_around(sum_of_squares, joined.size());
    if (!options.has_normals) found.normals[place] = normal_around(search, place, nearest);
  };
  search.for_each_point(options.has_normals ? n_columns : options.n_around, take, team);
  return found;
}

// Drops neighbors that are too far away, and computes areas without them.
void cut_off(const NeighborSearch& search, const PointGraphOptions& options, Found& found,
             ThreadTeam& team) {
  const std::size_t n_columns = options.n_neighbors;
  const double squared_cutoff = options.cutoff * options.cutoff;
  Buffer<double> areas(found.areas.size());
  team.for_each_block(search.n_points(), [&](std::int64_t begin, std::int64_t end) {
    for (auto place = static_cast<Place>(begin); place < end; ++place) {
      double sum_of_squares = 0.0;
      std::size_t n_kept = 0;
      for (Place& near : found.rows.span().subspan(n_columns * place, n_columns)) {
        if (near == kNoPlace) continue;
        const double squared = squared_norm(search.position_at(near) - search.position_at(place));
        const double smaller = std::min(found.areas[place], found.areas[near]);
        if (squared > squared_cutoff * smaller) {
          near = kNoPlace;
        } else {
          sum_of_squares += squared;
          ++n_kept;
        }
      }
      areas[place] = area_around(sum_of_squares, n_kept);
    }
  });
  found.areas = std::move(areas);
}

// Makes the arcs of the graph from the rows of nearest neighbors, with one back for each.
class ArcBuilder {
 public:
  ArcBuilder(const NeighborSearch& search, const NeighborRows& rows,
             std::span<const Vertex> representative, ThreadTeam& team)
      : search_(search), rows_(rows), representative_(representative), team_(team) {}

  void build(PointGraph& graph) {
    const std::size_t n_points = representative_.size();
    graph.offsets = Buffer<std::int64_t>(n_points + 1);
    team_.fill(graph.offsets.span(), std::int64_t{0});
    // Each pass meets the arcs in any order: they are counted, and then sorted.
    for_each_pair([&](Cell a, Cell b) {
      add_one(graph.offsets[a + 1]);
      add_one(graph.offsets[b + 1]);
    });
    std::inclusive_scan(graph.offsets.begin(), graph.offsets.end(), graph.offsets.begin());
    graph.neighbors = Buffer<Cell>(graph.offsets[n_points]);
    Buffer<std::int64_t> cursors(n_points);  // write cursor of each point
    std::copy_n(graph.offsets.begin(), n_points, cursors.begin());
    for_each_pair([&](Cell a, Cell b) {
      graph.neighbors[add_one(cursors[a])] = b;
      graph.neighbors[add_one(cursors[b])] = a;
    });
    team_.for_each_block(static_cast<std::int64_t>(n_points),
                         [&](std::int64_t begin, std::int64_t end) {
                           for (auto point = begin; point < end; ++point) {
                             std::sort(graph.neighbors.data() + graph.offsets[point],
                                       graph.neighbors.data() + graph.offsets[point + 1]);
                           }
                         });
  }

 private:
  static std::int64_t add_one(std::int64_t& number) {
    return std::atomic_ref(number).fetch_add(1, std::memory_order_relaxed);
  }

  // Calls take(a, b) once for each pair of points that arcs join, from any thread.
  template <typename Take>
  void for_each_pair(const Take& take) const {
    const auto pairs_of_places = [&](std::int64_t begin, std::int64_t end) {
      for (auto place = static_cast<Place>(begin); place < end; ++place) {
        for (const Place near : rows_.row(place)) {
          if (near == kNoPlace || (near < place && has(near, place))) continue;
          take(search_.point_at(place), search_.point_at(near));
        }
      }
    };
    team_.for_each_block(search_.n_points(), pairs_of_places, kPlacesPerTask);
    const auto pairs_at_one_position = [&](std::int64_t begin, std::int64_t end) {
      for (auto point = static_cast<Cell>(begin); point < end; ++point) {
        if (representative_[point] != point) take(point, representative_[point]);
      }
    };
    team_.for_each_block(std::ssize(representative_), pairs_at_one_position);
  }

  bool has(Place place, Place neighbor) const {
    const auto row = rows_.row(place);
    return std::find(row.begin(), row.end(), neighbor) != row.end();
  }

  const NeighborSearch& search_;
  const NeighborRows& rows_;
  const std::span<const Vertex> representative_;
  ThreadTeam& team_;
};

// Gives points what was found of the position that they are at; they share the area.
void spread_to_points(const NeighborSearch& search, const Found& found,
                      std::span<const Vertex> representative, ThreadTeam& team, PointGraph& graph) {
  const auto n_points = std::ssize(representative);
  Buffer<Cell> n_together(n_points);
  team.fill(n_together.span(), 0);
  for (const Vertex first : representative) ++n_together[first];
  graph.measures = Buffer<double>(n_points);
  graph.normals = Buffer<Point>(found.normals.size() == 0 ? 0 : n_points);
  const auto give_to_first = [&](std::int64_t begin, std::int64_t end) {
    for (auto place = static_cast<Place>(begin); place < end; ++place) {
      const Cell point = search.point_at(place);
      graph.measures[point] = found.areas[place] / n_together[point];
      if (graph.normals.size() > 0) graph.normals[point] = found.normals[place];
    }
  };
  team.for_each_block(search.n_points(), give_to_first);
  const auto give_to_rest = [&](std::int64_t begin, std::int64_t end) {
    for (auto point = begin; point < end; ++point) {
      const Cell first = representative[point];
      if (first == point) continue;
      graph.measures[point] = graph.measures[first];
      if (graph.normals.size() > 0) graph.normals[point] = graph.normals[first];
    }
  };
  team.for_each_block(n_points, give_to_rest);
}

// Points in their order on the curve, then those that share a position with a lower one.
Buffer<Cell> order_of(const NeighborSearch& search, std::span<const Vertex> representative) {
  Buffer<Cell> order(representative.size());
  auto next = std::copy(search.points().begin(), search.points().end(), order.begin());
  for (Cell point = 0; std::cmp_less(point, representative.size()); ++point) {
    if (representative[point] != point) *next++ = point;
  }
  return order;
}

}  // namespace

PointGraph build_point_graph(std::span<const Point> positions, const PointGraphOptions& options,
                             ThreadTeam& team) {
  SUPERFACETS_ASSERT(options.n_neighbors >= 1 && options.n_around >= options.n_neighbors);
  SUPERFACETS_ASSERT(options.cutoff > 0.0);
  const Buffer<Vertex> representative = weld_vertices(positions, team);
  const NeighborSearch search(positions, points_apart(representative.span()), team);
  Found found = find_neighbors(search, options, team);
  cut_off(search, options, found, team);
  const NeighborRows rows{found.rows.span(), options.n_neighbors};
  if (!options.has_normals) {
    turn_consistently(rows, search.positions(), found.areas.span(), search.points(),
                      found.normals.span());
  }
  PointGraph graph;
  spread_to_points(search, found, representative.span(), team, graph);
  ArcBuilder(search, rows, representative.span(), team).build(graph);
  graph.order = order_of(search, representative.span());
  return graph;
}

}  // namespace superfacets
