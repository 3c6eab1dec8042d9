#include "cells/ray_thickness.hpp"

#include <array>
#include <limits>
#include <numbers>

#include "base/arctangent.hpp"
#include "cells/box_tree.hpp"
#include "cells/morton.hpp"

namespace superfacets {
namespace {

constexpr std::size_t kTrianglesPerLeaf = 4;
constexpr std::int64_t kStartsPerTask = 32;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr double kCosHalfAngle = 0.5;  // 60 degrees
constexpr double kSoftening = 0.2;     // radians: the ray along the axis has a finite weight
constexpr double kLeastShare = 0.25;   // of the rays must leave

constexpr std::size_t kFanOut = BoxTree::kFanOut;

// The boxes below a node, each coordinate in an array of its own, for vectorized loops. Rounded to
// the outside.
struct Boxes {
  std::array<std::array<float, kFanOut>, 3> low;
  std::array<std::array<float, kFanOut>, 3> high;

  void set(std::size_t i, const Box& box) {
    const std::array<double, 3> lows{box.low.x, box.low.y, box.low.z};
    const std::array<double, 3> highs{box.high.x, box.high.y, box.high.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      low[axis][i] = below(lows[axis]);
      high[axis][i] = -below(-highs[axis]);
    }
  }

 private:
  static float below(double value) {
    const auto rounded = static_cast<float>(value);
    return std::nextafter(rounded, -std::numeric_limits<float>::infinity());
  }
};

struct Ray {
  Ray(const Point& start, const Point& direction)
      : from(start),
        along(direction),
        origin{static_cast<float>(from.x), static_cast<float>(from.y), static_cast<float>(from.z)},
        inverse{invert(along.x), invert(along.y), invert(along.z)} {}

  // A large number stands for infinity, whose product with 0 is none.
  static float invert(double x) {
    constexpr double kLeast = 1e-15;
    return static_cast<float>(1.0 / (std::abs(x) < kLeast ? std::copysign(kLeast, x) : x));
  }

  Point from;
  Point along;
  std::array<float, 3> origin;
  std::array<float, 3> inverse;
};

// Where a ray enters boxes: at most the distance of anything in them; more than where it leaves
// those that it passes by. kSlack makes up for the rounding of the ray.
void enter(const Boxes& boxes, const Ray& ray, std::array<float, kFanOut>& enters,
           std::array<float, kFanOut>& leaves) {
  constexpr float kSlack = 1e-6F;
  enters.fill(0.0F);
  leaves.fill(1e30F);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float origin = ray.origin[axis];
    const float inverse = ray.inverse[axis];
    const auto& low = inverse < 0.0F ? boxes.high[axis] : boxes.low[axis];
    const auto& high = inverse < 0.0F ? boxes.low[axis] : boxes.high[axis];
    const float slack = inverse < 0.0F ? -kSlack : kSlack;
    for (std::size_t i = 0; i < kFanOut; ++i) {
      const float near = (low[i] - slack - origin) * inverse;
      const float far = (high[i] + slack - origin) * inverse;
      enters[i] = near > enters[i] ? near : enters[i];
      leaves[i] = far < leaves[i] ? far : leaves[i];
    }
  }
}

struct Hit {
  double distance;
  bool is_exit = false;
};

// A triangle as rays meet it.
struct Target {
  Point corner;
  Point first;  // edges from the corner
  Point second;

  // Points on edges belong to both triangles, so that no ray slips through between them.
  void offer(const Ray& ray, double least, bool inside_out, Hit& best) const {
    constexpr double kEdge = 1e-12;
    const Point p = cross(ray.along, second);
    const double determinant = dot(first, p);  // minus the normal times the ray
    if (determinant == 0.0) return;
    const double sign = determinant < 0.0 ? -1.0 : 1.0;
    const double size = sign * determinant;  // that u, v and the distance are multiplied by
    const Point to_start = ray.from - corner;
    const double u = sign * dot(to_start, p);
    if (u < -kEdge * size || u > (1.0 + kEdge) * size) return;
    const Point q = cross(to_start, first);
    const double v = sign * dot(ray.along, q);
    if (v < -kEdge * size || u + v > (1.0 + kEdge) * size) return;
    const double distance = sign * dot(second, q) / size;
    const bool is_nearer = distance > least && distance < best.distance;
    if (is_nearer) best = {distance, (determinant < 0.0) != inside_out};
  }
};

// The triangles of a mesh, and a tree of boxes over them.
class RayTree {
 public:
  RayTree(std::span<const Point> vertices, std::span<const Triangle> triangles, ThreadTeam& team)
      : targets_(triangles.size()) {
    set_unit(vertices, triangles);
    const auto corner = [&](Vertex vertex) { return local(vertices[vertex]); };
    const auto box_of = [&](std::int64_t face) {
      Box box;
      for (const Vertex vertex : triangles[face].corners) box.include(corner(vertex));
      return box;
    };
    Buffer<Point> middles(triangles.size());  // times two
    team.for_each_block(std::ssize(triangles), [&](std::int64_t begin, std::int64_t end) {
      for (auto face = begin; face < end; ++face) {
        const Box box = box_of(face);
        middles[face] = box.low + box.high;
      }
    });
    const Buffer<Cell> faces = refined_morton_order(middles.span(), kTrianglesPerLeaf, team);
    const auto take_place = [&](std::size_t place) {
      const auto& [a, b, c] = triangles[faces[place]].corners;
      targets_[place] = {corner(a), corner(b) - corner(a), corner(c) - corner(a)};
      return box_of(faces[place]);
    };
    tree_ = BoxTree(triangles.size(), kTrianglesPerLeaf, take_place, team);
    pack(team);
  }

