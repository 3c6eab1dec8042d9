#include "regions/smooth.hpp"

#include <cstring>

namespace superfacets {
namespace {

// Number of cells per block when the marks are scanned.
constexpr std::int64_t kBlock = 1 << 14;

// Maximum number of arcs of a cell that are searched for a reverse arc.
constexpr std::size_t kMaxArcs = 256;

// Prefetch distance: data is prefetched this number of cells in advance. Trying to move this many
// cells takes longer than a cache miss.
constexpr std::size_t kAhead = 4;

// Set of cells from which chains will be tried. Several threads may add cells at the same time.
class WaitingCells {
 public:
  // Initially contains all cells.
  WaitingCells(std::size_t n_cells, ThreadTeam& team) : is_waiting_(n_cells) {
    team.fill(is_waiting_.span(), std::uint8_t{1});
  }

  void add(Cell cell) {
    const std::atomic_ref<std::uint8_t> mark(is_waiting_[cell]);
    if (mark.load(std::memory_order_relaxed) == 0) mark.store(1, std::memory_order_relaxed);
  }
  void remove(Cell cell) { is_waiting_[cell] = 0; }

  // Empties the set. Returns the removed cells for which is_wanted is true, as one ascending list
  // per block.
  template <typename Condition>
  std::vector<std::vector<Cell>> take_if(const Condition& is_wanted, ThreadTeam& team) {
    const auto n_cells = static_cast<std::int64_t>(is_waiting_.size());
    std::vector<std::vector<Cell>> lists((n_cells + kBlock - 1) / kBlock);
    const auto take = [&](std::int64_t begin, std::int64_t end) {
      std::vector<Cell>& list = lists[begin / kBlock];
      while (begin < end) {
        const void* found = std::memchr(&is_waiting_[begin], 1, end - begin);
        if (found == nullptr) return;
        begin = static_cast<const std::uint8_t*>(found) - is_waiting_.data();
        is_waiting_[begin] = 0;
        const auto cell = static_cast<Cell>(begin++);
        if (is_wanted(cell)) list.push_back(cell);
      }
    };
    team.for_each_block(n_cells, take, kBlock);
    return lists;
  }

 private:
  Buffer<std::uint8_t> is_waiting_;
};

class Smoother {
 public:
  Smoother(MovingRegions& regions, const RegionSums& at_first, const SmoothOptions& options,
           ThreadTeam& team)
      : regions_(regions),
        stiffness_(regions.surface(), at_first, regions.labels(), options.stiff),
        waiting_(regions.labels().size(), team),
        team_(team) {
    const auto lists = take_border_cells();
    patches_ = make_patches(regions.arcs(), regions.labels(), by_region(lists));
    cells_ = by_patch(lists);
    for (int thread = 0; thread < team.size(); ++thread) {
      movers_.emplace_back(regions, patches_, stiffness_, options.chains);
    }
  }

  void run(int max_sweeps) {
    for (int sweep = 0; sweep < max_sweeps && cells_.entries.size() > 0; ++sweep) {
      for (const std::vector<Patch>& patches : patches_.of_color) sweep_patches(patches);
      cells_ = by_patch(take_border_cells());
    }
  }

 private:
  using BorderCells = std::vector<std::vector<Cell>>;

  BorderCells take_border_cells() {
    return waiting_.take_if([&](Cell cell) { return regions_.is_at_border(cell); }, team_);
  }

  template <typename GroupOf>
  static Lists<Cell> grouped(const BorderCells& lists, std::int64_t n_groups,
                             const GroupOf& group_of) {
    return group<Cell>(n_groups, [&](const auto& add) {
      for (const std::vector<Cell>& list : lists) {
        for (const Cell cell : list) add(group_of(cell), cell);
      }
    });
  }

  Lists<Cell> by_region(const BorderCells& lists) const {
    const std::span<const Label> labels = regions_.labels();
    // Includes regions without cells at borders. One-way arcs may lead into such a region.
    const Label n_regions = *std::ranges::max_element(labels) + 1;
    return grouped(lists, n_regions, [&](Cell cell) { return labels[cell]; });
  }

  Lists<Cell> by_patch(const BorderCells& lists) const {
    return grouped(lists, patches_.n_patches(), [&](Cell cell) { return patch_of(cell); });
  }

  Patch patch_of(Cell cell) const { return patches_.of_region[regions_.label(cell)]; }

