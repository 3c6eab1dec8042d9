#include "vsa.hpp"

#include <set>

#include "base/box.hpp"
#include "mesh/geometry.hpp"

namespace superfacets {
namespace {

// Unit normals cancel out if their area-weighted sum is shorter than this fraction of the area. The
// sum then consists of rounding errors, for example on a closed surface.
constexpr double kCanceled = 1e-9;

// Jacobi's method stops when the off-diagonal norm is at most this fraction of the trace. Each
// sweep roughly squares the fraction, so 4 to 6 sweeps suffice.
constexpr double kOffDiagonal = 1e-20;
constexpr int kMaxSweeps = 16;

// Heap order: whether candidate `one` is processed after candidate `other`.
constexpr auto comes_after = [](const auto& one, const auto& other) {
  return one.error != other.error ? one.error > other.error : one.order > other.order;
};

bool has_normal(const Point& normal) {
  return normal.x != 0.0 || normal.y != 0.0 || normal.z != 0.0;
}

// The integral of the square of a linear function over a triangle with area 6, given the values of
// the function at the corners.
double integral_of_square(double a, double b, double c) {
  return a * a + b * b + c * c + a * b + a * c + b * c;
}

double l2_error(const Corners& corners, double area, const Proxy& proxy) {
  const Point a = corners.a - proxy.center;
  const Point b = corners.b - proxy.center;
  const Point c = corners.c - proxy.center;
  if (has_normal(proxy.normal)) {
    return area / 6.0 *
           integral_of_square(dot(proxy.normal, a), dot(proxy.normal, b), dot(proxy.normal, c));
  }
  const double sum = integral_of_square(a.x, b.x, c.x) + integral_of_square(a.y, b.y, c.y) +
                     integral_of_square(a.z, b.z, c.z);
  return area / 6.0 * sum;
}

double l21_error(const Point& normal, double area, const Proxy& proxy) {
  if (!has_normal(normal)) return 0.0;
  if (!has_normal(proxy.normal)) return 2.0 * area;
  return area * squared_norm(normal - proxy.normal);
}

Point centroid_of(const Corners& corners) {
  const Point sum = corners.a + corners.b + corners.c;
  return {sum.x / 3.0, sum.y / 3.0, sum.z / 3.0};
}

struct SymmetricMatrix {
  double entries[3][3] = {};  // all entries are stored, although the matrix is symmetric

  void add_square(double weight, const Point& p) {
    const double xyz[] = {p.x, p.y, p.z};
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) entries[i][j] += weight * (xyz[i] * xyz[j]);
    }
  }

  double trace() const { return entries[0][0] + entries[1][1] + entries[2][2]; }

  double off_diagonal() const {
    return std::abs(entries[0][1]) + std::abs(entries[0][2]) + std::abs(entries[1][2]);
  }
};

// One step of Jacobi's method: rotates the axes p and q so that the entry (p, q) becomes 0.
void rotate(SymmetricMatrix& matrix, double (&axes)[3][3], int p, int q) {
  auto& m = matrix.entries;
  if (m[p][q] == 0.0) return;
  const double theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
  const double root = std::abs(theta) + std::sqrt(theta * theta + 1.0);
  const double tangent = theta < 0.0 ? -1.0 / root : 1.0 / root;
  const double cosine = 1.0 / std::sqrt(tangent * tangent + 1.0);
  const double sine = tangent * cosine;
  const int other = 3 - p - q;
  m[p][p] -= tangent * m[p][q];
  m[q][q] += tangent * m[p][q];
  m[p][q] = m[q][p] = 0.0;
  const double at_p = m[other][p];
  const double at_q = m[other][q];
  m[other][p] = m[p][other] = cosine * at_p - sine * at_q;
  m[other][q] = m[q][other] = sine * at_p + cosine * at_q;
  for (auto& row : axes) {
    const double old_p = row[p];
    const double old_q = row[q];
    row[p] = cosine * old_p - sine * old_q;
    row[q] = sine * old_p + cosine * old_q;
  }
}

// The unit eigenvector of the smallest eigenvalue; zero if the matrix is zero.
Point least_axis(SymmetricMatrix matrix) {
  const double trace = matrix.trace();
  if (!(trace > 0.0)) return {0.0, 0.0, 0.0};
  double axes[3][3] = {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}};  // one axis per column
  for (int sweep = 0; sweep < kMaxSweeps && matrix.off_diagonal() > kOffDiagonal * trace; ++sweep) {
    rotate(matrix, axes, 0, 1);
    rotate(matrix, axes, 0, 2);
    rotate(matrix, axes, 1, 2);
  }
  int least = 0;
  for (const int axis : {1, 2}) {
    if (matrix.entries[axis][axis] < matrix.entries[least][least]) least = axis;
  }
  return {axes[0][least], axes[1][least], axes[2][least]};
}