  // In coordinates that begin in the middle of the mesh and run from -1 to 1: so a number of single
  // precision has one error everywhere.
  Point local(const Point& p) const { return (1.0 / scale_) * (p - middle_); }
  double scale() const { return scale_; }

  // Of a ray in these coordinates.
  Hit first_hit(const Ray& ray, double least, bool inside_out) const {
    Hit best{kInfinity};
    std::array<Open, kMostOpen> open;
    std::size_t n_open = 1;
    open[0] = {0.0F, static_cast<std::uint32_t>(tree_.n_levels() - 1), 0};
    while (n_open > 0) {
      const Open node = open[--n_open];
      if (!(node.enter < best.distance)) continue;
      if (node.level > 0) {
        n_open = open_below(node, ray, best, open, n_open);
        continue;
      }
      const auto [begin, end] = tree_.places(node.index);
      for (auto place = begin; place < end; ++place) {
        targets_[place].offer(ray, least, inside_out, best);
      }
    }
    return best;
  }

 private:
  // Vertices of no triangle may be far away, and do not count.
  void set_unit(std::span<const Point> vertices, std::span<const Triangle> triangles) {
    Box bounds;
    for (const Triangle& triangle : triangles) {
      for (const Vertex vertex : triangle.corners) bounds.include(vertices[vertex]);
    }
    if (triangles.empty()) return;
    middle_ = 0.5 * (bounds.low + bounds.high);
    const Point size = bounds.high - bounds.low;
    const double half = 0.5 * std::max({size.x, size.y, size.z});
    if (half > 0.0) scale_ = half;
  }

  struct Open {
    float enter;
    std::uint32_t level;
    std::size_t index;
  };
  static constexpr std::size_t kMostOpen = 128;  // eight a level: enough for 2^45 triangles

  void pack(ThreadTeam& team) {
    boxes_.resize(tree_.n_levels());
    for (std::size_t level = 1; level < tree_.n_levels(); ++level) {
      boxes_[level].resize(tree_.level(level).size());
      const std::span<const Box> below = tree_.level(level - 1);
      team.for_each_block(std::ssize(boxes_[level]), [&](std::int64_t first, std::int64_t last) {
        for (auto index = first; index < last; ++index) {
          const auto [begin, end] = tree_.children(level, index);
          for (auto child = begin; child < end; ++child) {
            boxes_[level][index].set(child - begin, below[child]);
          }
        }
      });
    }
  }

  // Adds the nodes below one that the ray meets, the nearest last.
  std::size_t open_below(const Open& node, const Ray& ray, const Hit& best,
                         std::array<Open, kMostOpen>& open, std::size_t n_open) const {
    std::array<float, kFanOut> enters;
    std::array<float, kFanOut> leaves;
    enter(boxes_[node.level][node.index], ray, enters, leaves);
    const auto [begin, end] = tree_.children(node.level, node.index);
    const std::size_t first = n_open;
    for (auto child = begin; child < end; ++child) {
      const float at = enters[child - begin];
      if (at > leaves[child - begin] || !(at < best.distance)) continue;
      std::size_t slot = n_open++;
      for (; slot > first && at > open[slot - 1].enter; --slot) open[slot] = open[slot - 1];
      open[slot] = {at, node.level - 1, child};
    }
    return n_open;
  }

