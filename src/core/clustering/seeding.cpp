#include "clustering/seeding.hpp"

#include <unordered_map>

#include "cells/components.hpp"
#include "clustering/classification.hpp"
#include "clustering/farthest.hpp"
#include "clustering/update.hpp"
#include "paths/longest_paths.hpp"

namespace superfacets {
namespace {

// Expands one region after another, and records which cells have been reached.
class Flood {
 public:
  Flood(const OrderedGraph& graph, double reach)
      : graph_(graph),
        squared_reach_(reach * reach),
        is_reached_(graph.n_cells(), false),
        visited_by_(graph.n_cells(), kNoLabel) {}

  bool is_reached(Place place) const { return is_reached_[place]; }

  // Expands the region of a seed. A stack suffices, because the set of reached cells does not
  // depend on the order of expansion.
  void expand(Place seed, Label label) {
    reach_place(seed, label);
    while (!stack_.empty()) {
      const Place place = stack_.back();
      stack_.pop_back();
      const double squared = squared_norm(graph_.positions[place] - graph_.positions[seed]);
      if (squared > squared_reach_) continue;
      for (const Arc arc : graph_.arcs_of(place)) {
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
  std::vector<bool> is_reached_;   // (N,) whether any region has reached the cell
  std::vector<Label> visited_by_;  // (N,) the last region that has reached the cell
  std::vector<Place> stack_;       // cells of the current region that are not yet expanded
};

Components find_components_of(const OrderedGraph& graph, ThreadTeam& team) {
  Buffer<Label> same(graph.n_cells());
  team.fill(same.span(), Label{0});
  return find_components(graph, same.span(), team);
}

struct Size {
  double measure = 0.0;
  Cell n_cells = 0;
};

std::vector<Size> sizes_of(const OrderedGraph& graph, const Components& components) {
  std::vector<Size> sizes(components.n_components);
  for (const Place place : graph.in_input_order()) {
    sizes[components.of[place]].measure += graph.measures[place];
    ++sizes[components.of[place]].n_cells;
  }
  return sizes;
}

// Returns half the mean measure of a region. A component with a smaller measure is an island.
double least_measure(const OrderedGraph& graph, Cell n_seeds) {
  double total = 0.0;
  for (const Place place : graph.in_input_order()) total += graph.measures[place];
  return 0.5 * total / n_seeds;
}

// Fraction of the seeds that curve_seeds distributes along the space-filling curve. The remaining
// seeds fill gaps between these seeds, which takes more time. The undersegmentation error is 1%
// lower for a fraction of 0.5, and 1% higher for 0.7.
constexpr double kCurveFraction = 0.6;

// Minimum weight of a cell. The weight is positive, so that every component has a positive total
// weight.
constexpr double kMinWeight = 1e-300;

// Weight of a cell when seeds are distributed along the curve: its measure times sqrt(sum of its
// arc lengths / sum of the straight distances of these arcs). Arcs across creases are long, so
// seeds are denser near creases.
double curve_weight(const OrderedGraph& graph, Place place) {
  double lengths = 0.0;
  double steps = 0.0;
  for (const Arc arc : graph.arcs_of(place)) {
    if (arc.to == place) continue;  // a padding arc, or an arc from a cell to itself
    lengths += double{arc.length};
    steps += norm(graph.positions[arc.to] - graph.positions[place]);
  }
  if (!(steps > 0.0)) return kMinWeight;
  return std::max(graph.measures[place] * std::sqrt(lengths / steps), kMinWeight);
}

// Selects the seeds of one component while its cells are visited in the order of the curve.
struct Portion {
  double total = 0.0;   // total weight of all cells of the component
  double passed = 0.0;  // total weight of the cells visited so far
  Cell n_left = 0;      // number of cells not yet visited
  Cell n_seeds = 0;     // number of seeds that the component gets
  Cell n_placed = 0;    // number of seeds selected so far

  // Visits the next cell. Returns whether the cell is a seed. The curve is divided into n_seeds
  // parts of equal weight, and the middle cell of each part is a seed. If only as many cells are
  // left as seeds are missing, all of these cells are seeds.
  bool takes(double weight) {
    passed += weight;
    const bool is_last = n_left-- <= n_seeds - n_placed;
    if (n_placed == n_seeds) return false;
    if (!is_last && !(passed * n_seeds > (n_placed + 0.5) * total)) return false;
    ++n_placed;
    return true;
  }
};

// The components of a graph, with a flag for each component that is large enough for seeds.
class SeededComponents {
 public:
  SeededComponents(const OrderedGraph& graph, Place first, Cell n_seeds, ThreadTeam& team)
      : graph_(graph),
        team_(team),
        first_(first),
        components_(find_components_of(graph, team)),
        is_seeded_(components_.n_components, false) {
    choose(n_seeds);
  }

  bool is_seeded(Place place) const { return is_seeded_[components_.of[place]]; }
  Cell component(Place place) const { return components_.of[place]; }
  Cell n_components() const { return components_.n_components; }

  // For each large component, the cell nearest to the mean position of the component. If there is
  // only one component, the result is `first`.
  std::vector<Place> central_places() const {
    if (n_components() == 1) return {first_};
    const auto central = update_centers(graph_, components_.of.span(), n_components(), team_);
    std::vector<Place> places;
    places.reserve(seeded_.size());
    for (const Cell component : seeded_) places.push_back(central[component]);
    return places;
  }

  // Distributes n_seeds seeds along the curve, at least one in each large component; see Portion.
  std::vector<Place> places_along_curve(Cell n_seeds) const {
    Buffer<double> weights(graph_.n_cells());
    team_.for_each_index(graph_.n_cells(),
                         [&](Place place) { weights[place] = curve_weight(graph_, place); });
    std::vector<Portion> portions(n_components());
    for (Place place = 0; place < graph_.n_cells(); ++place) {
      portions[component(place)].total += weights[place];
      ++portions[component(place)].n_left;
    }
    divide(std::max(n_seeds, static_cast<Cell>(seeded_.size())), portions);
    std::vector<Place> places;
    for (Place place = 0; place < graph_.n_cells(); ++place) {
      if (portions[component(place)].takes(weights[place])) places.push_back(place);
    }
    return places;
  }

 private:
  // Divides seeds among the large components, in proportion to their total weights. The largest
  // component is processed last, so that it absorbs the rounding errors.
  void divide(Cell n_seeds, std::span<Portion> portions) const {
    std::vector<double> totals;  // cumulative weights, from the largest component to each component
    Cell n_cells = 0;            // number of cells of the components that are not yet processed
    for (const Cell component : seeded_) {
      totals.push_back((totals.empty() ? 0.0 : totals.back()) + portions[component].total);
      n_cells += portions[component].n_left;
    }
    for (auto larger = static_cast<Cell>(seeded_.size()) - 1; larger >= 0; --larger) {
      Portion& portion = portions[seeded_[larger]];
      n_cells -= portion.n_left;
      const Cell least = std::max(1, n_seeds - n_cells);
      const Cell most = std::min(portion.n_left, n_seeds - larger);
      const double exact = n_seeds * (portion.total / totals[larger]);
      portion.n_seeds = std::clamp(static_cast<Cell>(std::floor(exact + 0.5)), least, most);
      n_seeds -= portion.n_seeds;
    }
  }

  // All components, sorted from the largest to the smallest.
  std::vector<Cell> by_size(std::span<const Size> sizes) const {
    std::vector<Cell> order(sizes.size());
    std::iota(order.begin(), order.end(), 0);
    std::rotate(order.begin(), order.begin() + component(first_),
                order.begin() + component(first_) + 1);
    std::ranges::stable_sort(order,
                             [&](Cell a, Cell b) { return sizes[a].measure > sizes[b].measure; });
    return order;
  }

  void choose(Cell n_seeds) {
    const double enough = least_measure(graph_, n_seeds);
    const std::vector<Size> sizes = sizes_of(graph_, components_);
    Cell n_cells = 0;
    for (const Cell component : by_size(sizes)) {
      const bool is_wanted = sizes[component].measure >= enough || n_cells < n_seeds;
      if (!is_wanted || std::cmp_equal(seeded_.size(), n_seeds)) return;
      seeded_.push_back(component);
      is_seeded_[component] = true;
      n_cells += sizes[component].n_cells;
    }
  }

  const OrderedGraph& graph_;
  ThreadTeam& team_;
  const Place first_;
  const Components components_;  // component of each cell, in the sorted order of the graph
  std::vector<bool> is_seeded_;  // whether each component gets seeds
  std::vector<Cell> seeded_;     // components that get seeds, the largest first
};

// All cells, sorted by component, then by path length from the start of its flood, then by input
// index. The component of `first` comes first, and its flood starts at `first`. The other
// components follow in the order of their numbers, which is the order of their lowest cells. Their
// floods start at these cells.
std::vector<Place> visiting_order(const OrderedGraph& graph, const SeededComponents& components,
                                  Place first, ThreadTeam& team) {
  std::vector<Place> starts(components.n_components(), kNoPlace);
  starts[components.component(first)] = first;
  for (const Place place : graph.in_input_order()) {
    Place& start = starts[components.component(place)];
    if (start == kNoPlace) start = place;
  }
  Classification from_starts(graph, kInfinity, Islands::kNearest, nullptr, team);
  from_starts.classify(starts);
  // Sort keys are copied, because looking them up during comparisons would cause cache misses.
  std::vector<std::tuple<Cell, PathLength, Cell, Place>> keys(graph.n_cells());
  for (Place place = 0; place < graph.n_cells(); ++place) {
    const Cell component = components.component(place);
    const Cell rank = component == components.component(first) ? kNoCell : component;
    keys[place] = {rank, from_starts.path(place).length, graph.cell_at(place), place};
  }
  std::ranges::sort(keys);
  std::vector<Place> order;
  order.reserve(keys.size());
  for (const auto& key : keys) order.push_back(std::get<3>(key));
  return order;
}

// In a graph with one-way arcs, there may be cells that no path from a seed reaches. This function
// repeatedly makes the lowest unreached cell of a large component a seed, until there are n_seeds
// seeds or all cells of large components are reached.
void place_unreached(const OrderedGraph& graph, const SeededComponents& components, Cell n_seeds,
                     LongestPaths& paths, std::vector<Place>& seeds) {
  if (graph.is_symmetric) return;
  for (const Place place : graph.in_input_order()) {
    if (std::cmp_equal(seeds.size(), n_seeds)) return;
    if (!components.is_seeded(place) || paths.reaches(place)) continue;
    seeds.push_back(place);
    paths.place(place);
  }
}

// Repeatedly adds the cell that is farthest from its nearest seed, until there are n_seeds seeds.
template <typename Distances>
void add_farthest(Distances& distances, Cell n_seeds, std::vector<Place>& seeds) {
  while (std::cmp_less(seeds.size(), n_seeds)) {
    seeds.push_back(distances.farthest());
    distances.place(seeds.back());
  }
}

// Integer coordinates of a cube of the grid, as doubles, which cannot overflow.
using Cube = Point;

struct CubeHash {
  std::size_t operator()(const Cube& cube) const {
    // The multipliers of the SplitMix64 generator give distant hashes to cubes adjacent in space.
    std::uint64_t h = std::bit_cast<std::uint64_t>(cube.x) * 0x9e3779b97f4a7c15ULL;
    h = (h ^ h >> 32 ^ std::bit_cast<std::uint64_t>(cube.y)) * 0xbf58476d1ce4e5b9ULL;
    h = (h ^ h >> 32 ^ std::bit_cast<std::uint64_t>(cube.z)) * 0x94d049bb133111ebULL;
    return static_cast<std::size_t>(h ^ h >> 32);
  }
};

}  // namespace

Cell central_cell(const OrderedGraph& graph, ThreadTeam& team) {
  NearestPlace nearest(graph, weighted_mean(graph, team), 0);
  nearest.search([](Place) { return true; }, std::numeric_limits<std::int64_t>::max());
  return graph.cell_at(nearest.place());
}

std::int64_t n_cells_of_large_components(const OrderedGraph& graph, Cell n_seeds,
                                         ThreadTeam& team) {
  const double enough = least_measure(graph, n_seeds);
  std::int64_t n_cells = 0;
  for (const Size& size : sizes_of(graph, find_components_of(graph, team))) {
    if (size.measure >= enough) n_cells += size.n_cells;
  }
  return n_cells;
}

std::vector<Cell> farthest_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                                 Islands islands, ThreadTeam& team) {
  FarthestPoints points(graph, team);
  std::vector<Place> seeds{graph.place_of(first)};
  if (islands == Islands::kNearest) {
    const SeededComponents components(graph, seeds.front(), n_seeds, team);
    seeds = components.central_places();
    points.leave_out([&](Place place) { return !components.is_seeded(place); });
  }
  for (const Place seed : seeds) points.place(seed);
  add_farthest(points, n_seeds, seeds);
  return graph.cells_at(seeds);
}

SeedsAndPaths geodesic_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds,
                             ThreadTeam& team) {
  std::vector<Place> seeds{graph.place_of(first)};
  std::optional<LongestPaths> paths(std::in_place, graph, team);
  paths->place(seeds.front());
  if (!paths->reach_all()) {
    paths.reset();  // frees the memory of the paths
    const SeededComponents components(graph, seeds.front(), n_seeds, team);
    seeds = components.central_places();
    paths.emplace(graph, team);
    paths->place_all(seeds);
    place_unreached(graph, components, n_seeds, *paths, seeds);
  }
  add_farthest(*paths, n_seeds, seeds);
  return {graph.cells_at(seeds), std::move(*paths).take_paths()};
}

SeedsAndPaths curve_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, ThreadTeam& team) {
  const SeededComponents components(graph, graph.place_of(first), n_seeds, team);
  const auto n_along = static_cast<Cell>(std::ceil(kCurveFraction * n_seeds));
  std::vector<Place> seeds = components.places_along_curve(n_along);
  LongestPaths paths(graph, team);
  paths.place_all(seeds);
  place_unreached(graph, components, n_seeds, paths, seeds);
  add_farthest(paths, n_seeds, seeds);
  return {graph.cells_at(seeds), std::move(paths).take_paths()};
}

std::vector<Cell> flood_seeds(const OrderedGraph& graph, Cell first, Cell n_seeds, double reach,
                              Islands islands, ThreadTeam& team) {
  const Place start = graph.place_of(first);
  const SeededComponents components(graph, start, n_seeds, team);
  Flood flood(graph, reach);
  std::vector<Place> seeds;
  for (const Place place : visiting_order(graph, components, start, team)) {
    const bool is_left_out = islands == Islands::kNearest && !components.is_seeded(place);
    if (is_left_out || flood.is_reached(place)) continue;
    flood.expand(place, static_cast<Label>(seeds.size()));
    seeds.push_back(place);
  }
  return graph.cells_at(seeds);
}

std::vector<Cell> grid_seeds(const OrderedGraph& graph, Point corner, double side,
                             ThreadTeam& team) {
  std::unordered_map<Cube, Label, CubeHash> label_of;
  Buffer<Label> labels(graph.n_cells());
  for (const Place place : graph.in_input_order()) {
    const Point offset = graph.positions[place] - corner;
    // Adding 0.0 turns the -0.0 that floor may return into 0.0, so that both zeros have the same
    // hash.
    const Cube cube{std::floor(offset.x / side) + 0.0, std::floor(offset.y / side) + 0.0,
                    std::floor(offset.z / side) + 0.0};
    const auto next = static_cast<Label>(label_of.size());
    labels[place] = label_of.try_emplace(cube, next).first->second;
  }
  const auto n_regions = static_cast<Label>(label_of.size());
  return graph.cells_at(update_centers(graph, labels.span(), n_regions, team));
}

}  // namespace superfacets
