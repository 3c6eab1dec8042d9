#include "spatial/ray_thickness.hpp"

#include <array>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "base/arctangent.hpp"
#include "spatial/box_tree.hpp"
#include "spatial/morton.hpp"

namespace superfacets {
namespace {

constexpr std::size_t kTrianglesPerLeaf = 4;
constexpr std::int64_t kStartsPerTask = 32;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr double kCosHalfAngle = 0.5;  // cosine of the half-angle of the cone of rays, 60 degrees
constexpr double kSoftening = 0.2;     // radians; the weight of a ray is 1 / (angle + kSoftening)
constexpr double kLeastShare = 0.25;   // least fraction of rays that must leave the body

constexpr std::size_t kFanOut = BoxTree::kFanOut;

// The boxes of the children of a node, with one array per coordinate for vectorized loops. Single
// precision, rounded outwards.
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

  // Returns 1 / x. For x near 0, a large number replaces infinity, whose product with 0 is NaN.
  static float invert(double x) {
    constexpr double kLeast = 1e-15;
    return static_cast<float>(1.0 / (std::abs(x) < kLeast ? std::copysign(kLeast, x) : x));
  }

  Point from;
  Point along;
  std::array<float, 3> origin;
  std::array<float, 3> inverse;
};

// Computes the distances at which a ray enters and leaves each box. The first is a lower bound of
// the distance to anything in the box; it is larger than the second if the ray misses the box.
// kSlack compensates for rounding of the ray.
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

// A triangle prepared for intersection with rays.
struct Target {
  Point corner;
  Point first;  // edges from the corner to the other corners
  Point second;

