#include "regions/shared_masks.hpp"

#include <functional>
#include <numeric>
#include <queue>
#include <tuple>

#include "base/lists.hpp"

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
    sort_unique(others);
    for (const Label other : others) {
      const auto [low, high] = std::minmax(group, other);
      const double agreement = agreement_of(rows_[low], rows_[high]);
      if (agreement >= least_) queue_.push({agreement, low, high});
    }
  }

  using Entries = std::span<const MaskedArea>;

  // Computes the agreement of two groups by traversing their sorted rows, image by image.
  double agreement_of(Entries low, Entries high) const {
    double same = 0.0, any = 0.0;
    while (!low.empty() && !high.empty()) {
      const std::int32_t image = image_of(low.front()), other = image_of(high.front());
      if (image < other) {
        take_image(low);
      } else if (other < image) {
        take_image(high);
      } else {
        const Entries of_low = take_image(low), of_high = take_image(high);
        any += sum(of_low) * sum(of_high);
        same += product(of_low, of_high);
      }
    }
    return any > 0.0 ? same / any : 0.0;
  }

  std::int32_t image_of(const MaskedArea& entry) const { return seen_.image_of[entry.mask]; }

  // Removes and returns the entries of the first image.
  Entries take_image(Entries& rest) const {
    std::size_t n = 1;
    while (n < rest.size() && image_of(rest[n]) == image_of(rest[0])) ++n;
    return std::exchange(rest, rest.subspan(n)).first(n);
  }

  static double sum(Entries entries) {
    double total = 0.0;
    for (const MaskedArea& entry : entries) total += entry.area;
    return total;
  }

  static double product(Entries low, Entries high) {
    double total = 0.0;
    auto other = high.begin();
    for (const MaskedArea& entry : low) {
      while (other != high.end() && other->mask < entry.mask) ++other;
      if (other != high.end() && other->mask == entry.mask) total += entry.area * other->area;
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
