#include "regions/shared_masks.hpp"

#include <functional>
#include <numeric>
#include <queue>
#include <tuple>

namespace superfacets {
namespace {

struct MaskedArea {
  std::int32_t mask;
  double area;
};

using Row = std::vector<MaskedArea>;  // areas of one group in each mask, sorted by mask

// Two groups that may be joined.
struct Pair {
  double agreement;
  Label low;
  Label high;

  bool operator<(const Pair& other) const {
    return std::tuple(agreement, -low, -high) <
           std::tuple(other.agreement, -other.low, -other.high);
  }
};

// Groups of regions. Groups are numbered like the nodes of a merge tree: 0 to K-1 are the regions,
// and each join creates the next number.
class MaskGroups {
 public:
  MaskGroups(const MaskedAreas& seen, double least)
      : seen_(seen), least_(least), rows_(seen.offsets.size() - 1), owners_(seen.image_of.size()) {
    for (std::size_t region = 0; region < rows_.size(); ++region) {
      for (std::int64_t i = seen.offsets[region]; i < seen.offsets[region + 1]; ++i) {
        rows_[region].push_back({seen.masks[i], seen.areas[i]});
        owners_[seen.masks[i]].push_back(static_cast<Label>(region));
      }
    }
    parents_.resize(rows_.size());
    std::iota(parents_.begin(), parents_.end(), 0);
  }

  Buffer<Label> join_all() {
    const std::size_t n_regions = rows_.size();
    for (std::size_t region = 0; region < n_regions; ++region) {
      offer(static_cast<Label>(region), /*only_lower=*/true);
    }
    while (!queue_.empty()) {
      const Pair next = queue_.top();
      queue_.pop();
      if (is_joined(next.low) || is_joined(next.high)) continue;
      join(next.low, next.high);
    }
    return numbered(n_regions);
  }

 private:
  bool is_joined(Label group) const { return parents_[group] != group; }

  void join(Label low, Label high) {
    const auto joined = static_cast<Label>(rows_.size());
    rows_.push_back(sum_of(std::exchange(rows_[low], {}), std::exchange(rows_[high], {})));
    parents_[low] = parents_[high] = joined;
    parents_.push_back(joined);
    for (const MaskedArea& entry : rows_[joined]) {
      std::vector<Label>& owners = owners_[entry.mask];
      std::erase_if(owners, [&](Label owner) { return owner == low || owner == high; });
      owners.push_back(joined);
    }
    offer(joined, /*only_lower=*/false);
  }

  // Queues a pair for each group that shares a mask with this group.
  void offer(Label group, bool only_lower) {
    std::vector<Label> others;
    for (const MaskedArea& entry : rows_[group]) {
      const std::vector<Label>& owners = owners_[entry.mask];
      std::copy_if(owners.begin(), owners.end(), std::back_inserter(others),
                   [&](Label owner) { return only_lower ? owner < group : owner != group; });
    }
    std::sort(others.begin(), others.end());
    others.erase(std::unique(others.begin(), others.end()), others.end());
    for (const Label other : others) {
      const auto [low, high] = std::minmax(group, other);
      const double agreement = agreement_of(rows_[low], rows_[high]);
      if (agreement >= least_) queue_.push({agreement, low, high});
    }
  }

  // Computes the agreement of two groups by traversing their sorted rows, image by image.
  double agreement_of(const Row& low, const Row& high) const {
    double same = 0.0, any = 0.0;
    std::size_t i = 0, j = 0;
    while (i < low.size() && j < high.size()) {
      const std::int32_t image = image_of(low[i]), other = image_of(high[j]);
      if (image < other) {
        i = end_of_image(low, i);
      } else if (other < image) {
        j = end_of_image(high, j);
      } else {
        const std::size_t i_end = end_of_image(low, i), j_end = end_of_image(high, j);
        any += sum(low, i, i_end) * sum(high, j, j_end);
        same += product(low, {i, i_end}, high, {j, j_end});
        i = i_end;
        j = j_end;
      }
    }
    return any > 0.0 ? same / any : 0.0;
  }

  std::int32_t image_of(const MaskedArea& entry) const { return seen_.image_of[entry.mask]; }

  std::size_t end_of_image(const Row& row, std::size_t begin) const {
    std::size_t end = begin + 1;
    while (end < row.size() && image_of(row[end]) == image_of(row[begin])) ++end;
    return end;
  }

  static double sum(const Row& row, std::size_t begin, std::size_t end) {
    double total = 0.0;
    for (std::size_t i = begin; i < end; ++i) total += row[i].area;
    return total;
  }

  using Range = std::pair<std::size_t, std::size_t>;

  static double product(const Row& low, Range of_low, const Row& high, Range of_high) {
    double total = 0.0;
    auto [i, i_end] = of_low;
    auto [j, j_end] = of_high;
    while (i < i_end && j < j_end) {
      if (low[i].mask == high[j].mask) total += low[i].area * high[j].area;
      const bool is_behind = low[i].mask <= high[j].mask;
      j += low[i].mask >= high[j].mask;
      i += is_behind;
    }
    return total;
  }

  static Row sum_of(const Row& low, const Row& high) {
    Row sums;
    sums.reserve(low.size() + high.size());
    std::size_t j = 0;
    for (const MaskedArea& entry : low) {
      while (j < high.size() && high[j].mask < entry.mask) sums.push_back(high[j++]);
      sums.push_back(entry);
      if (j < high.size() && high[j].mask == entry.mask) sums.back().area += high[j++].area;
    }
    sums.insert(sums.end(), high.begin() + static_cast<std::ptrdiff_t>(j), high.end());
    return sums;
  }

  // The group of each region. Groups are numbered in the order of their lowest regions.
  Buffer<Label> numbered(std::size_t n_regions) const {
    std::vector<Label> roots = parents_;
    for (std::size_t node = roots.size(); node-- > 0;) roots[node] = roots[parents_[node]];
    std::vector<Label> number_of(roots.size(), kNoLabel);
    Buffer<Label> groups(n_regions);
    Label n_groups = 0;
    for (std::size_t region = 0; region < n_regions; ++region) {
      Label& number = number_of[roots[region]];
      if (number == kNoLabel) number = n_groups++;
      groups[region] = number;
    }
    return groups;
  }

  const MaskedAreas& seen_;
  const double least_;
  std::vector<Row> rows_;  // row of each group; empty after the group has been joined
  // For each mask, the groups that have an area in this mask.
  std::vector<std::vector<Label>> owners_;
  std::vector<Label> parents_;  // parent of each group; the group itself if it has not been joined
  std::priority_queue<Pair> queue_;
};

}  // namespace

Buffer<Label> join_by_masks(const MaskedAreas& seen, double least) {
  SUPERFACETS_ASSERT(least > 0.0 && !seen.offsets.empty());
  SUPERFACETS_ASSERT(std::is_sorted(seen.image_of.begin(), seen.image_of.end()));
  return MaskGroups(seen, least).join_all();
}

}  // namespace superfacets
