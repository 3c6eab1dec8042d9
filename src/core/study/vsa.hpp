// Variational Shape Approximation (Cohen-Steiner, Alliez and Desbrun 2004): an alternative to
// stages 3 and 4. Regions stand for planes, their proxies; k-means on planes, with labels by
// flooding.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

enum class ProxyMetric : std::uint8_t {
  kL2,   // squared distance to the plane, integrated over the face
  kL21,  // squared difference of the unit normals, times the area of the face
};

// A plane, or a point if the normal is zero.
struct Proxy {
  Point center;
  Point normal;
};

struct Corners {
  Point a, b, c;
};

// Faces with the data that the metrics need, and their arcs in CSR form.
struct ProxySurface {
  Buffer<Corners> corners;            // (F,)
  Buffer<Point> normals;              // (F,) of length 1, or zero where a face has none
  std::vector<double> areas;          // (F,)
  std::vector<std::int64_t> offsets;  // (F + 1,)
  std::vector<Face> neighbors;        // (M,)

  Face n_faces() const { return static_cast<Face>(areas.size()); }
  Arcs arcs() const { return {offsets, neighbors}; }
};

ProxySurface make_proxy_surface(std::span<const Point> vertices, std::span<const Triangle> faces,
                                std::span<const double> areas,
                                std::span<const std::int64_t> offsets,
                                std::span<const Face> neighbors);

// The error of a face with respect to a proxy, >= 0.
//
// L2: against a proxy without a normal, the squared distance to its point, integrated.
// L21: 0 for a face without a normal. A proxy without a normal counts as orthogonal to all faces:
// that is the average over all directions.
double proxy_error(const ProxySurface& surface, ProxyMetric metric, Face face, const Proxy& proxy);

// The proxy of least error for each region 0..n_regions-1 of these labels; each must have a face.
//
// The center is the area-weighted barycenter; the plain mean of the centroids in a region without
// area. L2: the normal is the direction in which the region varies least, none without area. L21:
// it is the direction of the area-weighted sum of the normals, none where they cancel out.
std::vector<Proxy> fit_proxies(const ProxySurface& surface, ProxyMetric metric,
                               std::span<const Label> labels, Label n_regions);

// Regions grown from their proxies. `labels()` always are the result of flooding from `seeds()` by
// their proxies.
//
// A flood takes the seeds, then repeatedly the face with least error among all faces adjacent to a
// region, the first queued among equals; it joins that region. So regions are connected. If no seed
// reaches a face, the lowest such face becomes a seed, until all are reached. A new seed starts
// with the plane of its face as the proxy.
//
// Time O((F + M) log F) for each call that floods, on one thread. The same bits every time.
class ProxyRegions {
 public:
  // Distinct seeds, one at least.
  ProxyRegions(ProxySurface&& surface, ProxyMetric metric, std::span<const Face> seeds);

  // Fits the proxies to the regions, makes the faces of least error the seeds (those with a normal
  // first, then the lowest among equals), and floods. Returns the number of faces that changed
  // regions.
  std::int64_t relax();

  // The same with one more region. Of the regions with two faces or more, the one of largest error
  // (lowest label among equals) gives its face of largest error (except its seed; the highest index
  // among equals) as the new seed. There must be fewer regions than faces.
  void insert();

  Label n_regions() const { return static_cast<Label>(seeds_.size()); }
  const std::vector<Label>& labels() const { return labels_; }
  const std::vector<Face>& seeds() const { return seeds_; }

 private:
  // A face offered to a region.
  struct Candidate {
    double error;
    std::int64_t order;  // number of candidates before this one
    Face face;
    Label label;
  };

  // The errors of the faces of a region.
  struct RegionErrors {
    Face n_faces = 0;
    double total = 0.0;
    double least = 0.0;  // error of the seed; infinite if no face has a normal
  };

  std::vector<RegionErrors> fit();
  Face worst_face(const std::vector<RegionErrors>& regions) const;
  void flood();
  void plant(Face seed);
  void take(Face face, Label label);
  void offer_neighbors(Face face);
  void spread();

  const ProxySurface surface_;
  const ProxyMetric metric_;
  std::vector<Face> seeds_;          // (K,)
  std::vector<Proxy> proxies_;       // (K,)
  std::vector<Label> labels_;        // (F,)
  std::vector<double> least_offer_;  // (F,) least error at which a face is queued, or infinity
  std::vector<Candidate> queue_;     // a heap, the next one first; empty between floods
  std::int64_t n_offers_ = 0;        // candidates so far
};

}  // namespace superfacets
