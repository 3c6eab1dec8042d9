#include "spatial/ray_thickness.hpp"

#include <memory>

#include "base/elementary.hpp"
#include "spatial/box_tree.hpp"
#include "spatial/morton.hpp"

namespace superfacets {
namespace {

constexpr std::size_t kTrianglesPerLeaf = 4;
constexpr std::int64_t kStartsPerTask = 32;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr double kCosHalfAngle = 0.5;  // cosine of the half-angle of the cone of rays, 60 degrees
constexpr double kSoftening = 0.2;  // in radians; the weight of a ray is 1 / (angle + kSoftening)
constexpr double kMinFraction = 0.25;  // minimum fraction of rays that must leave the solid

struct Ray {
  Ray(const Point& start, const Point& direction, double by)
      : from(start),
        along(direction),
        inverse{invert(along.x), invert(along.y), invert(along.z)},
        slack(by),
        from_low(start + Point{by, by, by}),
        from_high(start - Point{by, by, by}) {}

  // 1 / x, or a large number for x = 0, because the product of infinity and 0 is NaN.
  static double invert(double x) { return 1.0 / (x == 0.0 ? 1e-100 : x); }

  Point from;
  Point along;
  Point inverse;
  double slack;  // distance by which boxes are enlarged, so that rounding errors do not matter
  // start + slack: subtracting it from the lower corner of a box also enlarges the box
  Point from_low;
  // start - slack: subtracting it from the upper corner of a box also enlarges the box
  Point from_high;
};

// Lower bound of the distance at which a ray enters a box; NaN if the ray does not enter the box
// within `limit`.
double entry(const Box& box, const Ray& ray, double limit) {
  double enter = 0.0;
  double leave = limit;
  const auto clip = [&](double Point::* axis) {
    const double first = (box.low.*axis - ray.from_low.*axis) * ray.inverse.*axis;
    const double last = (box.high.*axis - ray.from_high.*axis) * ray.inverse.*axis;
    enter = std::max(enter, std::min(first, last));
    leave = std::min(leave, std::max(first, last));
  };
  clip(&Point::x);
  clip(&Point::y);
  clip(&Point::z);
  return enter <= leave ? enter : kNaN;
}

struct Hit {
  double distance;
  bool is_exit = false;
};

// A triangle prepared for intersection with rays.
struct Target {
  Point corner;
  Point first;   // vector from the corner to the second corner
  Point second;  // vector from the corner to the third corner

