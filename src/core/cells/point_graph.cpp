#include "cells/point_graph.hpp"

#include <numbers>
#include <numeric>

#include "cells/turning.hpp"
#include "mesh/weld.hpp"
#include "spatial/neighbor_search.hpp"
#include "spatial/normals.hpp"

namespace superfacets {
namespace {

constexpr std::int64_t kPlacesPerTask = 1 << 12;

// Neighbors, areas and normals of the P representatives (the lowest point at each position), in the
// order of a space-filling curve.
struct Found {
  Buffer<Place> rows;     // (P * n_neighbors,) neighbors of each point; kNoPlace if dropped
  Buffer<double> areas;   // (P,) area around each point
  Buffer<Point> normals;  // (P,) unit normals, or empty if normals are given
};

// Area per point, estimated from the sum of the squared distances of the n nearest neighbors. For
// random points on a plane, the expected squared distance of the k-th neighbor is k / (pi density),
// so the mean over n neighbors is (n + 1) / (2 pi density).
double area_around(double sum_of_squares, std::size_t n) {
  if (n == 0) return 0.0;
  const auto count = static_cast<double>(n);
  return 2.0 * std::numbers::pi * sum_of_squares / (count * (count + 1.0));
}

Point normal_around(const NeighborSearch& search, std::span<const Point> axes, Place place,
                    std::span<const Neighbor> nearest) {
  NormalFit fit(axes, search.position_at(place));
  const auto include = [&](Place at) { fit.include(search.position_at(at), search.point_at(at)); };
  include(place);
  for (const Neighbor& neighbor : nearest) include(neighbor.place);
  return fit.normal();
}

Found find_neighbors(const NeighborSearch& search, const PointGraphOptions& options,
                     ThreadTeam& team) {
  const std::size_t n_places = search.n_points();
  const std::size_t n_columns = options.n_neighbors;
  Found found{Buffer<Place>(n_places * n_columns), Buffer<double>(n_places),
              Buffer<Point>(options.has_normals ? 0 : n_places)};
  const auto take = [&](Place place, std::span<const Neighbor> nearest) {
    const auto joined = nearest.first(std::min(n_columns, nearest.size()));
    Place* row = found.rows.data() + n_columns * place;
    double sum_of_squares = 0.0;
    for (const Neighbor& neighbor : joined) {
      *row++ = neighbor.place;
      sum_of_squares += neighbor.squared;
    }
    std::fill_n(row, n_columns - joined.size(), kNoPlace);
    found.areas[place] = area_around(sum_of_squares, joined.size());
    if (options.has_normals) return;
    found.normals[place] = normal_around(search, options.axes, place, nearest);
  };
  search.for_each_point(options.has_normals ? n_columns : options.n_around, take, team);
  return found;
}

// Drops neighbors beyond the cutoff distance, and recomputes areas from the remaining neighbors.
void cut_off(const NeighborSearch& search, const PointGraphOptions& options, Found& found,
             ThreadTeam& team) {
  const std::size_t n_columns = options.n_neighbors;
  const double squared_cutoff = options.cutoff * options.cutoff;
  Buffer<double> areas(found.areas.size());
  team.for_each_index(search.n_points(), [&](Place place) {
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
  });
  found.areas = std::move(areas);
}

// Duplicates: points at the same position as a point with a lower index. In the sorted order, all
// duplicates follow after all representatives. They are sorted like the representatives, then by
// index.
struct Copies {
  std::vector<Cell> points;   // input index of each duplicate
  std::vector<Place> places;  // sorted index of the representative of each duplicate
};

Copies find_copies(const NeighborSearch& search, std::span<const Vertex> representative) {
  Copies copies;
  if (std::cmp_equal(search.n_points(), representative.size())) return copies;
  std::vector<Place> place_of(representative.size(), kNoPlace);
  for (Place place = 0; place < search.n_points(); ++place) {
    place_of[search.point_at(place)] = place;
  }
  for (Cell point = 0; std::cmp_less(point, representative.size()); ++point) {
    if (representative[point] != point) copies.points.push_back(point);
  }
  const auto place_at = [&](Cell point) { return place_of[representative[point]]; };
  std::ranges::stable_sort(copies.points, {}, place_at);
  std::ranges::transform(copies.points, std::back_inserter(copies.places), place_at);
  return copies;
}

// Concatenates the values of representatives and the values of duplicates.
template <typename T>
Buffer<T> with_copies(Buffer<T> values, std::span<const T> of_copies) {
  if (of_copies.empty()) return values;
  Buffer<T> all(values.size() + of_copies.size());
  const auto rest = std::ranges::copy(values, all.begin()).out;
  std::ranges::copy(of_copies, rest);
  return all;
}

// Appends a copy of the representative's value for each duplicate.
template <typename T>
Buffer<T> with_same(Buffer<T> values, const Copies& copies) {
  std::vector<T> same;
  same.reserve(copies.places.size());
  for (const Place place : copies.places) same.push_back(values[place]);
  return with_copies<T>(std::move(values), same);
}

// Divides the area of each position equally among the points at this position.
Buffer<double> shared_areas(Buffer<double> areas, const Copies& copies) {
  if (copies.points.empty()) return areas;
  std::vector<Cell> n_together(areas.size(), 1);
  for (const Place place : copies.places) ++n_together[place];
  for (std::size_t place = 0; place < areas.size(); ++place) areas[place] /= n_together[place];
  return with_same(std::move(areas), copies);
}

// Makes an arc in each direction for each pair in the rows of nearest neighbors.
class ArcBuilder {
 public:
  ArcBuilder(const NeighborRows& rows, std::span<const Place> places_of_copies, ThreadTeam& team)
      : rows_(rows), places_of_copies_(places_of_copies), team_(team) {}

