#include "cells/texels.hpp"

#include <array>
#include <limits>

#include "base/lists.hpp"

namespace superfacets {
namespace {

// Maximum magnitude of texture coordinates. Beyond this magnitude, doubles cannot resolve texels.
constexpr double kMaxTiles = 1 << 20;
// Maximum number of texels sampled per triangle. More texels would barely change the mean.
constexpr double kMaxTexels = 1 << 14;
// Maximum number of sampled rows, and of sampled columns, per triangle.
constexpr double kMaxRows = 1 << 14;
// Maximum number of parts per side of a triangle that covers no center of a texel.
constexpr int kMaxSplits = 16;
// Maximum number of copies of the image, per direction, that a triangle paints.
constexpr double kMaxPaintedTiles = 4.0;
// Number of triangles per task. Tasks are small, because the sizes of triangles vary.
constexpr std::int64_t kTrianglesAtOnce = 256;
constexpr std::int64_t kTile = 128;  // width of a tile in texels; a tile fits in the cache
constexpr double kWhite = 65535.0;   // maximum of linear light

struct TexelPoint {
  double x;  // distance in texels from the left side of the image
  double y;  // distance in texels from the upper side of the image
};
using Corners = std::array<TexelPoint, 3>;

std::int64_t wrapped(std::int64_t i, std::int64_t size, Wrap wrap) {
  if (i >= 0 && i < size) return i;
  if (wrap == Wrap::kClamp) return std::clamp<std::int64_t>(i, 0, size - 1);
  const std::int64_t period = wrap == Wrap::kRepeat ? size : 2 * size;
  const std::int64_t rest = (i % period + period) % period;
  return rest < size ? rest : period - 1 - rest;
}

// Moves the coordinates of a triangle by whole periods close to 0, where doubles are more precise.
void move_near(double& a, double& b, double& c, Wrap wrap) {
  if (wrap == Wrap::kClamp) return;
  const double shift = 2.0 * std::floor(std::min({a, b, c}) / 2.0);
  a -= shift;
  b -= shift;
  c -= shift;
}

// Returns the corners of a triangle in texels, or nullopt if a coordinate is missing or exceeds
// kMaxTiles.
std::optional<Corners> corners_of(const TexelGrid& grid, const TexturedTriangles& triangles,
                                  std::int64_t triangle) {
  std::array<double, 3> u;
  std::array<double, 3> v;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::int64_t corner = triangles.corners[3 * triangle + static_cast<std::int64_t>(i)];
    if (corner < 0) return std::nullopt;
    u[i] = triangles.coordinates[2 * corner];
    v[i] = 1.0 - triangles.coordinates[2 * corner + 1];
    // The comparison is false for NaN.
    const bool is_near = std::abs(u[i]) <= kMaxTiles && std::abs(v[i]) <= kMaxTiles;
    if (!is_near) return std::nullopt;
  }
  move_near(u[0], u[1], u[2], grid.wrap_u);
  move_near(v[0], v[1], v[2], grid.wrap_v);
  const auto width = static_cast<double>(grid.width);
  const auto height = static_cast<double>(grid.height);
  return Corners{TexelPoint{u[0] * width, v[0] * height}, TexelPoint{u[1] * width, v[1] * height},
                 TexelPoint{u[2] * width, v[2] * height}};
}

double area_of(const Corners& corners) {
  const auto& [a, b, c] = corners;
  return 0.5 * std::abs((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y));
}

// The interval [left, right] in which the horizontal line at y crosses a triangle. If left > right,
// the line does not cross the triangle.
std::pair<double, double> cut_at(const Corners& corners, double y) {
  double left = std::numeric_limits<double>::infinity();
  double right = -left;
  for (std::size_t i = 0; i < 3; ++i) {
    TexelPoint a = corners[i];
    TexelPoint b = corners[(i + 1) % 3];
    if (b.y < a.y) std::swap(a, b);  // so that both triangles of an edge compute the same crossing
    if (a.y == b.y || y < a.y || y > b.y) continue;
    const double x = a.x + (y - a.y) * ((b.x - a.x) / (b.y - a.y));
    left = std::min(left, x);
    right = std::max(right, x);
  }
  return {left, right};
}

// The lowest multiple of `step` that is at least i.
std::int64_t next_multiple(std::int64_t i, std::int64_t step) {
  const std::int64_t rest = (i % step + step) % step;
  return rest == 0 ? i : i + step - rest;
}

// Calls visit(y, first, last) for the texels whose centers the triangle covers, in every `step`-th
// row.
template <typename Visit>
void for_each_row(const Corners& corners, std::int64_t step, const Visit& visit) {
  const auto& [a, b, c] = corners;
  const auto first = static_cast<std::int64_t>(std::ceil(std::min({a.y, b.y, c.y}) - 0.5));
  const auto last = static_cast<std::int64_t>(std::floor(std::max({a.y, b.y, c.y}) - 0.5));
  for (std::int64_t y = next_multiple(first, step); y <= last; y += step) {
    const auto [left, right] = cut_at(corners, static_cast<double>(y) + 0.5);
    if (!(left <= right)) continue;
    const auto begin = static_cast<std::int64_t>(std::ceil(left - 0.5));
    const auto end = static_cast<std::int64_t>(std::floor(right - 0.5));
    if (begin <= end) visit(y, begin, end);
  }
}

// Step between sampled rows and columns: 1 for most triangles. The step is odd, because most
// texture patterns have even periods.
std::int64_t step_of(const Corners& corners) {
  const auto& [a, b, c] = corners;
  const double height = std::max({a.y, b.y, c.y}) - std::min({a.y, b.y, c.y});
  const double width = std::max({a.x, b.x, c.x}) - std::min({a.x, b.x, c.x});
  const double step =
      std::max(std::sqrt(area_of(corners) / kMaxTexels), std::max(width, height) / kMaxRows);
  return static_cast<std::int64_t>(std::ceil(std::max(step, 1.0))) | 1;
}

template <typename Number>
using Color = std::array<Number, 3>;

struct Found {
  Point mean;
  double spread;
};

// Sums of the differences between each color and the first color.
template <typename Number>
struct ColorSums {
  Color<Number> first{};
  Color<Number> sums{};
  Number squares = 0;
  std::int64_t count = 0;