  // Processes patches of one color in parallel. These patches are not adjacent, but two of them may
  // be adjacent to the same region, and both change its area. Areas are therefore updated after all
  // patches have finished.
  void sweep_patches(const std::vector<Patch>& patches) {
    tasks_.clear();
    std::copy_if(patches.begin(), patches.end(), std::back_inserter(tasks_),
                 [&](Patch patch) { return !cells_[patch].empty(); });
    std::vector<std::vector<AreaChange>> changes(tasks_.size());
    team_.for_each(std::ssize(tasks_), [&](std::int64_t task, int thread) {
      sweep_patch(tasks_[task], movers_[thread]);
      changes[task] = movers_[thread].take_changes();
    });
    for (const std::vector<AreaChange>& of_patch : changes) stiffness_.add(of_patch);
  }

  void sweep_patch(Patch patch, ChainMover& mover) {
    const std::span<const Cell> cells = cells_[patch];
    for (std::size_t i = 0; i < cells.size(); ++i) {
      prefetch_ahead(cells, i);
      const Cell cell = cells[i];
      if (patch_of(cell) != patch) continue;  // the cell has moved to a region of another patch
      waiting_.remove(cell);
      for (const Cell moved : mover.try_moves(cell)) {
        waiting_.add(moved);
        for (const Cell neighbor : regions_.arcs().neighbors(moved)) waiting_.add(neighbor);
      }
    }
  }

  // Prefetches in stages, because each address depends on data that was prefetched in an earlier
  // stage.
  void prefetch_ahead(std::span<const Cell> cells, std::size_t i) const {
    const auto ahead = [&](std::size_t n) { return cells[std::min(i + n, cells.size() - 1)]; };
    regions_.prefetch_cell(ahead(4 * kAhead));
    regions_.prefetch_arcs(ahead(3 * kAhead));
    for (const Cell near : regions_.arcs().neighbors(ahead(2 * kAhead))) {
      regions_.prefetch_cell(near);
    }
    for (const Cell near : regions_.arcs().neighbors(ahead(kAhead))) regions_.prefetch_arcs(near);
  }

  MovingRegions& regions_;
  Stiffness stiffness_;
  WaitingCells waiting_;
  ThreadTeam& team_;
  Patches patches_;
  Lists<Cell> cells_;  // cells from which chains are tried in this sweep, grouped by patch
  std::vector<Patch> tasks_;
  std::vector<ChainMover> movers_;  // one ChainMover per thread
};

// Whether each arc has a reverse arc; false if a cell has too many arcs to search.
bool all_lead_back(const Arcs& arcs, ThreadTeam& team) {
  std::atomic<bool> lead_back = true;
  const auto leads_back = [&](Cell from, Cell to) {
    const std::span<const Cell> returning = arcs.neighbors(to);
    return returning.size() <= kMaxArcs && std::ranges::find(returning, from) != returning.end();
  };
  team.for_each_block(arcs.n_cells(), [&](std::int64_t begin, std::int64_t end) {
    for (auto cell = static_cast<Cell>(begin); cell < end && lead_back; ++cell) {
      for (const Cell neighbor : arcs.neighbors(cell)) {
        if (!leads_back(cell, neighbor)) lead_back = false;
      }
    }
  });
  return lead_back;
}

void smooth(MovingRegions& regions, const RegionSums& at_first, const SmoothOptions& options,
            ThreadTeam& team) {
  const Surface& surface = regions.surface();
  if (surface.may_have_one_way_arcs() && !all_lead_back(surface.arcs(), team)) {
    // If arcs have no reverse arcs, adjacent patches may get the same color, so a single thread
    // processes all patches.
    ThreadTeam alone(1);
    Smoother(regions, at_first, options, alone).run(options.max_sweeps);
  } else {
    Smoother(regions, at_first, options, team).run(options.max_sweeps);
  }
}

}  // namespace

Buffer<Label> smooth_borders(const Surface& surface, const BorderCosts& costs,
                             std::span<const Label> labels, std::span<const Cell> fixed,
                             const SmoothOptions& options, ThreadTeam& team) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_cells()));
  SUPERFACETS_ASSERT(std::ssize(costs.lengths) == surface.arcs().n_arcs() &&
                     costs.crease_scale > 0.0);
  SUPERFACETS_ASSERT(all_below(fixed, surface.n_cells()) && options.chains.max_distance >= 0.0);
  const bool is_stiff = options.stiff.stiffness > 0.0;
  const RegionSums at_first = is_stiff ? sums_of_regions(surface, labels, team) : RegionSums();
  MovingRegions regions(surface, costs, labels, fixed, team);
  smooth(regions, at_first, options, team);
  return std::move(regions).take_labels();
}

}  // namespace superfacets
