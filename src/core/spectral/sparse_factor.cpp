#include "spectral/sparse_factor.hpp"

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "base/assert.hpp"

namespace superfacets {

SparseFactor::SparseFactor(const Arcs& arcs, std::span<const double> conductances,
                           std::span<const double> diagonal) {
  const Cell n_cells = arcs.n_cells();
  std::vector<double> left(diagonal.begin(), diagonal.end());  // diagonal of the reduced matrix
  std::vector<Row> rows(n_cells);                              // its off-diagonal entries
  std::set<std::pair<std::size_t, Cell>> queue;
  for (Cell cell = 0; cell < n_cells; ++cell) {
    for (const auto [arc, neighbor] : arcs.steps(cell)) {
      rows[cell].push_back({neighbor, -conductances[arc]});
    }
    std::ranges::sort(rows[cell], [](const Entry& a, const Entry& b) { return a.cell < b.cell; });
    queue.insert({rows[cell].size(), cell});
  }
  Row merged;
  while (!queue.empty()) {
    const Cell cell = queue.begin()->second;
    queue.erase(queue.begin());
    const Row row = std::move(rows[cell]);
    const double pivot = left[cell];
    SUPERFACETS_ASSERT(pivot > 0.0);
    for (const auto& [neighbor, value] : row) {
      const double factor = value / pivot;
      queue.erase({rows[neighbor].size(), neighbor});
      left[neighbor] -= factor * value;
      subtract(row, factor, {cell, neighbor}, rows[neighbor], merged);
      queue.insert({rows[neighbor].size(), neighbor});
      entries_.push_back({neighbor, factor});
    }
    order_.push_back(cell);
    pivots_.push_back(pivot);
    starts_.push_back(entries_.size());
  }
}

// Subtracts a multiple of the row of the eliminated cell from the row of a neighbor, and removes
// the entry of that cell. Diagonals are stored separately.
void SparseFactor::subtract(const Row& pivot_row, double factor, const Elimination& step, Row& row,
                            Row& merged) {
  merged.clear();
  auto here = row.begin();
  const auto copy_up_to = [&](Cell column) {
    for (; here != row.end() && here->cell < column; ++here) {
      if (here->cell != step.cell) merged.push_back(*here);
    }
  };
  for (const auto& [column, value] : pivot_row) {
    if (column == step.neighbor) continue;
    copy_up_to(column);
    const bool is_there = here != row.end() && here->cell == column;
    merged.push_back({column, (is_there ? here->value : 0.0) - factor * value});
    if (is_there) ++here;
  }
  copy_up_to(std::numeric_limits<Cell>::max());
  row = merged;
}

void SparseFactor::solve(std::span<double> rows, std::size_t width) const {
  SUPERFACETS_ASSERT(rows.size() == order_.size() * width);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const double* here = rows.data() + width * order_[i];
    for (std::size_t e = starts_[i]; e < starts_[i + 1]; ++e) {
      double* there = rows.data() + width * entries_[e].cell;
      for (std::size_t c = 0; c < width; ++c) there[c] -= entries_[e].value * here[c];
    }
  }
  for (std::size_t i = order_.size(); i-- > 0;) {
    double* here = rows.data() + width * order_[i];
    const double inverse = 1.0 / pivots_[i];
    for (std::size_t c = 0; c < width; ++c) here[c] *= inverse;
    for (std::size_t e = starts_[i]; e < starts_[i + 1]; ++e) {
      const double* there = rows.data() + width * entries_[e].cell;
      for (std::size_t c = 0; c < width; ++c) here[c] -= entries_[e].value * there[c];
    }
  }
}

}  // namespace superfacets