  void build(PointGraph& graph) {
    const auto n_places = n_distinct() + std::ssize(places_of_copies_);
    graph.offsets = Buffer<std::int64_t>(n_places + 1);
    team_.fill(graph.offsets.span(), std::int64_t{0});
    // Threads visit pairs in any order. Arcs are counted, written to their lists, and then sorted.
    for_each_pair([&](Place a, Place b) {
      add_one(graph.offsets[a + 1]);
      add_one(graph.offsets[b + 1]);
    });
    std::inclusive_scan(graph.offsets.begin(), graph.offsets.end(), graph.offsets.begin());
    graph.neighbors = Buffer<Cell>(graph.offsets[n_places]);
    Buffer<std::int64_t> cursors(n_places);  // write cursor of each point
    std::copy_n(graph.offsets.begin(), n_places, cursors.begin());
    for_each_pair([&](Place a, Place b) {
      graph.neighbors[add_one(cursors[a])] = b;
      graph.neighbors[add_one(cursors[b])] = a;
    });
    team_.for_each_index(n_places, [&](std::int64_t place) {
      std::sort(graph.neighbors.data() + graph.offsets[place],
                graph.neighbors.data() + graph.offsets[place + 1]);
    });
  }

 private:
  // Number of representatives, which precede the duplicates in the sorted order.
  std::int64_t n_distinct() const {
    return static_cast<std::int64_t>(rows_.places.size() / rows_.n_columns);
  }

  std::int64_t add_one(std::int64_t& number) const {
    // A plain increment takes a third of the time of an atomic increment.
    if (team_.size() == 1) return number++;
    return std::atomic_ref(number).fetch_add(1, std::memory_order_relaxed);
  }

  // Calls take(a, b) once for each pair of points that are joined by arcs, on any thread.
  template <typename Take>
  void for_each_pair(const Take& take) const {
    const auto take_pairs_of = [&](Place place) {
      for (const Place near : rows_.row(place)) {
        if (near == kNoPlace || (near < place && has(near, place))) continue;
        take(place, near);
      }
    };
    team_.for_each_index(n_distinct(), take_pairs_of, kPlacesPerTask);
    team_.for_each_index(std::ssize(places_of_copies_), [&](std::int64_t copy) {
      take(static_cast<Place>(n_distinct() + copy), places_of_copies_[copy]);
    });
  }

  bool has(Place place, Place neighbor) const {
    const auto row = rows_.row(place);
    return std::ranges::find(row, neighbor) != row.end();
  }

  const NeighborRows& rows_;
  const std::span<const Place> places_of_copies_;
  ThreadTeam& team_;
};

}  // namespace

PointGraph build_point_graph(std::span<const Point> positions, const PointGraphOptions& options,
                             ThreadTeam& team) {
  SUPERFACETS_ASSERT(options.n_neighbors >= 1 && options.n_around >= options.n_neighbors);
  SUPERFACETS_ASSERT(options.cutoff > 0.0);
  const Buffer<Vertex> representative = weld_vertices(positions, team);
  NeighborSearch search(positions, representatives_of(representative.span()), team);
  Found found = find_neighbors(search, options, team);
  cut_off(search, options, found, team);
  const NeighborRows rows{found.rows.span(), options.n_neighbors};
  if (!options.has_normals) {
    turn_consistently(rows, search.positions(), found.areas.span(), found.normals.span());
  }
  const Copies copies = find_copies(search, representative.span());
  PointGraph graph;
  ArcBuilder(rows, copies.places, team).build(graph);
  graph.measures = shared_areas(std::move(found.areas), copies);
  if (!options.has_normals) graph.normals = with_same(std::move(found.normals), copies);
  graph.points = with_copies<Cell>(search.release_points(), copies.points);
  graph.positions = with_same(search.release_positions(), copies);
  return graph;
}

PointGraph in_input_order(const PointGraph& sorted, ThreadTeam& team) {
  const auto n_points = std::ssize(sorted.points);
  PointGraph graph;
  graph.offsets = Buffer<std::int64_t>(n_points + 1);
  graph.measures = Buffer<double>(n_points);
  graph.normals = Buffer<Point>(sorted.normals.size());
  graph.offsets[0] = 0;
  team.for_each_index(n_points, [&](std::int64_t place) {
    const Cell point = sorted.points[place];
    graph.offsets[point + 1] = sorted.offsets[place + 1] - sorted.offsets[place];
    graph.measures[point] = sorted.measures[place];
    if (graph.normals.size() > 0) graph.normals[point] = sorted.normals[place];
  });
  std::inclusive_scan(graph.offsets.begin(), graph.offsets.end(), graph.offsets.begin());
  graph.neighbors = Buffer<Cell>(sorted.neighbors.size());
  team.for_each_index(n_points, [&](std::int64_t place) {
    Cell* first = graph.neighbors.data() + graph.offsets[sorted.points[place]];
    Cell* next = first;
    for (auto arc = sorted.offsets[place]; arc < sorted.offsets[place + 1]; ++arc) {
      *next++ = sorted.points[sorted.neighbors[arc]];
    }
    std::sort(first, next);
  });
  return graph;
}

}  // namespace superfacets
