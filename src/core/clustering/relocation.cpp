#include "clustering/relocation.hpp"

#include "paths/second_paths.hpp"

namespace superfacets {
namespace {

// Fraction of a region's distortion that a second center is expected to remove.
constexpr double kGain = 0.5;

// Value of kGain for graphs with a crease limit (see OrderedGraph::crease_limit). This value is
// lower than kGain, because one region per side of a machine part matters more than regions of
// equal size.
constexpr double kGainWithCreaseLimit = 0.25;

// Path lengths above this multiple of the mean path length count as this multiple. Few regular
// regions have longer paths. Without a limit, expensive arcs around a few cells attract centers and
// hold them there: on the benchmark models, there are 1.3 to 1.6 times as many regions below a
// tenth of the mean area.
// Graphs with a crease limit have no limit of lengths, because narrow sides need centers.
constexpr double kMaxLength = 4.0;

struct Need {
  // Cost of removing the center; infinite if a cell has no second-nearest center.
  double removal_cost = 0.0;
  double distortion = 0.0;  // sum of A d1^2 over the region; see relocate_centers
  Place farthest = 0;       // cell with the longest path from the center
};

// Length of the paths to all cells, averaged by measure. The sum runs over one region after
// another.
double mean_length(const OrderedGraph& graph, std::span<const Path> nearest,
                   const Lists<Place>& regions, ThreadTeam& team) {
  std::vector<double> sums(regions.n_lists(), 0.0);
  team.for_each(std::ssize(sums), [&](std::int64_t label, int) {
    for (const Place place : regions[label]) {
      sums[label] += graph.measures[place] * static_cast<double>(nearest[place].length);
    }
  });
  const double total = std::accumulate(sums.begin(), sums.end(), 0.0);
  return graph.total_measure > 0.0 ? total / graph.total_measure : 0.0;
}

// Computes removal cost, distortion and farthest cell of a region, given as a list of its cells.
// `most` limits path lengths in the first two.
Need need_of(const OrderedGraph& graph, std::span<const Path> nearest,
             std::span<const Path> seconds, std::span<const Place> region, double most) {
  Need need;
  need.farthest = region.front();
  for (const Place place : region) {
    const PathLength length = nearest[place].length;
    const double first = std::min(most, static_cast<double>(length));
    const double measure = graph.measures[place];
    need.distortion += measure * first * first;
    if (seconds[place].length == kUnreached) {
      need.removal_cost = std::numeric_limits<double>::infinity();
    } else {
      const double second = std::min(most, static_cast<double>(seconds[place].length));
      need.removal_cost += measure * (second - first) * (second + first);
    }
    const PathLength longest = nearest[need.farthest].length;
    const bool is_lower = graph.cell_at(place) < graph.cell_at(need.farthest);
    if (length > longest || (length == longest && is_lower)) need.farthest = place;
  }
  return need;
}

// All labels, in ascending order of (key, label).
template <typename Key>
std::vector<Label> sorted_labels(std::size_t n_regions, const Key& key) {
  std::vector<Label> labels(n_regions);
  std::iota(labels.begin(), labels.end(), Label{0});
  std::ranges::stable_sort(labels, [&](Label a, Label b) { return key(a) < key(b); });
  return labels;
}

// The role of a region in one relocation.
enum class Role : std::uint8_t { kNone, kStays, kLeaves, kReceives };

}  // namespace

std::vector<Place> relocate_centers(const OrderedGraph& graph, std::span<const Path> nearest,
                                    std::span<const Place> centers, std::size_t n_moves,
                                    ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(nearest.size(), graph.n_cells()));
  const Lists<Place> regions = regions_of(nearest, static_cast<Label>(centers.size()));
  const Buffer<Path> seconds = second_paths(graph, nearest, regions, team);
  const bool has_limit = !std::isinf(graph.crease_limit);
  const double most =
      has_limit ? HUGE_VAL : kMaxLength * mean_length(graph, nearest, regions, team);
  std::vector<Need> needs(centers.size());
  team.for_each(std::ssize(needs), [&](std::int64_t label, int) {
    needs[label] = need_of(graph, nearest, seconds.span(), regions[label], most);
  });
  std::vector<Label> leaving =
      sorted_labels(needs.size(), [&](Label label) { return needs[label].removal_cost; });
  leaving.resize(std::min(leaving.size(), n_moves));
  const std::vector<Label> receiving =
      sorted_labels(needs.size(), [&](Label label) { return -needs[label].distortion; });

  std::vector<Place> moved(centers.begin(), centers.end());
  std::vector<Role> roles(centers.size(), Role::kNone);
  const double gain = has_limit ? kGainWithCreaseLimit : kGain;
  auto next = receiving.begin();
  for (const Label label : leaving) {
    if (roles[label] != Role::kNone) continue;
    next = std::find_if(next, receiving.end(), [&](Label other) {
      return other != label && roles[other] != Role::kLeaves;
    });
    if (next == receiving.end()) break;
    const Need& neediest = needs[*next];
    if (!(needs[label].removal_cost < gain * neediest.distortion)) break;
    moved[label] = neediest.farthest;
    roles[label] = Role::kLeaves;
    roles[*next] = Role::kReceives;
    for (const Place place : regions[label]) {
      Role& role = roles[seconds[place].label];
      if (role == Role::kNone) role = Role::kStays;
    }
    ++next;
  }
  return moved;
}

}  // namespace superfacets
