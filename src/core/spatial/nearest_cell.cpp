#include "spatial/nearest_cell.hpp"

#include "mesh/shapes.hpp"
#include "spatial/box_tree.hpp"
#include "spatial/morton.hpp"

namespace superfacets {
namespace {

// Number of shapes per leaf. With 4, queries take 20% longer; with 1, 10% longer.
constexpr std::size_t kShapesPerLeaf = 2;

// Number of queries per task. Each query of a task, except the first, starts with the result of the
// previous query, which is usually near.
constexpr std::int64_t kQueriesPerTask = 1 << 11;

// Maximum number of queries with the same Morton code that are sorted by position only.
constexpr std::size_t kQueriesTogether = 64;

// The best result so far. Of two cells at the same distance, the lower one is better. Initially,
// `squared` is the squared limit, and `cell` is higher than every valid cell, so a cell at exactly
// the limit is accepted.
struct Answer {
  double squared;
  Cell cell = std::numeric_limits<Cell>::max();
  Place place = kNoPlace;

  bool is_found() const { return place != kNoPlace; }
};

// Shapes sorted along a space-filling curve, with a box tree.
template <typename Shape>
class ShapeSearch {
 public:
  template <typename ShapeOf>
  ShapeSearch(std::int64_t n_shapes, const ShapeOf& shape_of, ThreadTeam& team)
      : shapes_(n_shapes) {
    const auto box_of = [&](std::int64_t cell) { return shape_of(cell).box(); };
    cells_ = order_of_boxes(n_shapes, box_of, kShapesPerLeaf, team);
    const auto take_place = [&](std::size_t place) {
      shapes_[place] = shape_of(cells_[place]);
      return shapes_[place].box();
    };
    tree_ = BoxTree(shapes_.size(), kShapesPerLeaf, take_place, team);
  }

  // Finds the nearest shape within a squared distance. `hint` is the result of another query. The
  // search is fast if the two queries are near each other. The hint does not affect the result.
  Answer nearest_to(const Point& p, double max_squared, const Answer& hint) const {
    Answer best{max_squared};
    if (hint.is_found()) offer(p, hint.place, best);
    const auto squared_distance = [&](std::size_t level, std::size_t index) {
      return tree_.level(level)[index].squared_distance(p);
    };
    // Boxes at exactly the best distance are visited too, because they may contain a cell with a
    // lower index.
    tree_.visit_nearest(squared_distance, best.squared, [&](std::size_t begin, std::size_t end) {
      for (auto place = begin; place < end; ++place) offer(p, static_cast<Place>(place), best);
    });
    return best;
  }

 private:
  void offer(const Point& p, Place place, Answer& best) const {
    const double squared = squared_norm(p - shapes_[place].nearest(p));
    const Cell cell = cells_[place];
    if (squared > best.squared || (squared == best.squared && cell > best.cell)) return;
    best = {squared, cell, place};
  }

  Buffer<Cell> cells_;    // input index of each sorted shape
  Buffer<Shape> shapes_;  // shapes in sorted order
  BoxTree tree_;
};

template <typename ShapeOf>
NearestCells find_nearest(std::int64_t n_shapes, const ShapeOf& shape_of,
                          std::span<const Point> queries, double max_distance, ThreadTeam& team) {
  const ShapeSearch<decltype(shape_of(0))> shapes(n_shapes, shape_of, team);
  const std::size_t n = queries.size();
  NearestCells found{Buffer<Cell>(n), Buffer<double>(n)};
  const Buffer<Cell> order = refined_morton_order(queries, kQueriesTogether, team);
  const auto answer_range = [&](std::int64_t begin, std::int64_t end) {
    Answer answer{};
    for (auto i = begin; i < end; ++i) {
      const Cell query = order[i];
      const Point& p = queries[query];
      answer = shapes.nearest_to(p, max_distance * max_distance, answer);
      const bool is_found = answer.is_found();
      found.cells[query] = is_found ? answer.cell : kNoCell;
      found.distances[query] = is_found ? std::sqrt(answer.squared) : kInfinity;
    }
  };
  team.for_each_block(static_cast<std::int64_t>(n), answer_range, kQueriesPerTask);
  return found;
}

}  // namespace

NearestCells nearest_triangles(std::span<const Point> vertices, std::span<const Triangle> triangles,
                               std::span<const Point> queries, double max_distance,
                               ThreadTeam& team) {
  const auto shape_of = [&](std::int64_t cell) {
    const auto& [a, b, c] = triangles[cell].corners;
    return TriangleShape(vertices[a], vertices[b], vertices[c]);
  };
  return find_nearest(std::ssize(triangles), shape_of, queries, max_distance, team);
}

NearestCells nearest_tets(std::span<const Point> vertices, std::span<const Tet> tets,
                          std::span<const Point> queries, double max_distance, ThreadTeam& team) {
  const auto shape_of = [&](std::int64_t cell) {
    const auto& [a, b, c, d] = tets[cell].corners;
    return TetShape(vertices[a], vertices[b], vertices[c], vertices[d]);
  };
  return find_nearest(std::ssize(tets), shape_of, queries, max_distance, team);
}

NearestCells nearest_points(std::span<const Point> points, std::span<const Point> queries,
                            double max_distance, ThreadTeam& team) {
  const auto shape_of = [&](std::int64_t cell) { return PointShape{points[cell]}; };
  return find_nearest(std::ssize(points), shape_of, queries, max_distance, team);
}

}  // namespace superfacets