  Buffer<Target> targets_;  // by place on the curve
  Point middle_{0.0, 0.0, 0.0};
  double scale_ = 1.0;  // half the longest side
  BoxTree tree_;
  std::vector<std::vector<Boxes>> boxes_;  // by level: those below each node
};

struct Spoke {
  Point direction;  // about the z axis
  double weight;
};

// Evenly over the cone: heights in equal steps, each turned by the golden angle from the last.
std::vector<Spoke> make_spokes(int n_rays) {
  constexpr double kCosGolden = -0.7373688780783197;
  constexpr double kSinGolden = 0.6754902942615237;
  std::vector<Spoke> spokes;
  double x = 1.0;
  double y = 0.0;
  for (int ray = 0; ray < n_rays; ++ray) {
    const double height = 1.0 - (1.0 - kCosHalfAngle) * (ray + 0.5) / n_rays;
    const double radius = std::sqrt(1.0 - height * height);
    const double angle = arctangent(radius, height);
    spokes.push_back({{radius * x, radius * y, height}, 1.0 / (angle + kSoftening)});
    const double turned = x * kCosGolden - y * kSinGolden;
    y = x * kSinGolden + y * kCosGolden;
    x = turned;
  }
  return spokes;
}

// Two unit vectors that make a right-handed frame with a third (Duff et al., "Building an
// orthonormal basis, revisited", 2017).
std::pair<Point, Point> across(const Point& axis) {
  const double sign = axis.z < 0.0 ? -1.0 : 1.0;
  const double a = -1.0 / (sign + axis.z);
  const double b = axis.x * axis.y * a;
  return {{1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x},
          {b, sign + axis.y * axis.y * a, -axis.y}};
}

struct Length {
  double length;
  double weight;
};

double median_of(std::span<const Length> sorted) {
  const std::size_t middle = sorted.size() / 2;
  if (sorted.size() % 2 == 1) return sorted[middle].length;
  return 0.5 * (sorted[middle - 1].length + sorted[middle].length);
}

double deviation_of(std::span<const Length> lengths) {
  double mean = 0.0;
  for (const Length& ray : lengths) mean += ray.length;
  mean /= static_cast<double>(lengths.size());
  double squares = 0.0;
  for (const Length& ray : lengths) squares += (ray.length - mean) * (ray.length - mean);
  return std::sqrt(squares / static_cast<double>(lengths.size()));
}

// The mean of the lengths that are not outliers.
double typical_length(std::vector<Length>& lengths) {
  std::sort(lengths.begin(), lengths.end(),
            [](const Length& a, const Length& b) { return a.length < b.length; });
  const double median = median_of(lengths);
  const double limit = deviation_of(lengths) + 1e-9 * median;  // all equal but for rounding: all
  double sum = 0.0;
  double weights = 0.0;
  for (const Length& ray : lengths) {
    if (std::abs(ray.length - median) > limit) continue;
    sum += ray.weight * ray.length;
    weights += ray.weight;
  }
  return weights > 0.0 ? sum / weights : median;  // of two groups of rays, the median is in neither
}

}  // namespace

Buffer<double> ray_thickness(std::span<const Point> vertices, std::span<const Triangle> triangles,
                             std::span<const Point> starts, std::span<const Point> axes,
                             const RayOptions& options, ThreadTeam& team) {
  SUPERFACETS_ASSERT(axes.size() == starts.size() && options.n_rays >= 1);
  const RayTree tree(vertices, triangles, team);
  const double least = options.least_distance / tree.scale();
  const std::vector<Spoke> spokes = make_spokes(options.n_rays);
  const auto n_enough = static_cast<std::size_t>(std::ceil(kLeastShare * options.n_rays));
  Buffer<double> thickness(starts.size());
  const auto measure = [&](std::int64_t begin, std::int64_t end) {
    std::vector<Length> lengths;
    for (auto i = begin; i < end; ++i) {
      const Point& axis = axes[i];
      lengths.clear();
      thickness[i] = kNaN;
      if (squared_norm(axis) == 0.0) continue;
      const auto [right, up] = across(axis);
      const Point start = tree.local(starts[i]);
      for (const auto& [direction, weight] : spokes) {
        const Ray ray(start, direction.x * right + direction.y * up + direction.z * axis);
        const Hit hit = tree.first_hit(ray, least, options.inside_out);
        if (hit.is_exit) lengths.push_back({hit.distance * tree.scale(), weight});
      }
      if (lengths.size() >= n_enough) thickness[i] = typical_length(lengths);
    }
  };
  team.for_each_block(std::ssize(starts), measure, kStartsPerTask);
  return thickness;
}

}  // namespace superfacets
