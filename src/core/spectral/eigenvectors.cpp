#include "spectral/eigenvectors.hpp"

#include <bit>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

#include "base/versions.hpp"

namespace superfacets {
namespace {

// Number of additional vectors in the iteration, which speed up convergence. Each iteration reduces
// the error of the wanted vectors by the ratio of the largest wanted eigenvalue to the lowest
// eigenvalue outside the iterated subspace.
constexpr std::size_t kMoreVectors = 10;
// Usual number of iterated vectors, for which loops are compiled: 15 wanted vectors plus
// kMoreVectors.
constexpr std::size_t kUsualWidth = 25;
constexpr int kMaxIterations = 40;
// Maximum relative change of the eigenvalues in the last iteration.
constexpr double kTolerance = 1e-3;

// Relative shift. L is singular, so kShift trace(L) / trace(A) times A is added to L. The shift is
// later subtracted from the eigenvalues.
constexpr double kShift = 1e-9;

// A small dense square matrix, stored row by row.
class Square {
 public:
  explicit Square(std::size_t size) : size_(size), values_(size * size, 0.0) {}
  double& operator()(std::size_t row, std::size_t column) { return values_[row * size_ + column]; }
  double operator()(std::size_t row, std::size_t column) const {
    return values_[row * size_ + column];
  }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_;
  std::vector<double> values_;
};

Square product(const Square& a, const Square& b, bool is_transposed) {
  const std::size_t n = a.size();
  Square c(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      const double factor = is_transposed ? a(k, i) : a(i, k);
      for (std::size_t j = 0; j < n; ++j) c(i, j) += factor * b(k, j);
    }
  }
  return c;
}

// Calls loop(width). If the width is kUsualWidth, it is passed as a compile-time constant.
template <typename Loop>
SUPERFACETS_ALWAYS_INLINE void with_width(std::size_t width, const Loop& loop) {
  if (width == kUsualWidth) {
    loop(std::integral_constant<std::size_t, kUsualWidth>());
  } else {
    loop(width);
  }
}

// A Jacobi rotation: rotates the rows and columns p and q of a symmetric matrix, so that the entry
// (p, q) becomes 0. Applies the same rotation to the rows of `vectors`.
void rotate(Square& matrix, Square& vectors, std::size_t p, std::size_t q) {
  if (matrix(p, q) == 0.0) return;
  const double ratio = (matrix(q, q) - matrix(p, p)) / (2.0 * matrix(p, q));
  const double tangent =
      (ratio < 0.0 ? -1.0 : 1.0) / (std::abs(ratio) + std::sqrt(1.0 + ratio * ratio));
  const double cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
  const double sine = tangent * cosine;
  const auto turn = [&](double& one, double& other) {
    const double before = one;
    one = cosine * before - sine * other;
    other = sine * before + cosine * other;
  };
  for (std::size_t i = 0; i < matrix.size(); ++i) turn(matrix(i, p), matrix(i, q));
  for (std::size_t i = 0; i < matrix.size(); ++i) turn(matrix(p, i), matrix(q, i));
  for (std::size_t i = 0; i < matrix.size(); ++i) turn(vectors(p, i), vectors(q, i));
}

// Jacobi's eigenvalue method. Replaces the matrix by the diagonal matrix of its eigenvalues, in any
// order. Returns the eigenvectors as columns.
Square diagonalize(Square& matrix) {
  constexpr int kMaxSweeps = 30;
  constexpr double kNegligible = 1e-28;  // relative to the sum of the squares of all entries
  const std::size_t n = matrix.size();
  Square vectors(n);
  for (std::size_t i = 0; i < n; ++i) vectors(i, i) = 1.0;
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double beside = 0.0;
    double all = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        all += matrix(i, j) * matrix(i, j);
        if (i != j) beside += matrix(i, j) * matrix(i, j);
      }
    }
    if (beside <= kNegligible * all) break;
    for (std::size_t p = 0; p + 1 < n; ++p) {
      for (std::size_t q = p + 1; q < n; ++q) rotate(matrix, vectors, p, q);
    }
  }
  Square columns(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) columns(j, i) = vectors(i, j);
  }
  return columns;
}

