#include "spatial/views.hpp"

#include <limits>

#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// Depth of the near plane of a triangle, as a fraction of the depth of its farthest corner. The
// bounding box of the triangle in the image excludes the part that is nearer than this plane,
// because points at the camera project to infinity.
constexpr double kNearest = 1e-6;

// Margin of the bounding box in pixels. The margin is larger than the rounding errors of the
// projection.
constexpr double kMargin = 1e-6;

// Returns homogeneous pixel coordinates (u d, v d, d). This map preserves depth and straight lines,
// so no triangle has to be clipped. The ray (u, v, 1) of a pixel hits a triangle if it is on the
// inner side of three planes, each through the camera and a side of the triangle.
Point projected(const View& view, const Point& p) {
  const double* m = view.projection;
  return {(m[0] * p.x + m[1] * p.y) + (m[2] * p.z + m[3]),
          (m[4] * p.x + m[5] * p.y) + (m[6] * p.z + m[7]),
          (m[8] * p.x + m[9] * p.y) + (m[10] * p.z + m[11])};
}

// A triangle in homogeneous pixel coordinates, prepared for intersection with rays.
class Target {
 public:
  Target(const Point& a, const Point& b, const Point& c) {
    sides_[0] = cross(b, c);
    sides_[1] = cross(c, a);
    sides_[2] = cross(a, b);
    volume_ = dot(a, sides_[0]);
    if (volume_ < 0.0) {
      for (Point& side : sides_) side = -1.0 * side;
      volume_ = -volume_;
    }
  }

  // Six times the volume of the tetrahedron formed by the camera and the triangle. The volume is 0
  // if the triangle is seen edge-on.
  double volume() const { return volume_; }

  // Depth of the triangle at (u, v); infinite if the ray misses the triangle.
  double depth_at(double u, double v) const {
    const double of_a = height(sides_[0], u, v);
    const double of_b = height(sides_[1], u, v);
    const double of_c = height(sides_[2], u, v);
    if (of_a < 0.0 || of_b < 0.0 || of_c < 0.0) return kMissed;
    return volume_ / ((of_a + of_b) + of_c);  // infinite for a ray parallel to the plane
  }

  static constexpr double kMissed = std::numeric_limits<double>::infinity();

 private:
  static double height(const Point& side, double u, double v) {
    return side.x * u + (side.y * v + side.z);
  }

  Point sides_[3] = {};
  double volume_ = 0.0;
};

// A range of pixels along one axis: the pixels whose centers are between the lowest and the highest
// added position.
struct PixelRange {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double position) {
    low = std::min(low, position);
    high = std::max(high, position);
  }
  // Positions may be infinite, so the result is clamped before conversion to an integer.
  std::int32_t first() const {
    return static_cast<std::int32_t>(std::clamp(std::ceil(low - 0.5 - kMargin), 0.0, kMost));
  }
  std::int32_t end(std::int32_t size) const {
    const double last = std::floor(high - 0.5 + kMargin);
    return static_cast<std::int32_t>(std::clamp(last + 1.0, 0.0, static_cast<double>(size)));
  }

  static constexpr double kMost = std::numeric_limits<std::int32_t>::max();
};

struct PixelBox {
  PixelRange columns, rows;

  void add(const Point& p) {
    columns.add(p.x / p.z);
    rows.add(p.y / p.z);
  }
};

// Bounding box of the part of a triangle in front of the camera.
PixelBox box_of(const std::array<Point, 3>& corners) {
  PixelBox box;
  const double farthest = std::max({corners[0].z, corners[1].z, corners[2].z});
  const double nearest = kNearest * farthest;
  for (int i = 0; i < 3; ++i) {
    const Point& a = corners[i];
    const Point& b = corners[next_corner(i)];
    if (a.z >= nearest) box.add(a);
    if ((a.z >= nearest) == (b.z >= nearest)) continue;
    const double fraction = (nearest - a.z) / (b.z - a.z);
    Point cut = a + fraction * (b - a);
    cut.z = nearest;
    box.add(cut);
  }
  return box;
}

// Draws the triangles into the pixels of one view, with a depth buffer.
class Picture {
 public:
  Picture(std::span<const Point> vertices, std::span<const Triangle> triangles, const View& view,
          std::span<Face> faces, std::span<double> areas)
      : vertices_(vertices),
        triangles_(triangles),
        view_(view),
        faces_(faces),
        areas_(areas),
        projected_(vertices.size()),
        depths_(faces.size()) {
    std::fill(faces_.begin(), faces_.end(), kNoCell);
    std::fill(depths_.begin(), depths_.end(), Target::kMissed);
    for (std::size_t i = 0; i < vertices.size(); ++i) projected_[i] = projected(view, vertices[i]);
  }

  void draw_all() {
    for (std::size_t face = 0; face < triangles_.size(); ++face) draw(static_cast<Face>(face));
  }

  // Replaces the depth of each pixel by the surface area in the pixel.
  void measure() {
    for (std::size_t pixel = 0; pixel < faces_.size(); ++pixel) {
      areas_[pixel] = faces_[pixel] == kNoCell ? 0.0 : area_of(faces_[pixel], depths_[pixel]);
    }
  }