  void add(const Color<Number>& color) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Number difference = color[i] - first[i];
      sums[i] += difference;
      squares += difference * difference;
    }
    ++count;
  }

  // Mean and standard deviation.
  Found found() const {
    const auto n = static_cast<double>(count);
    Color<double> mean;
    double variance = static_cast<double>(squares) / n;
    for (std::size_t i = 0; i < 3; ++i) {
      const double difference = static_cast<double>(sums[i]) / n;
      variance -= difference * difference;
      mean[i] = (static_cast<double>(first[i]) + difference) / kWhite;
    }
    return {{mean[0], mean[1], mean[2]}, std::sqrt(std::max(variance, 0.0)) / kWhite};
  }
};

// With integers, the standard deviation of a uniform color is exactly 0.
using WholeSums = ColorSums<std::int64_t>;

class Image {
 public:
  Image(std::span<const std::uint8_t> pixels, const TexelGrid& grid,
        std::span<const std::int32_t> linear)
      : pixels_(pixels), grid_(grid), linear_(linear) {}

  // Adds every `step`-th texel from begin to end in row y to the sums.
  void add_run(std::int64_t y, std::int64_t begin, std::int64_t end, std::int64_t step,
               WholeSums& sums) const {
    const std::uint8_t* row = row_at(y);
    if (sums.count == 0) sums.first = light_at(row, begin);
    WholeSums run = sums;  // local copy, so the compiler knows that nothing aliases the sums
    if (step == 1 && begin >= 0 && end < grid_.width) {
      for (std::int64_t x = begin; x <= end; ++x) run.add(light_of(row + 3 * x));
    } else {
      for (std::int64_t x = next_multiple(begin, step); x <= end; x += step) {
        run.add(light_at(row, x));
      }
    }
    sums = run;
  }

  // Color at a position between texel centers, interpolated bilinearly in linear light.
  Color<double> between(const TexelPoint& place) const {
    const double left = std::floor(place.x - 0.5);
    const double upper = std::floor(place.y - 0.5);
    const auto x = static_cast<std::int64_t>(left);
    const auto y = static_cast<std::int64_t>(upper);
    const double right_fraction = place.x - 0.5 - left;
    const double lower_fraction = place.y - 0.5 - upper;
    const std::array rows{row_at(y), row_at(y + 1)};
    std::array<Color<double>, 2> mixed;
    for (std::size_t i = 0; i < 2; ++i) {
      mixed[i] = mix(light_at(rows[i], x), light_at(rows[i], x + 1), right_fraction);
    }
    return mix(mixed[0], mixed[1], lower_fraction);
  }

