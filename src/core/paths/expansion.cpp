#include "paths/expansion.hpp"

namespace superfacets {
namespace {

// Logarithm (base 2) of the number of cells in a chunk. A chunk, with its arcs and paths, takes at
// most a few megabytes, and its active part fits into the second-level cache. In small graphs,
// chunks are smaller, so that each thread has several chunks. Chunks must be large enough that most
// paths stay within their chunk.
constexpr int kMaxChunkBits = 17;
constexpr int kMinChunkBits = 13;
constexpr std::int64_t kChunksPerThread = 4;

// Maximum number of processed queue entries per cell of a chunk. Above this number, the chunk
// switches from the bucket queue to a heap. On meshes, a cell is processed once or twice.
constexpr std::size_t kMaxHandled = 4;

// Prefetch distances: arcs and paths are prefetched this number of cells in advance.
constexpr std::size_t kStartsAhead = 24;
constexpr std::size_t kArcsAhead = 16;
constexpr std::size_t kPathsAhead = 6;

int chunk_bits_for(std::int64_t n_cells, int n_threads) {
  if (n_threads == 1) return kMaxChunkBits;
  const auto wanted = static_cast<std::uint64_t>(n_cells / (kChunksPerThread * n_threads));
  return std::clamp(static_cast<int>(std::bit_width(wanted)), kMinChunkBits, kMaxChunkBits);
}

}  // namespace

Expansion::Expansion(const OrderedGraph& graph, ThreadTeam& team)
    : Expansion(graph, PathArrays(graph.n_cells()), team) {
  clear();
}

Expansion::Expansion(const OrderedGraph& graph, PathArrays&& paths, ThreadTeam& team)
    : graph_(graph),
      team_(team),
      chunk_bits_(chunk_bits_for(graph.n_cells(), team.size())),
      paths_(std::move(paths)),
      chunks_((static_cast<std::int64_t>(graph.n_cells()) + (1 << chunk_bits_) - 1) >> chunk_bits_),
      has_few_arcs_(graph.n_arcs <= OrderedGraph::kRow * std::int64_t{graph.n_cells()}),
      workers_(team.size(), Worker(graph.n_arcs)) {
  SUPERFACETS_ASSERT(std::cmp_equal(paths_.lengths.size(), graph.n_cells()) &&
                     paths_.labels.size() == paths_.lengths.size());
  for (Chunk& chunk : chunks_) chunk.has_changed = true;
}

std::pair<Place, Place> Expansion::places(std::int64_t chunk) const {
  const std::int64_t begin = chunk << chunk_bits_;
  const std::int64_t end = std::min<std::int64_t>(begin + (1 << chunk_bits_), graph_.n_cells());
  return {static_cast<Place>(begin), static_cast<Place>(end)};
}

void Expansion::clear() {
  team_.for_each(n_chunks(), [&](std::int64_t chunk, int) {
    const auto [begin, end] = places(chunk);
    std::fill(paths_.lengths.begin() + begin, paths_.lengths.begin() + end, kUnreached);
    std::fill(paths_.labels.begin() + begin, paths_.labels.begin() + end, kNoLabel);
    chunks_[chunk].waiting.clear();
    chunks_[chunk].has_changed = true;
  });
  active_.clear();
}

void Expansion::lengthen(std::span<const PathLength> by_label) {
  SUPERFACETS_ASSERT(graph_.is_symmetric && active_.empty());
  team_.for_each(n_chunks(), [&](std::int64_t chunk, int) { lengthen_chunk(chunk, by_label); });
  team_.for_each(n_chunks(), [&](std::int64_t chunk, int thread) {
    if (chunks_[chunk].has_changed) compare_labels(chunk, by_label, workers_[thread]);
  });
  deliver();
}

void Expansion::lengthen_chunk(std::int64_t chunk, std::span<const PathLength> by_label) {
  const auto [begin, end] = places(chunk);
  for (Place place = begin; place < end; ++place) {
    const Label label = paths_.labels[place];
    if (label == kNoLabel || by_label[label] == 0) continue;
    chunks_[chunk].has_changed = true;
    if (by_label[label] == kUnreached) {
      paths_.lengths[place] = kUnreached;
      paths_.labels[place] = kNoLabel;
    } else {
      paths_.lengths[place] += by_label[label];
    }
  }
}

// Adds a proposal for each arc between two regions that improves a path. Arcs within a region
// cannot improve a path, because all paths of the region were lengthened by the same amount. Paths
// are not written here, because other threads read them at the same time.
void Expansion::compare_labels(std::int64_t chunk, std::span<const PathLength> by_label,
                               Worker& worker) {
  const auto [begin, end] = places(chunk);
  for (Place place = begin; place < end; ++place) {
    const Label label = paths_.labels[place];
    if (label != kNoLabel && by_label[label] == 0) continue;
    for (const Arc arc : graph_.arcs_of(place)) {
      if (paths_.labels[arc.to] == label || paths_.labels[arc.to] == kNoLabel) continue;
      const Path other{longer_by(paths_.lengths[arc.to], arc), paths_.labels[arc.to]};
      if (other.is_better_than(path(place))) worker.proposals.push_back({place, other});
    }
  }
}

bool Expansion::improve(Place place, const Path& path) {
  if (!path.is_better_than(this->path(place))) return false;
  std::atomic_ref(paths_.lengths[place]).store(path.length, std::memory_order_relaxed);
  paths_.labels[place] = path.label;
  return true;
}

void Expansion::propose(const Proposal& proposal) {
  if (!improve(proposal.place, proposal.path)) return;
  SUPERFACETS_ASSERT(proposal.path.label >= 0);
  const std::int64_t chunk = proposal.place >> chunk_bits_;
  if (chunks_[chunk].waiting.empty()) active_.push_back(chunk);
  chunks_[chunk].waiting.push_back(proposal.place);
}

void Expansion::deliver() {
  for (Worker& worker : workers_) {
    for (const Proposal& proposal : worker.proposals) propose(proposal);
    worker.proposals.clear();
  }
}

void Expansion::run() {
  while (!active_.empty()) {
    const std::vector<std::int64_t> now = std::exchange(active_, {});
    team_.for_each(std::ssize(now), [&](std::int64_t task, int thread) {
      expand_chunk(now[task], workers_[thread]);
    });
    deliver();
  }
}

void Expansion::expand_chunk(std::int64_t chunk, Worker& worker) {
  SUPERFACETS_ASSERT(worker.queue.empty() && worker.heap.empty());
  chunks_[chunk].has_changed = true;
  auto& waiting = chunks_[chunk].waiting;
  PathLength lowest = kUnreached;
  for (const Place place : waiting) lowest = std::min(lowest, paths_.lengths[place]);
  worker.queue.restart(lowest);
  for (const Place place : waiting) worker.queue.push(paths_.lengths[place], place);
  waiting.clear();

  const auto [begin, end] = places(chunk);
  const std::size_t n_allowed = kMaxHandled * (end - begin);
  while (!worker.queue.empty()) {
    if (worker.queue.n_handled() > n_allowed) return expand_in_order(chunk, worker);
    const std::vector<Place>& taken = worker.queue.take();
    for (std::size_t i = 0; i < taken.size(); ++i) {
      if (i + kStartsAhead < taken.size()) graph_.prefetch_start(taken[i + kStartsAhead]);
      if (i + kArcsAhead < taken.size()) graph_.arcs_of(taken[i + kArcsAhead]).prefetch();
      // Prefetches paths only if cells have few arcs. Otherwise their targets are usually in the
      // cache already.
      if (has_few_arcs_ && i + kPathsAhead < taken.size()) {
        graph_.arcs_of(taken[i + kPathsAhead]).for_each([&](std::size_t, Arc arc) {
          prefetch(&paths_.lengths[arc.to]);
          prefetch(&paths_.labels[arc.to]);
        });
      }
      if (worker.queue.is_stale(paths_.lengths[taken[i]])) continue;
      if (has_few_arcs_) {
        expand_row(taken[i], chunk, worker, worker.queue);
      } else {
        expand(taken[i], chunk, worker, worker.queue);
      }
    }
  }
}

// Continues with Dijkstra's algorithm, starting from all cells in the queue.
void Expansion::expand_in_order(std::int64_t chunk, Worker& worker) {
  worker.heap.restart();
  worker.queue.drain([&](Place place) { worker.heap.push(paths_.lengths[place], place); });
  while (!worker.heap.empty()) {
    const auto [length, place] = worker.heap.pop();
    if (length == paths_.lengths[place]) expand(place, chunk, worker, worker.heap);
  }
}

// Relaxes all arcs that leave a cell.
template <typename Queue>
void Expansion::expand(Place place, std::int64_t chunk, Worker& worker, Queue& queue) {
  const Path path = this->path(place);
  for (const Arc arc : graph_.arcs_of(place)) {
    const PathLength longer = longer_by(path.length, arc);
    if (longer <= length(arc.to)) {
      relax({arc.to, {longer, path.label}}, chunk, worker, queue);
    }
  }
}

// Relaxes the arcs of a cell that has at most kRow arcs. Branches on single arcs are unpredictable,
// so all arcs of the row are compared before the first branch.
template <typename Queue>
void Expansion::expand_row(Place place, std::int64_t chunk, Worker& worker, Queue& queue) {
  const Path path = this->path(place);
  const ArcList row = graph_.arcs_of(place);
  if (row.size() > OrderedGraph::kRow) return expand(place, chunk, worker, queue);
  std::array<PathLength, OrderedGraph::kRow> longer{};
  std::array<Place, OrderedGraph::kRow> targets{};
  unsigned improved = 0;  // bit i is set if arc i may improve a path
  row.for_each([&](std::size_t i, Arc arc) {
    longer[i] = longer_by(path.length, arc);
    targets[i] = arc.to;
    improved |= static_cast<unsigned>(longer[i] <= length(arc.to)) << i;
  });
  for (; improved != 0; improved &= improved - 1) {
    const int i = std::countr_zero(improved);
    relax({targets[i], {longer[i], path.label}}, chunk, worker, queue);
  }
}

template <typename Queue>
void Expansion::relax(const Proposal& proposal, std::int64_t chunk, Worker& worker, Queue& queue) {
  if (proposal.place >> chunk_bits_ != chunk) {
    worker.proposals.push_back(proposal);
  } else if (improve(proposal.place, proposal.path)) {
    queue.push(proposal.path.length, proposal.place);
  }
}

}  // namespace superfacets
