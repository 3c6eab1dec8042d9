#include "clustering/seeding.hpp"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "clustering/classification.hpp"
#include "clustering/farthest.hpp"
#include "clustering/update.hpp"
#include "paths/longest_paths.hpp"

namespace superfacets {
namespace {

// Which places some region has reached, and the expansion of one more region.
class Flood {
 public:
  Flood(const OrderedGraph& graph, double reach)
      : graph_(graph),
        squared_reach_(reach * reach),
        is_reached_(graph.n_cells(), false),
        visited_by_(graph.n_cells(), kNoLabel) {}

  bool is_reached(Place place) const { return is_reached_[place]; }

  // Which places are reached does not depend on the order in which they are, so a stack does where
  // the classification needs Dijkstra's algorithm.
  void expand(Place seed, Label label) {
    reach_place(seed, label);
    while (!stack_.empty()) {
      const Place place = stack_.back();
      stack_.pop_back();
      const double squared = squared_norm(graph_.positions[place] - graph_.positions[seed]);
      if (squared > squared_reach_) continue;
      for (const Arc& arc : graph_.arcs_of(place)) {
        if (visited_by_[arc.to] != label) reach_place(arc.to, label);
      }
    }
  }

 private:
  void reach_place(Place place, Label label) {
    visited_by_[place] = label;
    is_reached_[place] = true;
    stack_.push_back(place);
  }

  const OrderedGraph& graph_;
  const double squared_reach_;
  std::vector<bool> is_reached_;   // (N,) by any region
  std::vector<Label> visited_by_;  // (N,) the last region that came by
  std::vector<Place> stack_;       // places of the present region still to be expanded
};

// Places by component (that of `first`, then by lowest cell), then by path length, then by cell.
std::vector<Place> visiting_order(const OrderedGraph& graph, Place first, ThreadTeam& team) {
  Classification from_first(graph, kInfinity, team);
  from_first.classify(std::span(&first, 1));
  std::vector<Place> order(graph.n_cells());
  std::iota(order.begin(), order.end(), 0);
  // With one center a component, the label is the component.
  auto key = [&](Place place) {
    const Path path = from_first.path(place);
    return std::tuple(path.label, path.length, graph.cells[place]);
  };
  std::sort(order.begin(), order.end(), [&](Place a, Place b) { return key(a) < key(b); });
  return order;
}

struct Component {
  Label label;
  double measure = 0.0;
  Cell n_cells = 0;
};

// The components that are large enough for seeds of their own; see geodesic_seeds.
std::vector<Label> seeded_components(const OrderedGraph& graph, std::span<const Label> by_place,
                                     Label n_components, Cell n_seeds) {
  std::vector<Component> components(n_components);
  for (Label label = 0; label < n_components; ++label) components[label].label = label;
  double total = 0.0;
  for (Cell cell = 0; cell < graph.n_cells(); ++cell) {
    const Place place = graph.place_of[cell];
    components[by_place[place]].measure += graph.measures[place];
    ++components[by_place[place]].n_cells;
    total += graph.measures[place];
  }
  std::stable_sort(components.begin(), components.end(),
                   [](const Component& a, const Component& b) { return a.measure > b.measure; });
  const double enough = 0.5 * total / n_seeds;
  std::vector<Label> seeded;
  Cell n_cells = 0;
  for (const Component& component : components) {
    const bool is_wanted = component.measure >= enough || n_cells < n_seeds;
    if (!is_wanted || std::cmp_equal(seeded.size(), n_seeds)) break;
    seeded.push_back(component.label);
    n_cells += component.n_cells;
  }
  return seeded;
}

// The first seeds of a graph of several components.
std::vector<Place> seeds_of_components(const OrderedGraph& graph, Place first, Cell n_seeds,
                                       ThreadTeam& team) {
  Classification from_first(graph, kInfinity, team);
  from_first.classify(std::span(&first, 1));
  Buffer<Label> by_place(graph.n_cells());
  for (Place place = 0; place < graph.n_cells(); ++place) {
    by_place[place] = from_first.path(place).label;
  }
  const auto n_components = static_cast<Label>(from_first.centers().size());
  const auto central = update_centers(graph, by_place.span(), n_components, team);
  std::vector<Place> seeds;
  for (const Label label : seeded_components(graph, by_place.span(), n_components, n_seeds)) {
    seeds.push_back(central[label]);
  }
  return seeds;
}

// A cube of the grid by its numbers along the axes: whole, and as doubles free of overflow.
struct Cube {
  double x, y, z;
  bool operator==(const Cube&) const = default;
};

struct CubeHash {
  std::size_t operator()(const Cube& cube) const {
    // Odd multipliers near 2^64 / golden ratio; neighbors in space land far apart.
    std::uint64_t h = std::bit_cast<std::uint64_t>(cube.x) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ h >> 32 ^ std::bit_cast<std::uint64_t>(cube.y)) * 0xbf58476d1ce4e5b9ULL;
    h = (h ^ h >> 32 ^ std::bit_cast<std::uint64_t>(cube.z)) * 0x94d049bb133111ebULL;
    return static_cast<std::size_t>(h ^ h >> 32);
  }
};

}  // namespace