// Priority queue of the cells that are not eliminated yet, ordered by their number of neighbors.
class DegreeQueue {
 public:
  explicit DegreeQueue(Cell n_cells) : n_words_((n_cells + kBits - 1) / kBits) {}

  void insert(std::size_t degree, Cell cell) {
    while (sets_.size() <= degree) sets_.emplace_back(n_words_, 0);
    sets_[degree][cell / kBits] |= bit_of(cell);
    lowest_ = std::min(lowest_, degree);
  }
  void erase(std::size_t degree, Cell cell) { sets_[degree][cell / kBits] &= ~bit_of(cell); }

  // Removes and returns the lowest cell of minimum degree, or kNoCell.
  Cell take() {
    for (; lowest_ < sets_.size(); ++lowest_) {
      const Words& set = sets_[lowest_];
      const auto word = std::ranges::find_if(set, [](std::uint64_t bits) { return bits != 0; });
      if (word == set.end()) continue;
      const auto cell = static_cast<Cell>(kBits * (word - set.begin()) + std::countr_zero(*word));
      erase(lowest_, cell);
      return cell;
    }
    return kNoCell;
  }

 private:
  using Words = std::vector<std::uint64_t>;
  static constexpr int kBits = 64;
  static std::uint64_t bit_of(Cell cell) { return std::uint64_t{1} << (cell % kBits); }

  const std::size_t n_words_;
  std::vector<Words> sets_;  // [degree] bit set of the cells with this degree
  std::size_t lowest_ = 0;   // lower bound of the degrees of all cells
};

// Pseudorandom number from -1 to 1, the same for the same index on every platform (splitmix64).
double noise(std::uint64_t index) {
  std::uint64_t bits = (index + 1) * 0x9e3779b97f4a7c15U;
  bits = (bits ^ (bits >> 30U)) * 0xbf58476d1ce4e5b9U;
  bits = (bits ^ (bits >> 27U)) * 0x94d049bb133111ebU;
  bits ^= bits >> 31U;
  return static_cast<double>(bits >> 11U) * 0x1p-52 - 1.0;
}

// Sparse LDL^T factorization M = P^T F D F^T P of a symmetric, positive definite matrix M, whose
// off-diagonal entries correspond to the arcs of a graph. The graph should have at most a few
// thousand cells, and must have at most one arc from each cell to another cell. Cells are
// eliminated in the order of minimum degree, then of index. On graphs of surfaces, the factor has
// about n log n entries.
class SparseFactor {
 public:
  // `diagonal` is the diagonal of M. The other entries are the negative conductances of the arcs.
  // Each arc must have a reverse arc with the same conductance.
  SparseFactor(const Arcs& arcs, std::span<const double> conductances,
               std::span<const double> diagonal) {
    const Cell n_cells = arcs.n_cells();
    std::vector<double> left(diagonal.begin(), diagonal.end());  // diagonal of the reduced matrix
    std::vector<Row> rows(n_cells);  // off-diagonal entries of the reduced matrix
    DegreeQueue queue(n_cells);
    for (Cell cell = 0; cell < n_cells; ++cell) {
      for (const auto [arc, neighbor] : arcs.steps(cell)) {
        rows[cell].push_back({neighbor, -conductances[arc]});
      }
      std::ranges::sort(rows[cell], {}, &Entry::cell);
      queue.insert(rows[cell].size(), cell);
    }
    Row merged;
    for (Cell cell = queue.take(); cell != kNoCell; cell = queue.take()) {
      const Row row = std::move(rows[cell]);
      const double pivot = left[cell];
      SUPERFACETS_ASSERT(pivot > 0.0);
      for (const auto& [neighbor, value] : row) {
        const double factor = value / pivot;
        queue.erase(rows[neighbor].size(), neighbor);
        left[neighbor] -= factor * value;
        subtract(row, factor, {cell, neighbor}, rows[neighbor], merged);
        queue.insert(rows[neighbor].size(), neighbor);
        entries_.push_back({neighbor, factor});
      }
      order_.push_back(cell);
      pivots_.push_back(pivot);
      starts_.push_back(entries_.size());
    }
  }