 private:
  const std::uint8_t* row_at(std::int64_t y) const {
    return pixels_.data() + 3 * grid_.width * wrapped(y, grid_.height, grid_.wrap_v);
  }

  Color<std::int64_t> light_of(const std::uint8_t* texel) const {
    return {linear_[texel[0]], linear_[texel[1]], linear_[texel[2]]};
  }
  Color<std::int64_t> light_at(const std::uint8_t* row, std::int64_t x) const {
    return light_of(row + 3 * wrapped(x, grid_.width, grid_.wrap_u));
  }

  // Linear interpolation; exact where both values are equal.
  template <typename Number>
  static Color<double> mix(const Color<Number>& a, const Color<Number>& b, double fraction) {
    Color<double> mixed;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto from = static_cast<double>(a[i]);
      mixed[i] = from + fraction * (static_cast<double>(b[i]) - from);
    }
    return mixed;
  }

  std::span<const std::uint8_t> pixels_;
  TexelGrid grid_;
  std::span<const std::int32_t> linear_;
};

double longest_side(const Corners& corners) {
  double longest = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const TexelPoint& a = corners[i];
    const TexelPoint& b = corners[(i + 1) % 3];
    longest = std::max(longest, std::hypot(b.x - a.x, b.y - a.y));
  }
  return longest;
}

// Samples a triangle at the centroids of n^2 equal parts.
Found sampled(const Image& image, const Corners& corners) {
  const TexelPoint& a = corners[0];
  const TexelPoint& b = corners[1];
  const TexelPoint& c = corners[2];
  const double sides = std::ceil(std::clamp(longest_side(corners), 1.0, double{kMaxSplits}));
  const int n = static_cast<int>(sides);
  ColorSums<double> sums;
  const auto add = [&](double s, double t) {
    const Color<double> light = image.between(
        {a.x + s * (b.x - a.x) + t * (c.x - a.x), a.y + s * (b.y - a.y) + t * (c.y - a.y)});
    if (sums.count == 0) sums.first = light;
    sums.add(light);
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      add((i + 1.0 / 3.0) / n, (j + 1.0 / 3.0) / n);
      if (i + j + 1 < n) add((i + 2.0 / 3.0) / n, (j + 2.0 / 3.0) / n);
    }
  }
  return sums.found();
}

Found color_of(const Image& image, const Corners& corners) {
  const std::int64_t step = step_of(corners);
  WholeSums sums;
  for_each_row(corners, step, [&](std::int64_t y, std::int64_t begin, std::int64_t end) {
    image.add_run(y, begin, end, step, sums);
  });
  return sums.count == 0 ? sampled(image, corners) : sums.found();
}

// Clamps a triangle to at most kMaxPaintedTiles copies of the image per direction.
Corners cut_to_tiles(const TexelGrid& grid, Corners corners) {
  const auto& [a, b, c] = corners;
  const double left = std::min({a.x, b.x, c.x});
  const double upper = std::min({a.y, b.y, c.y});
  for (TexelPoint& place : corners) {
    place.x = std::min(place.x, left + kMaxPaintedTiles * static_cast<double>(grid.width));
    place.y = std::min(place.y, upper + kMaxPaintedTiles * static_cast<double>(grid.height));
  }
  return corners;
}

class IdPainter {
 public:
  explicit IdPainter(const TexelGrid& grid) : grid_(grid), ids_(grid.width * grid.height) {
    std::fill(ids_.begin(), ids_.end(), -1);
  }

  void paint(const Corners& corners, std::int32_t id) {
    bool is_seen = false;
    for_each_row(corners, 1, [&](std::int64_t y, std::int64_t begin, std::int64_t end) {
      is_seen = true;
      for (std::int64_t x = begin; x <= end; ++x) at(x, y) = id;
    });
    const auto& [a, b, c] = corners;
    if (!is_seen) {
      const auto x = static_cast<std::int64_t>(std::floor((a.x + b.x + c.x) / 3.0));
      const auto y = static_cast<std::int64_t>(std::floor((a.y + b.y + c.y) / 3.0));
      if (at(x, y) < 0) at(x, y) = id;
    }
  }

  // Assigns to each texel without an id the id of its first neighbor that has one.
  void grow(ThreadTeam& team) {
    Buffer<std::int32_t> grown(ids_.size());
    team.for_each_index(grid_.height, [&](std::int64_t y) {
      for (std::int64_t x = 0; x < grid_.width; ++x) {
        const std::int32_t id = ids_[y * grid_.width + x];
        grown[y * grid_.width + x] = id >= 0 ? id : neighbor_of(x, y);
      }
    });
    ids_ = std::move(grown);
  }