// Sums over the faces of a region.
struct RegionSums {
  double area = 0.0;
  double n_faces = 0.0;
  Point moment{0.0, 0.0, 0.0};     // sum of area times centroid
  Point centroids{0.0, 0.0, 0.0};  // sum of centroids
  Point normal{0.0, 0.0, 0.0};     // sum of area times normal

  Point center() const {
    const Point& sum = area > 0.0 ? moment : centroids;
    const double weight = area > 0.0 ? area : n_faces;
    return {sum.x / weight, sum.y / weight, sum.z / weight};
  }

  Point mean_normal() const {
    const double length = norm(normal);
    if (!(length > kCanceled * area)) return {0.0, 0.0, 0.0};
    return {normal.x / length, normal.y / length, normal.z / length};
  }
};

std::vector<RegionSums> sum_regions(const ProxySurface& surface, std::span<const Label> labels,
                                    Label n_regions) {
  SUPERFACETS_ASSERT(std::cmp_equal(labels.size(), surface.n_faces()));
  std::vector<RegionSums> sums(n_regions);
  for (Face face = 0; face < surface.n_faces(); ++face) {
    RegionSums& region = sums[labels[face]];
    const Point centroid = centroid_of(surface.corners[face]);
    region.area += surface.areas[face];
    region.n_faces += 1.0;
    region.moment = region.moment + surface.areas[face] * centroid;
    region.centroids = region.centroids + centroid;
    region.normal = region.normal + surface.areas[face] * surface.normals[face];
  }
  return sums;
}

// Sets the normal of each proxy to the normal of the least-squares plane of its region. The
// integral of x x^T over a triangle with area A and corners a, b, c is A / 12 (a a^T + b b^T + c
// c^T + s s^T), with s = a + b + c. The factor 1 / 12 is omitted, because it does not change the
// eigenvectors.
void fit_planes(const ProxySurface& surface, std::span<const Label> labels,
                std::vector<Proxy>& proxies) {
  std::vector<SymmetricMatrix> moments(proxies.size());
  for (Face face = 0; face < surface.n_faces(); ++face) {
    const Label label = labels[face];
    const Corners& corners = surface.corners[face];
    const Point a = corners.a - proxies[label].center;
    const Point b = corners.b - proxies[label].center;
    const Point c = corners.c - proxies[label].center;
    for (const Point& p : {a, b, c, a + b + c}) moments[label].add_square(surface.areas[face], p);
  }
  for (std::size_t label = 0; label < proxies.size(); ++label) {
    proxies[label].normal = least_axis(moments[label]);
  }
}

}  // namespace

ProxySurface make_proxy_surface(std::span<const Point> vertices, std::span<const Triangle> faces,
                                std::span<const double> areas,
                                std::span<const std::int64_t> offsets,
                                std::span<const Face> neighbors) {
  ProxySurface surface{Buffer<Corners>(faces.size()),
                       Buffer<Point>(faces.size()),
                       {areas.begin(), areas.end()},
                       {offsets.begin(), offsets.end()},
                       {neighbors.begin(), neighbors.end()}};
  SUPERFACETS_ASSERT(surface.arcs().are_valid() && areas.size() == faces.size() &&
                     offsets.size() == faces.size() + 1);
  for (std::size_t face = 0; face < faces.size(); ++face) {
    const auto& [a, b, c] = faces[face].corners;
    surface.corners[face] = {vertices[a], vertices[b], vertices[c]};
    surface.normals[face] = unit_normal(vertices, faces[face]);
  }
  return surface;
}

double proxy_error(const ProxySurface& surface, ProxyMetric metric, Face face, const Proxy& proxy) {
  return metric == ProxyMetric::kL2 ? l2_error(surface.corners[face], surface.areas[face], proxy)
                                    : l21_error(surface.normals[face], surface.areas[face], proxy);
}

std::vector<Proxy> fit_proxies(const ProxySurface& surface, ProxyMetric metric,
                               std::span<const Label> labels, Label n_regions) {
  std::vector<Proxy> proxies;
  proxies.reserve(n_regions);
  for (const RegionSums& region : sum_regions(surface, labels, n_regions)) {
    SUPERFACETS_ASSERT(region.n_faces > 0.0);
    proxies.push_back({region.center(), region.mean_normal()});
  }
  if (metric == ProxyMetric::kL2) fit_planes(surface, labels, proxies);
  return proxies;
}

