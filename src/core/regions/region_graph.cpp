#include "regions/region_graph.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <tuple>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {
namespace {

// Regions per task; most have hundreds of cells.
constexpr std::int64_t kRegionBlock = 8;

// The cells of each region, ascending.
class Members {
 public:
  Members(std::span<const Label> labels, Label n_regions)
      : starts_(static_cast<std::size_t>(n_regions) + 1, 0), cells_(labels.size()) {
    for (const Label label : labels) {
      if (label != kNoLabel) ++starts_[label];
    }
    std::int64_t total = 0;
    for (std::int64_t& start : starts_) total += std::exchange(start, total);
    std::vector<std::int64_t> ends(starts_.begin(), starts_.end() - 1);  // write cursors
    for (std::size_t cell = 0; cell < labels.size(); ++cell) {
      if (labels[cell] != kNoLabel) cells_[ends[labels[cell]]++] = static_cast<Cell>(cell);
    }
  }

  std::span<const Cell> of(std::int64_t region) const {
    return cells_.span().subspan(starts_[region], starts_[region + 1] - starts_[region]);
  }

 private:
  std::vector<std::int64_t> starts_;  // (K + 1,)
  Buffer<Cell> cells_;                // by region
};

// Sums over the cells of a region. Positions are relative to its first cell, so that regions far
// from the origin keep their digits.
struct Sums {
  double measure = 0.0;
  Point moment{0.0, 0.0, 0.0};     // of the measure
  Point positions{0.0, 0.0, 0.0};  // of cells, each counted once
  Point area_vector{0.0, 0.0, 0.0};
  Box box;
  double open_length = 0.0;
};

Sums sum_cells(const Surface& surface, std::span<const Cell> cells, const Point& origin) {
  Sums sums;
  for (const Cell cell : cells) {
    const CellShape shape = surface.shape(cell);
    const Point offset = shape.position - origin;
    sums.measure += shape.measure;
    sums.moment = sums.moment + shape.measure * offset;
    sums.positions = sums.positions + offset;
    sums.area_vector = sums.area_vector + shape.area_vector;
    sums.box.include(shape.box);
    sums.open_length += surface.open_length(cell);
  }
  return sums;
}

// The second moment about the centroid, by measure, or by cells where all measures are 0.
SecondMoment moment_about(const Surface& surface, std::span<const Cell> cells,
                          const Point& centroid, double total_measure) {
  SecondMoment moment;
  for (const Cell cell : cells) {
    const CellShape shape = surface.shape(cell);
    const double share = total_measure > 0.0 ? shape.measure / total_measure
                                             : 1.0 / static_cast<double>(cells.size());
    moment.add(share, shape.spread);
    moment.add(share, shape.position - centroid);
  }
  return moment;
}

Cell nearest_cell(const Surface& surface, std::span<const Cell> cells, const Point& to) {
  Cell nearest = cells.front();
  double least = std::numeric_limits<double>::infinity();
  for (const Cell cell : cells) {
    const double distance = squared_norm(surface.position(cell) - to);
    if (distance < least) {
      least = distance;
      nearest = cell;
    }
  }
  return nearest;
}

void measure_region(const Surface& surface, std::span<const Cell> cells, std::int64_t region,
                    RegionShapes& shapes) {
  const Point origin = surface.position(cells.front());
  const Sums sums = sum_cells(surface, cells, origin);
  const bool has_measure = sums.measure > 0.0;
  const double weight = has_measure ? sums.measure : static_cast<double>(cells.size());
  const Point& moment = has_measure ? sums.moment : sums.positions;
  // Divided one by one: the inverse of a tiny area may be infinite.
  const Point centroid = origin + Point{moment.x / weight, moment.y / weight, moment.z / weight};
  const SecondMoment covariance = moment_about(surface, cells, centroid, sums.measure);
  shapes.measures[region] = sums.measure;
  shapes.centroids[region] = centroid;
  shapes.squares[region] = covariance.squares;
  shapes.products[region] = covariance.products;
  shapes.normal_sums[region] = sums.area_vector;
  shapes.lows[region] = sums.box.low;
  shapes.highs[region] = sums.box.high;
  shapes.open_lengths[region] = sums.open_length;
  shapes.centers[region] = nearest_cell(surface, cells, centroid);
}

// An arc between two regions, or a part of it: if several arcs cross one side between the same two
// regions, they share the side.
struct Crossing {
  Label low;
  Label high;
  std::int64_t arc;
  double share;
  double length;
  double angle;
};

bool leads_to(const Surface& surface, Cell from, Cell to) {
  const std::span<const Cell> neighbors = surface.arcs().neighbors(from);
  return std::ranges::find(neighbors, to) != neighbors.end();
}

// Collects the arcs that cross borders between regions.
class CrossingFinder {
 public:
  CrossingFinder(const Surface& surface, std::span<const Label> labels)
      : surface_(surface), labels_(labels) {}

  void add_arcs_of(Cell cell) {
    if (labels_[cell] == kNoLabel || !is_at_border(cell)) return;
    std::int64_t begin = surface_.arcs().offsets[cell];
    const std::int64_t end = surface_.arcs().offsets[cell + 1];
    while (begin < end) {
      std::int64_t next = begin + 1;
      const int side = surface_.side(cell, begin);
      while (next < end && surface_.side(cell, next) == side) ++next;
      add_side(cell, begin, next);
      begin = next;
    }
  }