Cell central_cell(const OrderedGraph& graph, ThreadTeam& team) {
  const Point mean = weighted_mean(graph, team);
  return graph.cells[graph.nearest(mean, 0, [](Place) { return true; })];
}

std::vector<Cell> farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 ThreadTeam& team) {
  FarthestPoints points(graph, team);
  std::vector<Place> seeds{graph.place_of[first]};
  points.place(seeds.back());
  while (std::cmp_less(seeds.size(), n_seeds)) {
    seeds.push_back(points.farthest());
    points.place(seeds.back());
  }
  return graph.cells_at(seeds);
}

std::vector<Cell> geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 ThreadTeam& team) {
  std::vector<Place> seeds{graph.place_of[first]};
  std::optional<LongestPaths> paths(std::in_place, graph, team);
  paths->place(seeds.front());
  if (!paths->reach_all()) {
    paths.reset();  // memory for what follows
    seeds = seeds_of_components(graph, seeds.front(), n_seeds, team);
    paths.emplace(graph, team);
    for (const Place seed : seeds) paths->place(seed);
  }
  while (std::cmp_less(seeds.size(), n_seeds)) {
    seeds.push_back(paths->farthest());
    paths->place(seeds.back());
  }
  return graph.cells_at(seeds);
}

std::vector<Cell> flood_seeds(const OrderedGraph& graph, Cell first, double reach,
                              ThreadTeam& team) {
  Flood flood(graph, reach);
  std::vector<Place> seeds;
  for (const Place place : visiting_order(graph, graph.place_of[first], team)) {
    if (flood.is_reached(place)) continue;
    flood.expand(place, static_cast<Label>(seeds.size()));
    seeds.push_back(place);
  }
  return graph.cells_at(seeds);
}

std::vector<Cell> grid_seeds(const OrderedGraph& graph, Point corner, double side,
                             ThreadTeam& team) {
  std::unordered_map<Cube, Label, CubeHash> label_of;
  Buffer<Label> labels(graph.n_cells());
  for (const Place place : graph.place_of) {
    const Point offset = graph.positions[place] - corner;
    // Adding 0.0 turns a -0.0 that floor keeps into 0.0, which must hash alike.
    const Cube cube{std::floor(offset.x / side) + 0.0, std::floor(offset.y / side) + 0.0,
                    std::floor(offset.z / side) + 0.0};
    const auto next = static_cast<Label>(label_of.size());
    labels[place] = label_of.try_emplace(cube, next).first->second;
  }
  const auto n_regions = static_cast<Label>(label_of.size());
  return graph.cells_at(update_centers(graph, labels.span(), n_regions, team));
}

}  // namespace superfacets