  // Replaces `best` if the ray hits the triangle nearer, but beyond `least`. Points on an edge
  // belong to both triangles of the edge, so that no ray slips through between them.
  void offer(const Ray& ray, double least, bool inside_out, Hit& best) const {
    constexpr double kEdge = 1e-12;
    const Point p = cross(ray.along, second);
    const double determinant = dot(first, p);  // minus the product of normal and ray
    if (determinant == 0.0) return;
    const double sign = determinant < 0.0 ? -1.0 : 1.0;
    const double size = sign * determinant;  // scale of u, v and the distance
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

double surface_of(const Point& extent) {
  return 2.0 * (extent.x * extent.y + extent.y * extent.z + extent.z * extent.x);
}

// A bounding box aligned with the longest edge and the normal of a triangle. It culls long thin
// triangles that are not parallel to an axis. Their axis-aligned boxes overlap: a ray would meet
// most of the n boxes of a fan of n triangles.
class SlantedBox {
 public:
  // Bounds triangles, aligned with the largest of them. If all have zero area, there are no axes,
  // and every ray counts as hitting the box.
  explicit SlantedBox(std::span<const Target> targets) {
    double most = 0.0;
    for (const Target& target : targets) {
      const Point normal = cross(target.first, target.second);
      if (squared_norm(normal) <= most) continue;
      most = squared_norm(normal);
      const Point third = target.second - target.first;
      Point longest =
          squared_norm(target.first) < squared_norm(target.second) ? target.second : target.first;
      if (squared_norm(longest) < squared_norm(third)) longest = third;
      axes_[0] = 1.0 / norm(longest) * longest;
      axes_[1] = 1.0 / norm(normal) * normal;
      axes_[2] = cross(axes_[0], axes_[1]);
    }
    for (const Target& target : targets) {
      for (const Point& edge : {Point{0.0, 0.0, 0.0}, target.first, target.second}) {
        box_.include(along_axes(target.corner + edge));
      }
    }
  }

  Point extent() const { return box_.high - box_.low; }
  bool has_axes() const { return squared_norm(axes_[0]) > 0.0; }

  // Whether a ray may hit the box within a distance.
  bool is_met(const Ray& ray, double distance) const {
    const Point from = along_axes(ray.from);
    const Point along = along_axes(ray.along);
    double enter = 0.0;
    double leave = distance;
    const auto clip = [&](double low, double high, double start, double step) {
      constexpr double kSlack = 1e-6;  // as for axis-aligned boxes
      const double first = low - kSlack - start;
      const double last = high + kSlack - start;
      if (step == 0.0) return first <= 0.0 && last >= 0.0;
      enter = std::max(enter, (step > 0.0 ? first : last) / step);
      leave = std::min(leave, (step > 0.0 ? last : first) / step);
      return enter <= leave;
    };
    return clip(box_.low.x, box_.high.x, from.x, along.x) &&
           clip(box_.low.y, box_.high.y, from.y, along.y) &&
           clip(box_.low.z, box_.high.z, from.z, along.z);
  }

 private:
  Point along_axes(const Point& p) const {
    return {dot(axes_[0], p), dot(axes_[1], p), dot(axes_[2], p)};
  }

  std::array<Point, 3> axes_{};
  Box box_;
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
    Buffer<Point> middles(triangles.size());  // centers of the boxes, times two
    team.for_each_index(std::ssize(triangles), [&](std::int64_t face) {
      const Box box = box_of(face);
      middles[face] = box.low + box.high;
    });
    const Buffer<Cell> faces = refined_morton_order(middles.span(), kTrianglesPerLeaf, team);
    const auto take_place = [&](std::size_t place) {
      const auto& [a, b, c] = triangles[faces[place]].corners;
      targets_[place] = {corner(a), corner(b) - corner(a), corner(c) - corner(a)};
      return box_of(faces[place]);
    };
    tree_ = BoxTree(triangles.size(), kTrianglesPerLeaf, take_place, team);
    pack(team);
    add_slanted(team);
  }

  // Transforms a point to local coordinates. They have their origin in the middle of the mesh and
  // run from -1 to 1, so that one number bounds the rounding of single precision on every mesh.
  Point local(const Point& p) const { return (1.0 / scale_) * (p - middle_); }
  double scale() const { return scale_; }

  // Returns the first hit of a ray beyond the distance `least`, both in local coordinates. If there
  // is none, the distance of the hit is infinite.
  Hit first_hit(const Ray& ray, double least, bool inside_out) const {
    Hit best{kInfinity};
    std::array<Open, kMostOpen> open;
    std::size_t n_open = 1;
    open[0] = {0.0F, static_cast<std::uint32_t>(tree_.n_levels() - 1), 0};
    while (n_open > 0) {
      const Open node = open[--n_open];
      if (!(node.enter < best.distance) || is_passed_by(node, ray, best.distance)) continue;
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
  // Sets the origin and unit of local coordinates. Unused vertices may be far away and are ignored.
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
  static constexpr std::size_t kMostOpen = 128;  // eight per level: enough for 2^45 triangles

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

  // Adds oriented boxes to leaves whose axis-aligned box has many times the area of their
  // triangles, and to nodes above them of which at least half the children are of this kind.
  void add_slanted(ThreadTeam& team) {
    constexpr double kThin = 32.0;  // a square at 45 degrees to two axes has about 4
    const std::span<const Box> leaves = tree_.level(0);
    std::vector<std::uint8_t> is_thin(leaves.size());
    team.for_each_block(std::ssize(leaves), [&](std::int64_t first, std::int64_t last) {
      for (auto leaf = first; leaf < last; ++leaf) {
        double area = 0.0;
        for (const Target& target : targets_of(0, leaf)) {
          area += 0.5 * norm(cross(target.first, target.second));
        }
        is_thin[leaf] = surface_of(leaves[leaf].high - leaves[leaf].low) > kThin * area;
      }
    });
    slanted_.resize(tree_.n_levels());
    for (std::size_t level = 0; std::ranges::count(is_thin, 1) > 0; ++level) {
      add_slanted(level, is_thin, team);
      if (level + 1 == tree_.n_levels()) return;
      std::vector<std::uint8_t> above(tree_.level(level + 1).size());
      for (std::size_t index = 0; index < above.size(); ++index) {
        const auto [begin, end] = tree_.children(level + 1, index);
        const auto n_thin = std::count(is_thin.begin() + begin, is_thin.begin() + end, 1);
        above[index] = std::cmp_greater_equal(2 * n_thin, end - begin);
      }
      is_thin = std::move(above);
    }
  }

  void add_slanted(std::size_t level, std::span<const std::uint8_t> is_thin, ThreadTeam& team) {
    constexpr double kMuchSmaller = 0.25;
    const std::span<const Box> boxes = tree_.level(level);
    slanted_[level].resize(boxes.size());
    team.for_each_block(std::ssize(boxes), [&](std::int64_t first, std::int64_t last) {
      for (auto index = first; index < last; ++index) {
        if (is_thin[index] == 0) continue;
        const SlantedBox box(targets_of(level, index));
        const double least = kMuchSmaller * surface_of(boxes[index].high - boxes[index].low);
        if (box.has_axes() && surface_of(box.extent()) < least) slanted_[level][index] = box;
      }
    });
  }

  std::span<const Target> targets_of(std::size_t level, std::size_t index) const {
    std::size_t size = kTrianglesPerLeaf;
    for (std::size_t below = 0; below < level; ++below) size *= kFanOut;
    const std::size_t first = index * size;
    return targets_.span().subspan(first, std::min(size, targets_.size() - first));
  }

  bool is_passed_by(const Open& node, const Ray& ray, double distance) const {
    const auto& boxes = slanted_[node.level];
    if (boxes.empty()) return false;
    const auto& box = boxes[node.index];
    return box.has_value() && !box->is_met(ray, distance);
  }

  // Pushes the children of a node that the ray meets before its best hit, the nearest last.
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
  double scale_ = 1.0;  // half the longest side of the bounding box
  BoxTree tree_;
  std::vector<std::vector<Boxes>> boxes_;  // by level: boxes of the children of each node
  std::vector<std::vector<std::optional<SlantedBox>>> slanted_;  // by level; empty for most nodes
};

struct Spoke {
  Point direction;  // in a frame whose z axis is the axis of the cone
  double weight;
};

// Returns rays spread evenly over the cone: equal steps in height, each rotated by the golden
// angle.
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

// Returns two unit vectors that form a right-handed frame with the unit vector `axis` (Duff et al.,
// "Building an orthonormal basis, revisited", 2017).
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

// The weighted mean of the lengths, without those farther from the median than the standard
// deviation. Sorts the lengths.
double typical_length(std::vector<Length>& lengths) {
  std::ranges::sort(lengths, [](const Length& a, const Length& b) { return a.length < b.length; });
  const double median = median_of(lengths);
  const double limit = deviation_of(lengths) + 1e-9 * median;  // tolerates rounding errors
  double sum = 0.0;
  double weights = 0.0;
  for (const Length& ray : lengths) {
    if (std::abs(ray.length - median) > limit) continue;
    sum += ray.weight * ray.length;
    weights += ray.weight;
  }
  // If there are two groups of lengths, no length may be near the median.
  return weights > 0.0 ? sum / weights : median;
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