  std::vector<Crossing> take() && { return std::move(found_); }

 private:
  bool is_at_border(Cell cell) const {
    const std::span<const Cell> neighbors = surface_.arcs().neighbors(cell);
    return std::ranges::any_of(neighbors,
                               [&](Cell neighbor) { return labels_[neighbor] != labels_[cell]; });
  }

  // Each pair of regions is counted from the lower one, or from the other if there is no reverse
  // arc.
  bool is_counted(Cell cell, Cell neighbor) const {
    const Label own = labels_[cell];
    const Label other = labels_[neighbor];
    if (other == kNoLabel || own == other) return false;
    if (own < other) return true;
    return surface_.may_have_one_way_arcs() && !leads_to(surface_, neighbor, cell);
  }

  void add_side(Cell cell, std::int64_t begin, std::int64_t end) {
    const std::span<const Cell> neighbors = surface_.arcs().targets.subspan(begin, end - begin);
    on_side_.clear();
    if (neighbors.size() > 1) {
      on_side_.push_back(labels_[cell]);
      for (const Cell neighbor : neighbors) on_side_.push_back(labels_[neighbor]);
      std::ranges::sort(on_side_);
    }
    for (std::int64_t arc = begin; arc < end; ++arc) {
      const Cell neighbor = surface_.arcs().targets[arc];
      if (!is_counted(cell, neighbor)) continue;
      const auto [low, high] = std::minmax(labels_[cell], labels_[neighbor]);
      found_.push_back({low, high, arc, 1.0 / (count(low) * count(high)),
                        surface_.border_length(cell, arc), surface_.angle(cell, arc)});
    }
  }

  // The number of cells on the side with this label.
  double count(Label label) const {
    if (on_side_.empty()) return 1.0;
    const auto range = std::equal_range(on_side_.begin(), on_side_.end(), label);
    return static_cast<double>(range.second - range.first);
  }

  const Surface& surface_;
  const std::span<const Label> labels_;
  std::vector<Label> on_side_;  // labels on the side, sorted; empty if it has two cells
  std::vector<Crossing> found_;
};

std::vector<Crossing> sorted_crossings(const Surface& surface, std::span<const Label> labels,
                                       ThreadTeam& team) {
  std::vector<Crossing> crossings;
  std::mutex mutex;
  team.for_each_block(surface.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    CrossingFinder finder(surface, labels);
    for (auto cell = static_cast<Cell>(begin); cell < end; ++cell) finder.add_arcs_of(cell);
    const std::vector<Crossing> part = std::move(finder).take();
    const std::scoped_lock lock(mutex);
    crossings.insert(crossings.end(), part.begin(), part.end());
  });
  // Also sorted by arc, so that the order of the sums does not depend on the number of threads.
  std::ranges::sort(crossings, [](const Crossing& a, const Crossing& b) {
    return std::tie(a.low, a.high, a.arc) < std::tie(b.low, b.high, b.arc);
  });
  return crossings;
}

// The border crossed by a list of arcs from one region to another.
RegionArc sum_border(std::span<const Crossing> crossings) {
  RegionArc border{crossings.front().low, crossings.front().high, 0.0, 0.0, 0.0, 0.0, 0};
  double n_sides = 0.0;
  for (const Crossing& crossing : crossings) {
    border.border_length += crossing.share * crossing.length;
    n_sides += crossing.share;
    if (std::pair(std::abs(crossing.angle), crossing.angle) >
        std::pair(std::abs(border.max_angle), border.max_angle)) {
      border.max_angle = crossing.angle;
    }
  }
  const bool has_length = border.border_length > 0.0;
  const double total = has_length ? border.border_length : n_sides;
  for (const Crossing& crossing : crossings) {
    const double weight = crossing.share * (has_length ? crossing.length : 1.0) / total;
    border.mean_angle += weight * std::abs(crossing.angle);
    border.signed_angle += weight * crossing.angle;
  }
  border.n_sides = std::llround(n_sides);
  return border;
}

}  // namespace

RegionShapes::RegionShapes(std::size_t n_regions)
    : measures(n_regions),
      centroids(n_regions),
      squares(n_regions),
      products(n_regions),
      normal_sums(n_regions),
      lows(n_regions),
      highs(n_regions),
      open_lengths(n_regions),
      centers(n_regions) {}

RegionShapes measure_regions(const Surface& surface, std::span<const Label> labels, Label n_regions,
                             ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  const Members members(labels, n_regions);
  RegionShapes shapes(n_regions);
  team.for_each_block(
      n_regions,
      [&](std::int64_t begin, std::int64_t end) {
        for (std::int64_t region = begin; region < end; ++region) {
          measure_region(surface, members.of(region), region, shapes);
        }
      },
      kRegionBlock);
  return shapes;
}

std::vector<RegionArc> region_arcs(const Surface& surface, std::span<const Label> labels,
                                   ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  const std::vector<Crossing> crossings = sorted_crossings(surface, labels, team);
  std::vector<RegionArc> arcs;
  for (auto first = crossings.begin(); first != crossings.end();) {
    const auto last = std::find_if(first, crossings.end(), [&](const Crossing& crossing) {
      return crossing.low != first->low || crossing.high != first->high;
    });
    arcs.push_back(sum_border({first, last}));
    first = last;
  }
  return arcs;
}

}  // namespace superfacets