ProxyRegions::ProxyRegions(ProxySurface&& surface, ProxyMetric metric, std::span<const Face> seeds)
    : surface_(std::move(surface)),
      metric_(metric),
      labels_(surface_.n_faces()),
      least_offer_(surface_.n_faces()) {
  SUPERFACETS_ASSERT(!seeds.empty() && all_below(seeds, surface_.n_faces()));
  SUPERFACETS_ASSERT(std::set<Face>(seeds.begin(), seeds.end()).size() == seeds.size());
  for (const Face seed : seeds) plant(seed);
  flood();
}

std::int64_t ProxyRegions::relax() {
  const std::vector<Label> before = labels_;
  fit();
  flood();
  std::int64_t n_changed = 0;
  for (std::size_t face = 0; face < labels_.size(); ++face) {
    n_changed += static_cast<std::int64_t>(labels_[face] != before[face]);
  }
  return n_changed;
}

void ProxyRegions::insert() {
  SUPERFACETS_ASSERT(n_regions() < surface_.n_faces());
  plant(worst_face(fit()));
  flood();
}

// Computes proxies and seeds from labels. Faces without a normal are avoided as seeds, because
// their error is nearly 0 with respect to every proxy.
std::vector<ProxyRegions::RegionErrors> ProxyRegions::fit() {
  proxies_ = fit_proxies(surface_, metric_, labels_, n_regions());
  std::vector<RegionErrors> regions(n_regions());
  for (Face face = 0; face < surface_.n_faces(); ++face) {
    const Label label = labels_[face];
    RegionErrors& region = regions[label];
    const double error = proxy_error(surface_, metric_, face, proxies_[label]);
    const double rank = has_normal(surface_.normals[face]) ? error : kInfinity;
    if (region.n_faces == 0 || rank < region.least) {
      region.least = rank;
      seeds_[label] = face;
    }
    region.total += error;
    ++region.n_faces;
  }
  return regions;
}

Face ProxyRegions::worst_face(const std::vector<RegionErrors>& regions) const {
  Label worst = kNoLabel;
  for (Label label = 0; label < n_regions(); ++label) {
    if (regions[label].n_faces < 2) continue;
    if (worst == kNoLabel || regions[label].total > regions[worst].total) worst = label;
  }
  Face worst_face = 0;
  double largest = 0.0;
  for (Face face = 0; face < surface_.n_faces(); ++face) {
    if (labels_[face] != worst || face == seeds_[worst]) continue;
    const double error = proxy_error(surface_, metric_, face, proxies_[worst]);
    if (error >= largest) {
      largest = error;
      worst_face = face;
    }
  }
  return worst_face;
}

// Computes labels from proxies and seeds (section 3.3 of Cohen-Steiner et al. 2004). All seeds are
// labeled before any other face, so that no region loses its seed.
void ProxyRegions::flood() {
  std::ranges::fill(labels_, kNoLabel);
  std::ranges::fill(least_offer_, kInfinity);
  n_offers_ = 0;
  for (Label label = 0; label < n_regions(); ++label) labels_[seeds_[label]] = label;
  for (Label label = 0; label < n_regions(); ++label) offer_neighbors(seeds_[label]);
  spread();
  for (Face face = 0; face < surface_.n_faces(); ++face) {
    if (labels_[face] != kNoLabel) continue;
    plant(face);
    take(face, n_regions() - 1);
    spread();
  }
}

void ProxyRegions::plant(Face seed) {
  seeds_.push_back(seed);
  proxies_.push_back({centroid_of(surface_.corners[seed]), surface_.normals[seed]});
}

void ProxyRegions::take(Face face, Label label) {
  labels_[face] = label;
  offer_neighbors(face);
}

// Adds the neighbors of a face to the queue, as candidates for its region. A neighbor is skipped if
// it is already queued with a lower or equal error, because the earlier candidate is processed
// first.
void ProxyRegions::offer_neighbors(Face face) {
  const Label label = labels_[face];
  for (const Face neighbor : surface_.arcs().neighbors(face)) {
    if (labels_[neighbor] != kNoLabel) continue;
    const double error = proxy_error(surface_, metric_, neighbor, proxies_[label]);
    if (error >= least_offer_[neighbor]) continue;
    least_offer_[neighbor] = error;
    queue_.push_back({error, n_offers_++, neighbor, label});
    std::push_heap(queue_.begin(), queue_.end(), comes_after);
  }
}

void ProxyRegions::spread() {
  while (!queue_.empty()) {
    std::pop_heap(queue_.begin(), queue_.end(), comes_after);
    const Candidate next = queue_.back();
    queue_.pop_back();
    if (labels_[next.face] == kNoLabel) take(next.face, next.label);
  }
}

}  // namespace superfacets