  // Solves M X = B. On entry, `rows` contains B as n rows of `width` numbers. On return, it
  // contains X.
  void solve(std::span<double> rows, std::size_t width) const {
    SUPERFACETS_ASSERT(rows.size() == order_.size() * width);
    run_version(best_instruction_set(), Solve{*this}, rows, width);
  }

 private:
  struct Entry {
    Cell cell;
    double value;
  };
  using Row = std::vector<Entry>;  // entries sorted by cell

  struct Elimination {
    Cell cell;
    Cell neighbor;  // cell whose row is updated
  };

  // Subtracts a multiple of the eliminated cell's row from the row of a neighbor, and removes the
  // entry of the eliminated cell. The diagonal is stored separately.
  static void subtract(const Row& pivot_row, double factor, const Elimination& step, Row& row,
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

  // The forward and backward substitution of solve(), compiled for several instruction sets.
  struct Solve {
    const SparseFactor& of;

    SUPERFACETS_ALWAYS_INLINE void operator()(std::span<double> rows, std::size_t any_width) const {
      with_width(any_width, [&](const auto width) {
        forwards(rows.data(), width);
        backwards(rows.data(), width);
      });
    }

    template <typename Width>
    SUPERFACETS_ALWAYS_INLINE void forwards(double* rows, const Width width) const {
      for (std::size_t i = 0; i < of.order_.size(); ++i) {
        const double* here = rows + width * of.order_[i];
        for (std::size_t e = of.starts_[i]; e < of.starts_[i + 1]; ++e) {
          double* there = rows + width * of.entries_[e].cell;
          for (std::size_t c = 0; c < width; ++c) there[c] -= of.entries_[e].value * here[c];
        }
      }
    }

    template <typename Width>
    SUPERFACETS_ALWAYS_INLINE void backwards(double* rows, const Width width) const {
      for (std::size_t i = of.order_.size(); i-- > 0;) {
        double* here = rows + width * of.order_[i];
        const double inverse = 1.0 / of.pivots_[i];
        for (std::size_t c = 0; c < width; ++c) here[c] *= inverse;
        for (std::size_t e = of.starts_[i]; e < of.starts_[i + 1]; ++e) {
          const double* there = rows + width * of.entries_[e].cell;
          for (std::size_t c = 0; c < width; ++c) here[c] -= of.entries_[e].value * there[c];
        }
      }
    }
  };

  std::vector<Cell> order_;             // cells in their order of elimination
  std::vector<double> pivots_;          // diagonal of D, in the order of elimination
  std::vector<std::size_t> starts_{0};  // start of each column of F in entries_
  std::vector<Entry> entries_;          // entries of the columns of F, without the unit diagonal
};

// Adds Y^T W X to `products`, where W is the diagonal matrix of the weights. If there are no
// weights, W is the identity.
struct AddGram {
  SUPERFACETS_ALWAYS_INLINE void operator()(const double* y, const double* x,
                                            std::span<const double> weights, std::size_t n_rows,
                                            std::pair<std::size_t, double*> products) const {
    with_width(products.first, [&](const auto width) {
      for (std::size_t row = 0; row < n_rows; ++row) {
        const double weight = weights.empty() ? 1.0 : weights[row];
        for (std::size_t i = 0; i < width; ++i) {
          const double factor = weight * y[row * width + i];
          double* sums = products.second + i * width;
          for (std::size_t j = 0; j < width; ++j) sums[j] += factor * x[row * width + j];
        }
      }
    });
  }
};

// Replaces each row by the product of the row and a square matrix.
struct Combine {
  SUPERFACETS_ALWAYS_INLINE void operator()(std::span<double> rows, std::span<double> combined,
                                            const double* matrix) const {
    with_width(combined.size(), [&](const auto width) {
      for (std::size_t first = 0; first < rows.size(); first += width) {
        for (std::size_t i = 0; i < width; ++i) combined[i] = 0.0;
        for (std::size_t k = 0; k < width; ++k) {
          const double value = rows[first + k];
          for (std::size_t i = 0; i < width; ++i) combined[i] += value * matrix[k * width + i];
        }
        for (std::size_t i = 0; i < width; ++i) rows[first + i] = combined[i];
      }
    });
  }
};

// Subspace iteration with the inverse of L + shift A, and a Rayleigh-Ritz step in each iteration.
class Subspace {
 public:
  Subspace(const Arcs& arcs, std::span<const double> conductances, std::span<const double> measures,
           std::span<const Label> components, Label n_components, std::size_t width)
      : measures_(measures),
        components_(components),
        n_components_(n_components),
        width_(width),
        shift_(shift_of(conductances, measures)),
        factor_(arcs, conductances, shifted_diagonal(arcs, conductances)),
        rows_(measures.size() * width),
        values_(width, 0.0) {
    for (std::size_t i = 0; i < rows_.size(); ++i) rows_[i] = noise(i);
    remove_constants();
  }

