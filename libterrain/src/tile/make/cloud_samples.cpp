// SPDX-License-Identifier: Apache-2.0
#include "tile/make/cloud_samples.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "base/parallel.hpp"

namespace terrace::terrain {
namespace {

constexpr double kPointsPerCell = 4;
constexpr std::size_t kConvertedAtOnce = std::size_t{1} << 16;

}  // namespace

CloudSamples::CloudSamples(const stream::Store& store, const StoredPlaces& places,
                           const EllipsoidalHeights& vertical, unsigned threads) {
  const stream::Box3& box = store.bounds();
  const double width = box.max[0] - box.min[0], height = box.max[1] - box.min[1];
  const double cells = std::max(1.0, static_cast<double>(store.points()) / kPointsPerCell);
  // As many columns as make the cells square.
  if (width > 0) {
    const double columns = height > 0 ? std::sqrt(cells) * std::sqrt(width / height) : cells;
    cells_[0] = static_cast<std::size_t>(std::clamp(columns, 1.0, cells));
  }
  if (height > 0) {
    cells_[1] = std::max<std::size_t>(static_cast<std::size_t>(cells) / cells_[0], 1);
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    from_[axis] = box.min[axis];
    const double length = box.max[axis] - box.min[axis];
    cells_per_unit_[axis] = length > 0 ? static_cast<double>(cells_[axis]) / length : 0.0;
  }
  sort_into_cells(store);
  drop_duplicates();
  place(store, places, vertical, threads);
}

std::size_t CloudSamples::column_or_row(std::size_t axis, double stored) const {
  const double at = (stored - from_[axis]) * cells_per_unit_[axis];
  // `!(at > 0)` also takes NaN, where a huge number meets 0.
  if (!(at > 0)) return 0;
  const auto last = static_cast<double>(cells_[axis] - 1);
  return static_cast<std::size_t>(std::min(at, last));
}

void CloudSamples::sort_into_cells(const stream::Store& store) {
  const auto for_each_point = [&](const auto& visit) {
    for (unsigned level = store.top() + 1; level-- > 0;) {
      store.for_each(level, [&](stream::ClusterId, const stream::ClusterRecord&,
                                const stream::ClusterPoints& cluster) {
        for (std::size_t i = 0; i < cluster.size(); ++i) {
          if (cluster.match(i)) visit(cluster.positions[i]);
        }
      });
    }
  };
  begin_.assign(cells_[0] * cells_[1] + 1, 0);
  for_each_point([&](const stream::Point3& p) { ++begin_[cell(p[0], p[1]) + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  samples_.resize(begin_.back());
  // begin_[c] goes from the cell's begin to its end, which is where the next one begins.
  std::uint32_t number = 0;
  for_each_point([&](const stream::Point3& p) {
    samples_[begin_[cell(p[0], p[1])]++] = {p[0], p[1], p[2], number++};
  });
  std::copy_backward(begin_.begin(), begin_.end() - 2, begin_.end() - 1);
  begin_.front() = 0;
}

void CloudSamples::drop_duplicates() {
  const auto same = [](const Sample& a, const Sample& b) {
    return a.longitude == b.longitude && a.latitude == b.latitude;
  };
  std::uint32_t kept = 0, first = 0;
  for (std::size_t c = 0; c + 1 < begin_.size(); ++c) {
    const std::uint32_t end = begin_[c + 1];
    const auto from = samples_.begin() + first, to = samples_.begin() + end;
    std::sort(from, to, [](const Sample& a, const Sample& b) {
      return std::tie(a.longitude, a.latitude, a.number) <
             std::tie(b.longitude, b.latitude, b.number);
    });
    const auto unique = std::unique(from, to, same);
    begin_[c] = kept;
    std::copy(from, unique, samples_.begin() + kept);
    kept += static_cast<std::uint32_t>(unique - from);
    first = end;
  }
  begin_.back() = kept;
  samples_.resize(kept);
}

void CloudSamples::place(const stream::Store& store, const StoredPlaces& places,
                         const EllipsoidalHeights& vertical, unsigned threads) {
  const stream::Channel& channel = store.schema().coordinates[2];
  const std::size_t pieces = (samples_.size() + kConvertedAtOnce - 1) / kConvertedAtOnce;
  parallel_for(pieces, threads, [&](unsigned, std::size_t piece) {
    store.check_stop();
    const std::size_t begin = piece * kConvertedAtOnce;
    const std::size_t end = std::min(begin + kConvertedAtOnce, samples_.size());
    std::vector<Point2> globe;
    std::vector<double> heights;
    for (std::size_t i = begin; i < end; ++i) {
      globe.push_back({samples_[i].longitude, samples_[i].latitude});
      heights.push_back(samples_[i].height * channel.scale + channel.offset);
    }
    places.to_geographic(globe);
    vertical.convert(globe, heights);
    for (std::size_t k = 0; k < globe.size(); ++k) {
      // What has no place on the globe, or no height, lies in no box.
      const bool there = std::isfinite(heights[k]);
      samples_[begin + k] = {there ? globe[k][0] : NAN, there ? globe[k][1] : NAN, heights[k],
                             samples_[begin + k].number};
    }
  });
}

void CloudSamples::add(const StoredBox& window, const GeographicBox& box, SurfaceSamples& out,
                       std::vector<std::uint64_t>& order) const {
  order.clear();
  const std::size_t x0 = column_or_row(0, window.min[0]), x1 = column_or_row(0, window.max[0]);
  const std::size_t y0 = column_or_row(1, window.min[1]), y1 = column_or_row(1, window.max[1]);
  for (std::size_t y = y0; y <= y1; ++y) {
    const std::uint32_t end = begin_[y * cells_[0] + x1 + 1];
    for (std::uint32_t i = begin_[y * cells_[0] + x0]; i < end; ++i) {
      const Sample& s = samples_[i];
      if (s.longitude >= box.west && s.longitude <= box.east && s.latitude >= box.south &&
          s.latitude <= box.north) {
        order.push_back(std::uint64_t{s.number} << 32 | i);
      }
    }
  }
  std::sort(order.begin(), order.end());
  for (const std::uint64_t one : order) {
    const Sample& s = samples_[static_cast<std::uint32_t>(one)];
    out.longitude.push_back(s.longitude);
    out.latitude.push_back(s.latitude);
    out.height.push_back(s.height);
  }
}

}  // namespace terrace::terrain
