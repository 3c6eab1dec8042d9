#include "regions/patches.hpp"

namespace superfacets {
namespace {

constexpr Patch kNoPatch = -1;

// The minimum number of border cells per patch is between kSmallestPatch and kLargestPatch. The
// data of kLargestPatch cells fits into the cache of a processor core. On small meshes, patches are
// smaller, so that there are kManyPatches patches for several threads.
constexpr std::int64_t kLargestPatch = 1024;
constexpr std::int64_t kSmallestPatch = 64;
constexpr std::int64_t kManyPatches = 512;

// Minimum number of colors. A patch has about six adjacent patches, so fewer colors would suffice.
// But two patches may become adjacent when cells between them move. With more colors, these two
// patches rarely have the same color.
constexpr std::size_t kFewestColors = 8;

class PatchMaker {
 public:
  PatchMaker(const Arcs& arcs, std::span<const Label> labels, const Lists<Cell>& border)
      : arcs_(arcs),
        labels_(labels),
        border_(border),
        least_cells_(
            std::clamp(std::ssize(border.entries) / kManyPatches, kSmallestPatch, kLargestPatch)),
        last_seen_by_(border.n_lists(), kNoPatch),
        n_cells_(kFewestColors, 0),
        last_forbidden_by_(kFewestColors, kNoPatch) {
    patches_.of_region.assign(border.n_lists(), kNoPatch);
  }

  Patches make() {
    for (Label region = 0; region < border_.n_lists(); ++region) {
      if (patches_.of_region[region] != kNoPatch) continue;
      for (Label seed = region; seed != kNoLabel;) seed = grow(seed);
    }
    patches_.of_color.resize(n_cells_.size());
    for (Patch patch = 0; patch < patches_.n_patches(); ++patch) {
      patches_.of_color[patches_.colors[patch]].push_back(patch);
    }
    return std::move(patches_);
  }

 private:
  // Builds a patch that begins with the region `seed`. Returns the first adjacent region outside
  // the patch, or kNoLabel.
  Label grow(Label seed) {
    const Patch patch = patches_.n_patches();
    reached_.assign(1, seed);
    std::int64_t n_cells = 0;
    std::size_t n_taken = 0;
    while (n_taken < reached_.size() && n_cells < least_cells_) {
      const Label region = reached_[n_taken++];
      patches_.of_region[region] = patch;
      n_cells += std::ssize(border_[region]);
      reach_neighbors(region, patch);
    }
    patches_.colors.push_back(choose_color(patch, n_cells));
    return n_taken < reached_.size() ? reached_[n_taken] : kNoLabel;
  }

  void reach_neighbors(Label region, Patch patch) {
    for (const Cell cell : border_[region]) {
      for (const Cell neighbor : arcs_.neighbors(cell)) {
        const Label other = labels_[neighbor];
        if (last_seen_by_[other] == patch) continue;
        last_seen_by_[other] = patch;
        const Patch known = patches_.of_region[other];
        if (known == kNoPatch) {
          reached_.push_back(other);
        } else if (known != patch) {
          last_forbidden_by_[patches_.colors[known]] = patch;
        }
      }
    }
  }

  std::int32_t choose_color(Patch patch, std::int64_t n_cells) {
    std::size_t best = n_cells_.size();
    for (std::size_t color = 0; color < n_cells_.size(); ++color) {
      if (last_forbidden_by_[color] == patch) continue;
      if (best == n_cells_.size() || n_cells_[color] < n_cells_[best]) best = color;
    }
    if (best == n_cells_.size()) {
      n_cells_.push_back(0);
      last_forbidden_by_.push_back(kNoPatch);
    }
    n_cells_[best] += n_cells;
    return static_cast<std::int32_t>(best);
  }

  const Arcs& arcs_;
  const std::span<const Label> labels_;
  const Lists<Cell>& border_;
  const std::int64_t least_cells_;  // minimum number of border cells per patch
  Patches patches_;
  std::vector<Label> reached_;         // regions of the current patch, and regions adjacent to it
  std::vector<Patch> last_seen_by_;    // (K,) last patch that reached each region
  std::vector<std::int64_t> n_cells_;  // number of border cells of each color
  std::vector<Patch> last_forbidden_by_;  // last patch with a neighbor of each color
};

}  // namespace

Patches make_patches(const Arcs& arcs, std::span<const Label> labels, const Lists<Cell>& border) {
  return PatchMaker(arcs, labels, border).make();
}

}  // namespace superfacets