  // Runs one iteration. Returns the maximum relative change of the first n_wanted eigenvalues.
  double iterate(std::size_t n_wanted) {
    for (std::size_t cell = 0; cell < measures_.size(); ++cell) {
      for (double& value : row(cell)) value *= measures_[cell];
    }
    const std::vector<double> before = rows_;
    factor_.solve(rows_, width_);
    remove_constants();
    const std::vector<double> old = values_;
    take_ritz_vectors(gram(rows_, true), gram(before, false));
    double change = 0.0;
    for (std::size_t i = 0; i < n_wanted; ++i) {
      change = std::max(change, std::abs(values_[i] - old[i]) / values_[i]);
    }
    return change;
  }

  Eigenpairs first(std::size_t n_wanted) const {
    Eigenpairs pairs;
    for (std::size_t i = 0; i < n_wanted; ++i) {
      pairs.values.push_back(std::max(values_[i] - shift_, std::numeric_limits<double>::min()));
    }
    const std::vector<double> signs = signs_of(n_wanted);
    for (std::size_t cell = 0; cell < measures_.size(); ++cell) {
      for (std::size_t i = 0; i < n_wanted; ++i) {
        pairs.vectors.push_back(signs[i] * rows_[cell * width_ + i]);
      }
    }
    return pairs;
  }

 private:
  static double shift_of(std::span<const double> conductances, std::span<const double> measures) {
    const double trace = std::accumulate(conductances.begin(), conductances.end(), 0.0);
    return kShift * trace / std::accumulate(measures.begin(), measures.end(), 0.0);
  }

  std::vector<double> shifted_diagonal(const Arcs& arcs, std::span<const double> conductances) {
    std::vector<double> diagonal;
    for (Cell cell = 0; cell < arcs.n_cells(); ++cell) {
      diagonal.push_back(shift_ * measures_[cell]);
      for (const auto [arc, neighbor] : arcs.steps(cell)) diagonal.back() += conductances[arc];
    }
    return diagonal;
  }

  std::span<double> row(std::size_t cell) {
    return std::span(rows_).subspan(cell * width_, width_);
  }

  // Subtracts from each vector its weighted mean on each connected component. This makes the
  // vectors orthogonal to the eigenvectors with eigenvalue 0.
  void remove_constants() {
    std::vector<double> means(n_components_ * width_, 0.0);
    std::vector<double> totals(n_components_, 0.0);
    for (std::size_t cell = 0; cell < measures_.size(); ++cell) {
      double* mean = means.data() + width_ * components_[cell];
      totals[components_[cell]] += measures_[cell];
      for (std::size_t i = 0; i < width_; ++i) mean[i] += measures_[cell] * row(cell)[i];
    }
    for (std::size_t cell = 0; cell < measures_.size(); ++cell) {
      const double* mean = means.data() + width_ * components_[cell];
      const double total = totals[components_[cell]];
      for (std::size_t i = 0; i < width_; ++i) row(cell)[i] -= mean[i] / total;
    }
  }