  // Replaces `best` if the ray hits the triangle at a shorter distance that is larger than `least`.
  // Points on an edge belong to both triangles of the edge, so that no ray passes between two
  // triangles.
  void offer(const Ray& ray, double least, bool inside_out, Hit& best) const {
    constexpr double kEdge = 1e-12;
    const Point p = cross(ray.along, second);
    const double determinant = dot(first, p);  // the negative dot product of normal and ray
    if (determinant == 0.0) return;
    const double sign = determinant < 0.0 ? -1.0 : 1.0;
    const double size = sign * determinant;  // common denominator of u, v and the distance
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

// An oriented bounding box, aligned with the longest edge and the normal of a triangle. The box is
// used for long thin triangles that are not parallel to an axis. Axis-aligned boxes of these
// triangles overlap: in a fan of n triangles, a ray would hit most of the n boxes.
class OrientedBox {
 public:
  // Builds a box around triangles, aligned with the largest triangle. If all triangles have zero
  // area, the box has no axes, and every ray hits the box.
  explicit OrientedBox(std::span<const Target> targets) {
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
    origin_ = targets.front().corner;
    for (const Target& target : targets) {
      for (const Point& edge : {Point{0.0, 0.0, 0.0}, target.first, target.second}) {
        box_.include(along_axes(target.corner - origin_ + edge));
      }
    }
  }

  Point extent() const { return box_.high - box_.low; }
  bool has_axes() const { return squared_norm(axes_[0]) > 0.0; }

  // Version of the function entry() for oriented boxes.
  double entry(const Ray& ray, double limit) const {
    const Ray turned(along_axes(ray.from - origin_), along_axes(ray.along), ray.slack);
    return superfacets::entry(box_, turned, limit);
  }

 private:
  Point along_axes(const Point& p) const {
    return {dot(axes_[0], p), dot(axes_[1], p), dot(axes_[2], p)};
  }

  Point origin_;
  std::array<Point, 3> axes_{};
  Box box_;  // extent along the axes, relative to the origin
};

// The triangles of a mesh, and a box tree of these triangles.
class RayTree {
 public:
  RayTree(std::span<const Point> vertices, std::span<const Triangle> triangles, ThreadTeam& team)
      : targets_(triangles.size()) {
    const auto box_of = [&](std::int64_t face) {
      Box box;
      for (const Vertex vertex : triangles[face].corners) box.include(vertices[vertex]);
      return box;
    };
    const Buffer<Cell> faces =
        order_of_boxes(std::ssize(triangles), box_of, kTrianglesPerLeaf, team);
    const auto take_place = [&](std::size_t place) {
      const auto& [a, b, c] = triangles[faces[place]].corners;
      targets_[place] = {vertices[a], vertices[b] - vertices[a], vertices[c] - vertices[a]};
      return box_of(faces[place]);
    };
    tree_ = BoxTree(triangles.size(), kTrianglesPerLeaf, take_place, team);
    add_oriented(team);
  }

  // The first hit of a ray beyond the distance `least`. If the ray hits no triangle, the distance
  // of the result is infinite.
  Hit first_hit(const Point& from, const Point& along, double least, bool inside_out) const {
    constexpr double kSlack = 1e-9;  // as a fraction of the extent of the mesh
    if (tree_.empty()) return {kInfinity};
    const Box& all = tree_.level(tree_.n_levels() - 1)[0];
    const Point extent = all.high - all.low;
    const Ray ray(from, along, kSlack * std::max({extent.x, extent.y, extent.z}));
    Hit best{kInfinity};
    const auto distance = [&](std::size_t level, std::size_t index) {
      const double enter = entry(tree_.level(level)[index], ray, best.distance);
      const OrientedBox* const oriented = oriented_[level][index].get();
      return oriented == nullptr || std::isnan(enter) ? enter : oriented->entry(ray, best.distance);
    };
    tree_.visit_nearest(distance, best.distance, [&](std::size_t begin, std::size_t end) {
      for (auto place = begin; place < end; ++place) {
        targets_[place].offer(ray, least, inside_out, best);
      }
    });
    return best;
  }

 private:
  // Adds an oriented box to each node whose axis-aligned box has a much larger area than the node's
  // triangles, if the oriented box is much smaller.
  void add_oriented(ThreadTeam& team) {
    // An oriented box is considered only if the area of the axis-aligned box is more than kThin
    // times the area of its triangles. For comparison, a square at 45 degrees to two axes has a
    // ratio of about 4.
    constexpr double kThin = 32.0;
    constexpr double kMuchSmaller = 0.25;
    std::vector<double> of_targets(targets_.size());
    for (std::size_t place = 0; place < targets_.size(); ++place) {
      of_targets[place] = 0.5 * norm(cross(targets_[place].first, targets_[place].second));
    }
    const auto areas =
        tree_.summarize<double>(of_targets, 0.0, [](double& sum, double area) { sum += area; });
    oriented_.resize(tree_.n_levels());
    for (std::size_t level = 0; level < tree_.n_levels(); ++level) {
      oriented_[level].resize(areas[level].size());
      team.for_each_index(std::ssize(areas[level]), [&](std::int64_t index) {
        const Box& around = tree_.level(level)[index];
        const double surface = surface_of(around.high - around.low);
        if (surface <= kThin * areas[level][index]) return;
        const OrientedBox box(targets_of(level, index));
        if (!box.has_axes() || surface_of(box.extent()) >= kMuchSmaller * surface) return;
        oriented_[level][index] = std::make_unique<OrientedBox>(box);
      });
    }
  }

  std::span<const Target> targets_of(std::size_t level, std::size_t index) const {
    std::size_t size = kTrianglesPerLeaf;
    for (std::size_t below = 0; below < level; ++below) size *= BoxTree::kFanOut;
    const std::size_t first = index * size;
    return targets_.span().subspan(first, std::min(size, targets_.size() - first));
  }

  Buffer<Target> targets_;  // triangles sorted along the curve
  BoxTree tree_;
  // [level][node] box of each tree node, or null.
  std::vector<std::vector<std::unique_ptr<OrientedBox>>> oriented_;
};

struct Spoke {
  Point direction;  // unit vector; the z axis is the axis of the cone
  double weight;
};

// Returns directions distributed evenly over the cone. The directions have equal steps in height,
// and each direction is rotated by the golden angle relative to the previous one.
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

// The weighted mean of the lengths within one standard deviation of the median. Sorts the lengths.
double typical_length(std::vector<Length>& lengths) {
  std::ranges::sort(lengths, [](const Length& a, const Length& b) { return a.length < b.length; });
  const double median = median_of(lengths);
  // The second term tolerates rounding errors.
  const double limit = deviation_of(lengths) + 1e-9 * median;
  double sum = 0.0;
  double weights = 0.0;
  for (const Length& ray : lengths) {
    if (std::abs(ray.length - median) > limit) continue;
    sum += ray.weight * ray.length;
    weights += ray.weight;
  }
  // If the lengths form two groups, there may be no length near the median.
  return weights > 0.0 ? sum / weights : median;
}

}  // namespace

Buffer<double> ray_thickness(std::span<const Point> vertices, std::span<const Triangle> triangles,
                             std::span<const Point> starts, std::span<const Point> axes,
                             const RayOptions& options, ThreadTeam& team) {
  SUPERFACETS_ASSERT(axes.size() == starts.size() && options.n_rays >= 1);
  const RayTree tree(vertices, triangles, team);
  const std::vector<Spoke> spokes = make_spokes(options.n_rays);
  const auto n_enough = static_cast<std::size_t>(std::ceil(kMinFraction * options.n_rays));
  Buffer<double> thickness(starts.size());
  const auto measure = [&](std::int64_t begin, std::int64_t end) {
    std::vector<Length> lengths;
    for (auto i = begin; i < end; ++i) {
      const Point& axis = axes[i];
      lengths.clear();
      thickness[i] = kNaN;
      if (squared_norm(axis) == 0.0) continue;
      const auto [right, up] = across(axis);
      for (const auto& [direction, weight] : spokes) {
        const Point along = direction.x * right + direction.y * up + direction.z * axis;
        const Hit hit =
            tree.first_hit(starts[i], along, options.least_distance, options.inside_out);
        if (hit.is_exit) lengths.push_back({hit.distance, weight});
      }
      if (lengths.size() >= n_enough) thickness[i] = typical_length(lengths);
    }
  };
  team.for_each_block(std::ssize(starts), measure, kStartsPerTask);
  return thickness;
}

}  // namespace superfacets
