// Variational Shape Approximation (Cohen-Steiner, Alliez and Desbrun 2004): an alternative to
// stages 3 and 4. This is k-means with planes: each region has a proxy, a plane that approximates
// it, and labels are assigned by flooding.
#pragma once

#include <vector>

#include "base/buffer.hpp"
#include "base/types.hpp"
#include "cells/arcs.hpp"

namespace superfacets {

enum class ProxyMetric : std::uint8_t {
  kL2,   // squared distance to the plane of the proxy, integrated over the face
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
  Buffer<Point> normals;              // (F,) of length 1; zero where a face has no normal
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
// L2: if the proxy has no normal, its center replaces the plane: the error is the integral of the
// squared distance to the center. L21: a face without a normal has error 0. A proxy without a
// normal counts as orthogonal to all faces, which gives the average error over all directions.
double proxy_error(const ProxySurface& surface, ProxyMetric metric, Face face, const Proxy& proxy);

// The proxy of least error for each region 0..n_regions-1 of these labels. Each region must have a
// face.
//
// The center is the area-weighted barycenter; in a region without area, the mean of the centroids.
// L2: the normal is the direction in which the region varies least; zero in a region without area.
// L21: the normal is the direction of the area-weighted sum of the normals; zero where the normals
// cancel out.
std::vector<Proxy> fit_proxies(const ProxySurface& surface, ProxyMetric metric,
                               std::span<const Label> labels, Label n_regions);

// Regions grown from their proxies. `labels()` is always the result of flooding from `seeds()` with
// the current proxies.
//
// A flood first labels the seeds. Then, of all faces adjacent to a region, it repeatedly adds the
// face with least error to that region, the first queued among equals. So regions are connected. If
// no seed reaches a face, the lowest unreached face becomes another seed, until all are reached.
// The proxy of a new seed is the plane of its face.
//
// Time O((F + M) log F) for each call that floods, on one thread. The same bits every time.
class ProxyRegions {
 public:
  // Seeds are distinct; there is at least one.
  ProxyRegions(ProxySurface&& surface, ProxyMetric metric, std::span<const Face> seeds);

  // Fits the proxies to the regions. In each region, makes the face of least error the seed (faces
  // with a normal first, the lowest index among equals). Floods. Returns the number of faces that
  // changed regions.
  std::int64_t relax();

  // Like `relax`, with one more region. Its seed comes from the region of largest total error among
  // regions with two faces or more (the lowest label among equals). The new seed is the face of
  // largest error in that region (the highest index among equals), but not the seed of the region.
  // There must be fewer regions than faces.
  void insert();

  Label n_regions() const { return static_cast<Label>(seeds_.size()); }
  const std::vector<Label>& labels() const { return labels_; }
  const std::vector<Face>& seeds() const { return seeds_; }

 private:
  // A face offered to a region.
  struct Candidate {
    double error;
    std::int64_t order;  // number of candidates queued before this one
    Face face;
    Label label;
  };

  // Errors of the faces of a region with respect to its proxy.
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
  std::vector<Candidate> queue_;     // a heap with the next candidate first; empty between floods
  std::int64_t n_offers_ = 0;        // number of candidates queued in this flood
};

}  // namespace superfacets