  // Returns Y^T X, or Y^T A X if is_weighted is true, for Y = rows_ and X = `others`. Rounding
  // errors are removed by making the result symmetric.
  Square gram(std::span<const double> others, bool is_weighted) const {
    Square products(width_);
    run_version(best_instruction_set(), AddGram(), rows_.data(), others.data(),
                is_weighted ? measures_ : std::span<const double>(), measures_.size(),
                std::pair(width_, &products(0, 0)));
    for (std::size_t i = 0; i < width_; ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        products(i, j) = products(j, i) = 0.5 * (products(i, j) + products(j, i));
      }
    }
    return products;
  }

  // The Rayleigh-Ritz step: replaces the vectors in rows_ by linear combinations, in ascending
  // order of eigenvalues. The new vectors are orthonormal with respect to `masses`, and diagonalize
  // `energies`.
  void take_ritz_vectors(Square masses, const Square& energies) {
    Square basis = diagonalize(masses);
    double largest = 0.0;
    for (std::size_t i = 0; i < width_; ++i) largest = std::max(largest, masses(i, i));
    for (std::size_t i = 0; i < width_; ++i) {
      const double mass = std::max(masses(i, i), 1e-30 * largest);
      for (std::size_t row = 0; row < width_; ++row) basis(row, i) /= std::sqrt(mass);
    }
    Square reduced = product(basis, product(energies, basis, false), true);
    const Square turned = product(basis, diagonalize(reduced), false);
    std::vector<std::size_t> order(width_);
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(
        order, [&](std::size_t a, std::size_t b) { return reduced(a, a) < reduced(b, b); });
    for (std::size_t i = 0; i < width_; ++i) values_[i] = reduced(order[i], order[i]);
    Square sorted(width_);
    for (std::size_t k = 0; k < width_; ++k) {
      for (std::size_t i = 0; i < width_; ++i) sorted(k, i) = turned(k, order[i]);
    }
    std::vector<double> combined(width_);
    run_version(best_instruction_set(), Combine(), std::span(rows_), std::span(combined),
                &sorted(0, 0));
  }

  std::vector<double> signs_of(std::size_t n_wanted) const {
    std::vector<double> largest(n_wanted, 0.0);
    for (std::size_t cell = 0; cell < measures_.size(); ++cell) {
      for (std::size_t i = 0; i < n_wanted; ++i) {
        const double value = rows_[cell * width_ + i];
        if (std::abs(value) > std::abs(largest[i]) * (1.0 + 1e-6)) largest[i] = value;
      }
    }
    for (double& value : largest) value = value < 0.0 ? -1.0 : 1.0;
    return largest;
  }

  const std::span<const double> measures_;
  const std::span<const Label> components_;
  const std::size_t n_components_;
  const std::size_t width_;
  const double shift_;
  const SparseFactor factor_;
  // (n, width) iterated vectors: one row per cell, one column per vector.
  std::vector<double> rows_;
  std::vector<double> values_;  // (width,) eigenvalues, including the shift
};

}  // namespace

Eigenpairs smallest_eigenpairs(const Arcs& arcs, std::span<const double> conductances,
                               std::span<const double> measures, std::span<const Label> components,
                               Label n_components, std::size_t n_wanted) {
  const std::size_t n_there = measures.size() - static_cast<std::size_t>(n_components);
  n_wanted = std::min(n_wanted, n_there);
  if (n_wanted == 0) return {};
  const std::size_t width = std::min(n_wanted + kMoreVectors, n_there);
  Subspace subspace(arcs, conductances, measures, components, n_components, width);
  for (int i = 0; i < kMaxIterations && subspace.iterate(n_wanted) > kTolerance; ++i) {
  }
  return subspace.first(n_wanted);
}

}  // namespace superfacets
