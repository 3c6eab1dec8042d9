#include "regions/share_vertices.hpp"

#include "base/lists.hpp"

namespace superfacets {
namespace {

class VertexSharer {
 public:
  VertexSharer(Lists<Vertex> own, std::span<const Label> winners)
      : own_(std::move(own)), labels_(copy_of(winners)), counts_(own_.n_lists()) {
    for (const Label label : labels_) {
      if (label != kNoLabel) ++counts_[label];
    }
    for (Label region = 0; region < own_.n_lists(); ++region) {
      if (counts_[region] == 0 && !own_[region].empty()) lost_.push_back(region);
    }
  }

  // Each round finds as many disjoint shortest chains as possible.
  void run() {
    while (find_levels()) {
      std::erase_if(lost_, [&](Label region) { return take_vertex(region); });
    }
  }

  Buffer<Label> take() && { return std::move(labels_); }

 private:
  static constexpr std::int32_t kNoLevel = -1;

  // A region of a chain. The previous region takes its only vertex.
  struct Link {
    Label region;
    std::size_t next;  // number of vertices in own_[region] that have been tried
  };

  // Breadth-first search from all regions without a vertex. Returns whether a region is reached
  // that can take a vertex from a region with several; last_level_ is the level of the first.
  bool find_levels() {
    levels_.assign(own_.n_lists(), kNoLevel);
    for (const Label region : lost_) levels_[region] = 0;
    std::vector<Label> reached = lost_;
    last_level_ = kNoLevel;
    for (std::size_t i = 0; i < reached.size(); ++i) {
      const std::int32_t level = levels_[reached[i]];
      if (last_level_ != kNoLevel && level > last_level_) break;
      for (const Vertex vertex : own_[reached[i]]) {
        const Label giver = labels_[vertex];
        if (counts_[giver] > 1) {
          last_level_ = level;
          break;
        }
        if (levels_[giver] != kNoLevel) continue;
        levels_[giver] = level + 1;
        reached.push_back(giver);
      }
    }
    return last_level_ != kNoLevel;
  }

  // Depth-first search for a chain from a region without a vertex. Returns whether it was found.
  // Each region is in at most one chain of a round.
  bool take_vertex(Label region) {
    chain_.assign({{region, 0}});
    while (!chain_.empty()) {
      auto& [taker, next] = chain_.back();
      if (next == own_[taker].size()) {
        levels_[taker] = kNoLevel;
        chain_.pop_back();
        continue;
      }
      const Label giver = labels_[own_[taker][next++]];
      const std::int32_t level = levels_[taker];
      if (level == last_level_ && counts_[giver] > 1) {
        --counts_[giver];
        ++counts_[region];
        move_along_chain();
        return true;
      }
      if (level < last_level_ && levels_[giver] == level + 1) chain_.push_back({giver, 0});
    }
    return false;
  }

  void move_along_chain() {
    for (const auto& [taker, next] : chain_) {
      labels_[own_[taker][next - 1]] = taker;
      levels_[taker] = kNoLevel;
    }
  }

  Lists<Vertex> own_;  // vertices at the corners of each region, ascending
  Buffer<Label> labels_;
  std::vector<std::int64_t> counts_;  // number of vertices of each region
  std::vector<Label> lost_;           // regions without a vertex, ascending
  // Number of chain links from a region without a vertex to each region; kNoLevel if the region is
  // not reached, or must not be tried again in this round.
  std::vector<std::int32_t> levels_;
  std::int32_t last_level_ = kNoLevel;
  std::vector<Link> chain_;
};

}  // namespace

Buffer<Label> share_vertices(const LabeledCorners& corners, std::span<const Label> winners,
                             ThreadTeam& team) {
  SUPERFACETS_ASSERT(corners.vertices.size() == corners.labels.size() &&
                     all_below(corners.labels, corners.n_labels) &&
                     all_below(corners.vertices, std::ssize(winners)));
  Lists<Vertex> own = group<Vertex>(corners.n_labels, [&](const auto& add) {
    for (std::size_t i = 0; i < corners.labels.size(); ++i) {
      add(corners.labels[i], corners.vertices[i]);
    }
  });
  sort_unique(own, team);
  VertexSharer sharer(std::move(own), winners);
  sharer.run();
  return std::move(sharer).take();
}

}  // namespace superfacets