  void mark_seen(std::span<std::uint8_t> is_seen) const {
    const auto flag_of = [&](std::size_t face) { return std::atomic_ref(is_seen[face]); };
    for (std::size_t pixel = 0; pixel < faces_.size(); ++pixel) {
      if (areas_[pixel] > 0.0) flag_of(faces_[pixel]).store(1, std::memory_order_relaxed);
    }
    for (std::size_t face = 0; face < triangles_.size(); ++face) {
      auto flag = flag_of(face);
      if (flag.load(std::memory_order_relaxed) == 1) continue;
      if (is_centroid_seen(static_cast<Face>(face))) flag.store(1, std::memory_order_relaxed);
    }
  }

 private:
  // Whether all corners are beyond the same side of the image, or behind the camera. This test
  // avoids divisions, which take most of the time per triangle.
  bool is_outside(const std::array<Point, 3>& corners) const {
    const auto are_all = [&](const auto& is_beyond) {
      return is_beyond(corners[0]) && is_beyond(corners[1]) && is_beyond(corners[2]);
    };
    const double width = view_.width, height = view_.height;
    return are_all([](const Point& p) { return p.z <= 0.0; }) ||
           are_all([](const Point& p) { return p.x < 0.0; }) ||
           are_all([](const Point& p) { return p.y < 0.0; }) ||
           are_all([&](const Point& p) { return p.x > width * p.z; }) ||
           are_all([&](const Point& p) { return p.y > height * p.z; });
  }

  void draw(Face face) {
    const auto corners = corners_of(projected_.span(), triangles_[face]);
    if (is_outside(corners)) return;
    const PixelBox box = box_of(corners);
    const std::int32_t left = box.columns.first(), right = box.columns.end(view_.width);
    const std::int32_t top = box.rows.first(), bottom = box.rows.end(view_.height);
    if (left >= right || top >= bottom) return;
    const Target target(corners[0], corners[1], corners[2]);
    if (!(target.volume() > 0.0)) return;
    for (std::int32_t row = top; row < bottom; ++row) {
      const std::int64_t start = static_cast<std::int64_t>(row) * view_.width;
      for (std::int32_t column = left; column < right; ++column) {
        const double depth = target.depth_at(column + 0.5, row + 0.5);
        if (!(depth < depths_[start + column])) continue;
        depths_[start + column] = depth;
        faces_[start + column] = face;
      }
    }
  }

  // Surface area in a pixel. For a given plane, this area is proportional to the cube of the depth.
  double area_of(Face face, double depth) const {
    const auto seen = corners_of(projected_.span(), triangles_[face]);
    const double doubled = norm(double_area_vector(vertices_, triangles_[face]));
    const double squared = depth * depth;
    const double area = doubled * (squared * depth) / Target(seen[0], seen[1], seen[2]).volume();
    const double facing = squared / view_.focal_product;
    return area <= kMaxStretched * facing ? area : 0.0;
  }

  bool is_centroid_seen(Face face) const {
    const auto corners = corners_of(projected_.span(), triangles_[face]);
    const Point sum = (corners[0] + corners[1]) + corners[2];
    // This early exit saves most divisions.
    if (sum.z <= 0.0 || sum.x < 0.0 || sum.y < 0.0) return false;
    const double u = sum.x / sum.z, v = sum.y / sum.z;
    const bool is_inside = u < view_.width && v < view_.height;  // the comparison is false for NaN
    if (!is_inside) return false;
    const std::int64_t pixel =
        static_cast<std::int64_t>(v) * view_.width + static_cast<std::int64_t>(u);
    if (!(areas_[pixel] > 0.0)) return false;
    // Length of the surface in the pixel: its area divided by the width of a pixel at this depth.
    const double length = areas_[pixel] * std::sqrt(view_.focal_product) / depths_[pixel];
    return sum.z / 3.0 <= depths_[pixel] + length;
  }

  std::span<const Point> vertices_;
  std::span<const Triangle> triangles_;
  const View& view_;
  std::span<Face> faces_;
  std::span<double> areas_;
  Buffer<Point> projected_;  // vertices in homogeneous pixel coordinates
  Buffer<double> depths_;  // depth of the nearest triangle in each pixel; infinite if there is none
};

}  // namespace

SeenSurface see_surface(std::span<const Point> vertices, std::span<const Triangle> triangles,
                        std::span<const View> views, ThreadTeam& team) {
  std::vector<std::int64_t> starts = {0};  // index of the first pixel of each view
  for (const View& view : views) starts.push_back(starts.back() + view.n_pixels());
  SeenSurface seen{Buffer<Face>(starts.back()), Buffer<double>(starts.back()),
                   Buffer<std::uint8_t>(triangles.size())};
  team.fill<std::uint8_t>(seen.is_seen.span(), 0);
  team.for_each(static_cast<std::int64_t>(views.size()), [&](std::int64_t i, int) {
    const auto start = static_cast<std::size_t>(starts[i]);
    const auto size = static_cast<std::size_t>(views[i].n_pixels());
    Picture picture(vertices, triangles, views[i], seen.triangles.span().subspan(start, size),
                    seen.areas.span().subspan(start, size));
    picture.draw_all();
    picture.measure();
    picture.mark_seen(seen.is_seen.span());
  });
  return seen;
}

}  // namespace superfacets
