#include "clustering/classification.hpp"

#include "base/lists.hpp"

namespace superfacets {
namespace {

bool are_distinct(std::span<const Place> centers) {
  std::vector<Place> sorted(centers.begin(), centers.end());
  std::ranges::sort(sorted);
  return std::ranges::adjacent_find(sorted) == sorted.end();
}

}  // namespace

Classification::Classification(const OrderedGraph& graph, double reach, Islands islands,
                               PathArrays* paths, ThreadTeam& team)
    : graph_(graph),
      islands_(islands),
      team_(team),
      exact_(paths == nullptr ? Expansion(graph, team) : Expansion(graph, std::move(*paths), team)),
      has_paths_(paths != nullptr) {
  if (std::isfinite(reach)) halted_.emplace(graph, reach, team);
}

void Classification::classify(std::span<const Place> centers) {
  SUPERFACETS_ASSERT(!centers.empty() && all_below(centers, graph_.n_cells()));
  SUPERFACETS_ASSERT(are_distinct(centers));
  centers_.assign(centers.begin(), centers.end());
  // Paths can be reused only if every arc has a reverse arc of equal length. Otherwise the path
  // from the new center to the old center may be longer than the path in the other direction.
  const bool is_update = !started_.empty() && centers.size() >= started_.size();
  if (is_update && graph_.is_symmetric) {
    start_moved();
  } else if (!std::exchange(has_paths_, false)) {
    start_all();
  }
  exact_.run();
  started_ = centers_;
  if (halted_) {
    halted_->correct(exact_, centers_);
    if (islands_ == Islands::kKeep) halted_->adopt_orphans(exact_, centers_);
  } else if (islands_ == Islands::kKeep && may_have_orphans_) {
    adopt_orphans();
  }
  SUPERFACETS_ASSERT(is_complete());
}

// Whether each center has its own label and, if islands_ is kKeep, each cell has a label.
bool Classification::is_complete() const {
  for (Place place = 0; place < graph_.n_cells(); ++place) {
    const Label label = path(place).label;
    const bool is_missing = label == kNoLabel && islands_ == Islands::kKeep;
    if (is_missing || label < kNoLabel || label >= std::ssize(centers_)) return false;
  }
  return std::ranges::all_of(centers_, [&](Place center) {
    return path(center).length == 0 && centers_[path(center).label] == center;
  });
}

void Classification::start_all() {
  exact_.clear();
  may_have_orphans_ = true;
  for (std::size_t label = 0; label < centers_.size(); ++label) {
    exact_.start(centers_[label], static_cast<Label>(label));
  }
}

// When a center moves, all path lengths of its region are increased by the length of the path from
// the new center to the old center. So the lengths remain valid upper bounds, and no path has to be
// reset. Shorter paths from the new center then replace nearly all paths of its region, and few
// paths of other regions.
void Classification::start_moved() {
  std::vector<PathLength> detours(started_.size(), 0);
  for (std::size_t label = 0; label < started_.size(); ++label) {
    if (centers_[label] == started_[label]) continue;
    const Path path = exact_.path(centers_[label]);
    const bool is_inside = std::cmp_equal(path.label, label);
    detours[label] = is_inside ? path.length : kUnreached;
    if (!is_inside) may_have_orphans_ = true;
  }
  exact_.lengthen(detours);
  for (std::size_t label = 0; label < centers_.size(); ++label) {
    const bool has_stayed = label < started_.size() && centers_[label] == started_[label];
    if (!has_stayed) exact_.start(centers_[label], static_cast<Label>(label));
  }
}

void Classification::adopt_orphans() {
  const auto add_orphan = [&](Place place, std::vector<Place>& found) {
    if (exact_.path(place).label == kNoLabel) found.push_back(place);
  };
  Buffer<Place> orphans = gather<Place>(graph_.n_cells(), add_orphan, team_);
  std::ranges::sort(orphans,
                    [&](Place a, Place b) { return graph_.cell_at(a) < graph_.cell_at(b); });
  for (const Place orphan : orphans) {
    if (exact_.path(orphan).label != kNoLabel) continue;
    exact_.start(orphan, static_cast<Label>(centers_.size()));
    centers_.push_back(orphan);
    exact_.run();
  }
  started_ = centers_;
  may_have_orphans_ = false;
}

}  // namespace superfacets
