// SPDX-License-Identifier: Apache-2.0
#include "tile/make/cloud_samples.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/parallel.hpp"

namespace terrace::terrain {

CloudSamples::CloudSamples(const stream::Store& store, const StoredPlaces& places,
                           const EllipsoidalHeights& vertical, unsigned threads) {
  constexpr std::size_t kConvertedAtOnce = std::size_t{1} << 16;
  crowd_ = !cells_.load_all(store, 0, threads);
  const std::span<const Point2> stored = cells_.places();
  samples_ = large_array<Sample>(stored.size());
  const std::size_t pieces = (stored.size() + kConvertedAtOnce - 1) / kConvertedAtOnce;
  parallel_for(pieces, threads, [&](std::size_t piece) {
    store.check_stop();
    const std::size_t begin = piece * kConvertedAtOnce;
    const std::size_t count = std::min(kConvertedAtOnce, stored.size() - begin);
    const std::span<const Point2> part = stored.subspan(begin, count);
    const std::span<const double> part_heights = cells_.heights().subspan(begin, count);
    std::vector<Point2> globe(part.begin(), part.end());
    std::vector<double> heights(part_heights.begin(), part_heights.end());
    places.to_geographic(globe);
    vertical.convert(globe, heights);
    for (std::size_t k = 0; k < count; ++k) {
      // NaN for a point without a place or height on the globe, so that it is in no box.
      const bool there = std::isfinite(heights[k]);
      samples_[begin + k] = {there ? globe[k][0] : NAN, there ? globe[k][1] : NAN, heights[k]};
    }
  });
}

void CloudSamples::add(const StoredBox& window, const GeographicBox& box,
                       SurfaceSamples& out) const {
  cells_.visit_indices(cells_.cells_of(window), [&](std::uint32_t i) {
    const Sample& s = samples_[i];
    if (!(s.longitude >= box.west && s.longitude <= box.east && s.latitude >= box.south &&
          s.latitude <= box.north)) {
      return;
    }
    out.longitude.push_back(s.longitude);
    out.latitude.push_back(s.latitude);
    out.height.push_back(s.height);
  });
}

}  // namespace terrace::terrain
