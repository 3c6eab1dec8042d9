#include "regions/region_graph.hpp"

#include "base/lists.hpp"
#include "regions/borders.hpp"

namespace superfacets {
namespace {

// Number of regions per task. A small number suffices, because most regions have hundreds of cells.
constexpr std::int64_t kRegionBlock = 8;

// Sums over the cells of a region. Positions are relative to the first cell, to avoid cancellation
// far from the origin.
struct Sums {
  double measure = 0.0;
  Point moment{0.0, 0.0, 0.0};     // sum of measure times position
  Point positions{0.0, 0.0, 0.0};  // unweighted sum of the positions
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

// Second moment about the centroid, weighted by measure, or unweighted if all measures are 0.
SecondMoment moment_about(const Surface& surface, std::span<const Cell> cells,
                          const Point& centroid, double total_measure) {
  SecondMoment moment;
  for (const Cell cell : cells) {
    const CellShape shape = surface.shape(cell);
    const double fraction = total_measure > 0.0 ? shape.measure / total_measure
                                                : 1.0 / static_cast<double>(cells.size());
    moment.add(fraction, shape.spread);
    moment.add(fraction, shape.position - centroid);
  }
  return moment;
}

Cell nearest_cell(const Surface& surface, std::span<const Cell> cells, const Point& to) {
  Cell nearest = cells.front();
  double least = kInfinity;
  for (const Cell cell : cells) {
    const double distance = squared_norm(surface.position(cell) - to);
    if (distance < least) {
      least = distance;
      nearest = cell;
    }
  }
  return nearest;
}

RegionShape measure_region(const Surface& surface, std::span<const Cell> cells) {
  const Point origin = surface.position(cells.front());
  const Sums sums = sum_cells(surface, cells, origin);
  const bool has_measure = sums.measure > 0.0;
  const double weight = has_measure ? sums.measure : static_cast<double>(cells.size());
  const Point& moment = has_measure ? sums.moment : sums.positions;
  // Divides by the weight, because 1 / weight may overflow to infinity for a tiny weight.
  const Point centroid = origin + Point{moment.x / weight, moment.y / weight, moment.z / weight};
  const SecondMoment covariance = moment_about(surface, cells, centroid, sums.measure);
  return {sums.measure,        centroid,         covariance.squares,
          covariance.products, sums.area_vector, sums.box.low,
          sums.box.high,       sums.open_length, nearest_cell(surface, cells, centroid)};
}

// An arc between two regions. If several arcs cross the same side between the same two regions, the
// length of the side is divided among them.
struct Crossing {
  Label low;
  Label high;
  std::int64_t arc;
  double fraction;  // fraction of the side's length that belongs to this arc
  double length;
  double angle;
};

// Collects the arcs that cross borders between regions.
class CrossingFinder {
 public:
  CrossingFinder(const Surface& surface, std::span<const Label> labels)
      : surface_(surface), labels_(labels) {}

  // Appends the arcs of a cell that cross borders.
  void add_arcs_of(Cell cell, std::vector<Crossing>& found) const {
    if (labels_[cell] == kNoLabel || !surface_.arcs().is_at_border(cell, labels_)) return;
    surface_.for_each_side(
        cell, [&](std::int64_t begin, std::int64_t end) { add_side(cell, begin, end, found); });
  }

 private:
  // Whether an arc is counted. If an arc has a reverse arc, only the arc from the lower region is
  // counted.
  bool is_counted(Cell cell, Cell neighbor) const {
    const Label own = labels_[cell];
    const Label other = labels_[neighbor];
    if (other == kNoLabel || own == other) return false;
    if (own < other) return true;
    return surface_.may_have_one_way_arcs() && !surface_.arcs().leads_to(neighbor, cell);
  }

  void add_side(Cell cell, std::int64_t begin, std::int64_t end,
                std::vector<Crossing>& found) const {
    const std::span<const Cell> neighbors = surface_.arcs().targets.subspan(begin, end - begin);
    // sorted labels of the cells at the side; empty if there are only two cells
    std::vector<Label> on_side;
    if (neighbors.size() > 1) {
      on_side.push_back(labels_[cell]);
      for (const Cell neighbor : neighbors) on_side.push_back(labels_[neighbor]);
      std::ranges::sort(on_side);
    }
    const auto count = [&](Label label) {
      const auto [first, last] = std::equal_range(on_side.begin(), on_side.end(), label);
      return on_side.empty() ? 1.0 : static_cast<double>(last - first);
    };
    for (std::int64_t arc = begin; arc < end; ++arc) {
      const Cell neighbor = surface_.arcs().targets[arc];
      if (!is_counted(cell, neighbor)) continue;
      const auto [low, high] = std::minmax(labels_[cell], labels_[neighbor]);
      found.push_back({low, high, arc, 1.0 / (count(low) * count(high)),
                       surface_.border_length(cell, arc), surface_.angle(cell, arc)});
    }
  }

  const Surface& surface_;
  const std::span<const Label> labels_;
};

// Computes the border between two regions from the arcs that cross it.
RegionArc sum_border(std::span<const Crossing> crossings) {
  RegionArc border{crossings.front().low, crossings.front().high, 0.0, 0.0, 0.0, 0.0, 0};
  double n_sides = 0.0;
  for (const Crossing& crossing : crossings) {
    border.border_length += crossing.fraction * crossing.length;
    n_sides += crossing.fraction;
    if (std::pair(std::abs(crossing.angle), crossing.angle) >
        std::pair(std::abs(border.max_angle), border.max_angle)) {
      border.max_angle = crossing.angle;
    }
  }
  const bool has_length = border.border_length > 0.0;
  const double total = has_length ? border.border_length : n_sides;
  for (const Crossing& crossing : crossings) {
    const double weight = crossing.fraction * (has_length ? crossing.length : 1.0) / total;
    border.mean_angle += weight * std::abs(crossing.angle);
    border.signed_angle += weight * crossing.angle;
  }
  border.n_sides = std::llround(n_sides);
  return border;
}

}  // namespace

std::vector<RegionShape> measure_regions(const Surface& surface, std::span<const Label> labels,
                                         Label n_regions, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  const Lists<Cell> members = group<Cell>(n_regions, [&](const auto& add) {
    for (Cell cell = 0; cell < surface.n_cells(); ++cell) {
      if (labels[cell] != kNoLabel) add(labels[cell], cell);
    }
  });
  std::vector<RegionShape> shapes(n_regions);
  const auto measure = [&](Label region) {
    shapes[region] = measure_region(surface, members[region]);
  };
  team.for_each_index(n_regions, measure, kRegionBlock);
  return shapes;
}

std::vector<RegionArc> region_arcs(const Surface& surface, std::span<const Label> labels,
                                   ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  const CrossingFinder finder(surface, labels);
  Buffer<Crossing> crossings = gather<Crossing>(
      surface.n_cells(),
      [&](Cell cell, std::vector<Crossing>& found) { finder.add_arcs_of(cell, found); }, team);
  sort_crossings(crossings);
  std::vector<RegionArc> arcs;
  for (const Crossing* first = crossings.data(); first != crossings.end();) {
    const Crossing* const last =
        std::find_if(first, std::as_const(crossings).end(), [&](const Crossing& crossing) {
          return crossing.low != first->low || crossing.high != first->high;
        });
    arcs.push_back(sum_border({first, last}));
    first = last;
  }
  return arcs;
}

}  // namespace superfacets
