// Variational Shape Approximation (Cohen-Steiner, Alliez and Desbrun 2004), an alternative to
// stages 3 and 4. The method is a variant of k-means with planes: each region has a proxy, a plane
// that approximates the region. Labels are assigned by region growing (flooding) from seeds.
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

// The faces of a mesh, with the data that the metrics need and the arcs in CSR form.
struct ProxySurface {
  Buffer<Corners> corners;            // (F,) positions of the corners of each face
  Buffer<Point> normals;              // (F,) unit normal of each face; zero if it has no normal
  std::vector<double> areas;          // (F,) area of each face
  std::vector<std::int64_t> offsets;  // (F + 1,) start of each face in `neighbors`
  std::vector<Face> neighbors;        // (M,) target face of each arc

  Face n_faces() const { return static_cast<Face>(areas.size()); }
  Arcs arcs() const { return {offsets, neighbors}; }
};

ProxySurface make_proxy_surface(std::span<const Point> vertices, std::span<const Triangle> faces,
                                std::span<const double> areas,
                                std::span<const std::int64_t> offsets,
                                std::span<const Face> neighbors);

// The error of a face with respect to a proxy, >= 0.
//
// For L2 and a proxy without a normal, the error is the integral of the squared distance to the
// center of the proxy. For L21, the error of a face without a normal is 0. For L21 and a proxy
// without a normal, the error is its average over all directions of the proxy's normal.
double proxy_error(const ProxySurface& surface, ProxyMetric metric, Face face, const Proxy& proxy);

// Returns the proxy with the least error for each region 0..n_regions-1. Each region must have a
// face.
//
// The center of a proxy is the area-weighted mean of the centroids of the faces (unweighted, if the
// area is 0). For L2, the normal is the direction of least variance, or zero if the area is 0. For
// L21, the normal is the direction of the area-weighted sum of the normals, or zero if the normals
// cancel out.
std::vector<Proxy> fit_proxies(const ProxySurface& surface, ProxyMetric metric,
                               std::span<const Label> labels, Label n_regions);

// Regions with their proxies. labels() is always the result of a flood from seeds() with the
// current proxies.
//
// A flood first labels the seeds. Then it repeatedly chooses the pair of a region and an adjacent
// face with the least error (the pair queued first, if errors are equal), and adds the face to the
// region. So regions are connected. As long as there are unreached faces, the lowest of them
// becomes another seed. The proxy of a new seed is the plane of its face.
//
// Time O((F + M) log F) for each call that floods. Runs on one thread, so results have the same
// bits every time.
class ProxyRegions {
 public:
  // `seeds` contains at least one face, and no duplicates.
  ProxyRegions(ProxySurface&& surface, ProxyMetric metric, std::span<const Face> seeds);

  // Fits the proxies to the regions, chooses new seeds, and floods. The new seed of a region is its
  // face with the least error among the faces with a normal, and the lowest of them if errors are
  // equal. Returns the number of faces whose label has changed.
  std::int64_t relax();

  // Like relax(), but adds one region. Among the regions with at least two faces, the region with
  // the largest total error (the lowest of them, if errors are equal) is chosen. The new seed is
  // the face with the largest error in this region, except the seed of the region (the highest
  // face, if errors are equal). There must be fewer regions than faces.
  void insert();

  Label n_regions() const { return static_cast<Label>(seeds_.size()); }
  const std::vector<Label>& labels() const { return labels_; }
  const std::vector<Face>& seeds() const { return seeds_; }

 private:
  // A face that may be added to a region.
  struct Candidate {
    double error;
    std::int64_t order;  // number of candidates that were queued earlier
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
  std::vector<Face> seeds_;          // (K,) seed of each region
  std::vector<Proxy> proxies_;       // (K,) proxy of each region
  std::vector<Label> labels_;        // (F,) region of each face
  std::vector<double> least_offer_;  // (F,) least error of a queued candidate, or infinity
  std::vector<Candidate> queue_;     // heap of candidates; empty between floods
  std::int64_t n_offers_ = 0;        // number of candidates queued in this flood
};

}  // namespace superfacets
