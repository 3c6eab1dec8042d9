// Variational Shape Approximation (Cohen-Steiner, Alliez and Desbrun 2004), an alternative to
// stages 3 and 4. It is k-means with planes: each region has a proxy, a plane that approximates the
// region, and floods assign labels.
#pragma once

#include "base/buffer.hpp"
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
// L2: If the proxy has no normal, the error is the integral of the squared distance to its center.
// L21: A face without a normal has error 0. If the proxy has no normal, the error is the average
// over all directions.
double proxy_error(const ProxySurface& surface, ProxyMetric metric, Face face, const Proxy& proxy);

// The proxy of least error for each region 0..n_regions-1. Each region must have a face.
//
// The center is the area-weighted barycenter, or the mean of the centroids in a region without
// area. L2: The normal is the direction in which the region varies least, or zero in a region
// without area. L21: The normal is the direction of the area-weighted sum of the normals, or zero
// if the normals cancel out.
std::vector<Proxy> fit_proxies(const ProxySurface& surface, ProxyMetric metric,
                               std::span<const Label> labels, Label n_regions);

// Regions around proxies. `labels()` is always the result of a flood from `seeds()` with the
// current proxies.
//
// A flood first labels the seeds. Then it repeatedly chooses the pair of a region and an adjacent
// face with the least error, and adds the face to the region. Ties go to the pair queued first. So
// regions are connected. While faces are unreached, the lowest unreached face becomes another seed.
// The proxy of a new seed is the plane of its face.
//
// Time O((F + M) log F) for each call that floods. Runs on one thread, so results have the same
// bits every time.
class ProxyRegions {
 public:
  // Seeds are distinct; there is at least one.
  ProxyRegions(ProxySurface&& surface, ProxyMetric metric, std::span<const Face> seeds);

  // Fits the proxies to the regions, chooses new seeds, and floods. The seed of a region is its
  // face of least error; faces with a normal come first, and ties go to the lowest index. Returns
  // the number of faces that changed regions.
  std::int64_t relax();

  // Like `relax`, with one more region. The new seed comes from the region of largest total error
  // among regions with two faces or more; ties go to the lowest label. The new seed is the face of
  // largest error in that region, except the seed of the region; ties go to the highest index.
  // There must be fewer regions than faces.
  void insert();

  Label n_regions() const { return static_cast<Label>(seeds_.size()); }
  const std::vector<Label>& labels() const { return labels_; }
  const std::vector<Face>& seeds() const { return seeds_; }

 private:
  // A face offered to a region.
  struct Candidate {
    double error;
    std::int64_t order;  // number of candidates queued earlier
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