  Buffer<std::int32_t> take() && { return std::move(ids_); }

 private:
  std::int32_t& at(std::int64_t x, std::int64_t y) {
    return ids_[wrapped(y, grid_.height, grid_.wrap_v) * grid_.width +
                wrapped(x, grid_.width, grid_.wrap_u)];
  }

  std::int32_t neighbor_of(std::int64_t x, std::int64_t y) const {
    constexpr std::array<std::pair<int, int>, 8> kSteps{
        {{-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
    for (const auto& [dx, dy] : kSteps) {
      const std::int64_t to_x = x + dx;
      const std::int64_t to_y = y + dy;
      if (to_x < 0 || to_y < 0 || to_x >= grid_.width || to_y >= grid_.height) continue;
      const std::int32_t id = ids_[to_y * grid_.width + to_x];
      if (id >= 0) return id;
    }
    return -1;
  }

  TexelGrid grid_;
  Buffer<std::int32_t> ids_;
};

// The triangles, sorted by the image tile of their first corner. In an arbitrary order, nearly
// every row of texels would be read from memory several times.
Buffer<std::int32_t> order_by_tile(const TexelGrid& grid, const TexturedTriangles& triangles) {
  const std::int64_t n_columns = (grid.width + kTile - 1) / kTile;
  const std::int64_t n_rows = (grid.height + kTile - 1) / kTile;
  const std::size_t n = triangles.corners.size() / 3;
  std::vector<std::int32_t> tiles(n);
  for (std::size_t triangle = 0; triangle < n; ++triangle) {
    const auto corners = corners_of(grid, triangles, static_cast<std::int64_t>(triangle));
    if (!corners) continue;  // the triangle is not sampled, so its tile does not matter
    const auto& [x, y] = corners->front();
    const std::int64_t column = wrapped(static_cast<std::int64_t>(x), grid.width, grid.wrap_u);
    const std::int64_t row = wrapped(static_cast<std::int64_t>(y), grid.height, grid.wrap_v);
    tiles[triangle] = static_cast<std::int32_t>(row / kTile * n_columns + column / kTile);
  }
  const auto add_all = [&](const auto& add) {
    for (std::size_t triangle = 0; triangle < n; ++triangle) {
      add(tiles[triangle], static_cast<std::int32_t>(triangle));
    }
  };
  return group<std::int32_t>(n_rows * n_columns, add_all).entries;
}

}  // namespace

TexelColors texel_colors(std::span<const std::uint8_t> pixels, const TexelGrid& grid,
                         std::span<const std::int32_t> linear, const TexturedTriangles& triangles,
                         ThreadTeam& team) {
  SUPERFACETS_ASSERT(static_cast<std::int64_t>(pixels.size()) == 3 * grid.width * grid.height);
  SUPERFACETS_ASSERT(linear.size() == 256);
  const auto n = static_cast<std::int64_t>(triangles.corners.size() / 3);
  TexelColors colors{Buffer<Point>(n), Buffer<double>(n)};
  const Image image(pixels, grid, linear);
  const Buffer<std::int32_t> order = order_by_tile(grid, triangles);
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const auto find = [&](std::int64_t place) {
    const std::int32_t triangle = order[place];
    const std::optional<Corners> corners = corners_of(grid, triangles, triangle);
    const Found found = corners ? color_of(image, *corners) : Found{{kNone, kNone, kNone}, kNone};
    colors.means[triangle] = found.mean;
    colors.spreads[triangle] = found.spread;
  };
  team.for_each_index(n, find, kTrianglesAtOnce);
  return colors;
}

Buffer<std::int32_t> paint_ids(const TexelGrid& grid, const TexturedTriangles& triangles,
                               std::span<const std::int32_t> ids, int bleed, ThreadTeam& team) {
  SUPERFACETS_ASSERT(3 * ids.size() == triangles.corners.size());
  IdPainter painter(grid);
  for (auto triangle = static_cast<std::int64_t>(ids.size()); triangle-- > 0;) {
    const std::optional<Corners> corners = corners_of(grid, triangles, triangle);
    if (corners) painter.paint(cut_to_tiles(grid, *corners), ids[triangle]);
  }
  for (int step = 0; step < bleed; ++step) painter.grow(team);
  return std::move(painter).take();
}

}  // namespace superfacets
