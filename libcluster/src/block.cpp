// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/block.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>

#include "morton.hpp"
#include "scaling.hpp"
#include "terrace/cluster/local_search.hpp"

namespace terrace::cluster {
namespace {

constexpr std::size_t kFullBelow = 2500;

double distance(const Point3& a, const Point3& b) {
  const double x = a[0] - b[0];
  const double y = a[1] - b[1];
  const double z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

}  // namespace

struct BlockClusterer::Impl {
  std::vector<Point3> points;
  std::vector<std::uint32_t> codes, order;
};

BlockClusterer::BlockClusterer(SimdPath path) : impl_(std::make_unique<Impl>()) {
  if (path == SimdPath::avx2 || path == SimdPath::avx512) {
    throw std::invalid_argument("this SIMD path is not available on this machine");
  }
}
BlockClusterer::~BlockClusterer() = default;
BlockClusterer::BlockClusterer(BlockClusterer&&) noexcept = default;
BlockClusterer& BlockClusterer::operator=(BlockClusterer&&) noexcept = default;

void BlockClusterer::run(std::span<const Point3> points, std::span<const double> weights,
                         const BlockOptions& options, BlockClustering& result) {
  assert(weights.empty() || weights.size() == points.size());
  result.facilities.clear();
  result.assignment.assign(points.size(), 0);
  result.facility_cost = result.connection_cost = 0.0;
  if (points.empty()) return;

  const Scaling scaling(points);
  impl_->points.resize(points.size());
  impl_->codes.resize(points.size());
  impl_->order.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point3 p = scaling.scaled(points[i]);
    impl_->points[i] = p;
    const auto cell = [](double v) { return static_cast<std::uint32_t>(v * 1023.0); };
    impl_->codes[i] = morton_code(cell(p[0]), cell(p[1]), cell(p[2]));
  }
  std::iota(impl_->order.begin(), impl_->order.end(), 0u);
  std::stable_sort(impl_->order.begin(), impl_->order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return impl_->codes[a] < impl_->codes[b];
  });

  std::vector<std::uint32_t>& facilities = result.facilities;
  if (points.size() < kFullBelow || options.effort == Effort::full) {
    local_search(points, weights, options.facility_cost, SearchLength::log2_full, options.seed,
                 result);
    std::stable_sort(facilities.begin(), facilities.end(), [&](std::uint32_t a, std::uint32_t b) {
      return impl_->codes[a] < impl_->codes[b];
    });
  } else {
    constexpr std::size_t kStride = 100;
    for (std::size_t i = kStride / 2; i < points.size(); i += kStride) {
      facilities.push_back(impl_->order[i]);
    }
  }

  // Nearest facility, the lowest number among equals; duplicates of a facility are dropped.
  std::vector<std::uint32_t> used(facilities.size(), 0);
  result.connection_cost = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::uint32_t nearest = 0;
    double least = distance(impl_->points[i], impl_->points[facilities[0]]);
    for (std::uint32_t j = 1; j < facilities.size(); ++j) {
      const double d = distance(impl_->points[i], impl_->points[facilities[j]]);
      if (d < least) {
        least = d;
        nearest = j;
      }
    }
    result.assignment[i] = nearest;
    used[nearest] = 1;
    result.connection_cost += (weights.empty() ? 1.0 : weights[i]) * least;
  }
  std::uint32_t kept = 0;
  for (std::size_t j = 0; j < facilities.size(); ++j) {
    const bool keep = used[j] != 0;
    used[j] = kept;
    if (keep) facilities[kept++] = facilities[j];
  }
  facilities.resize(kept);
  for (std::uint32_t& a : result.assignment) a = used[a];
  result.facility_cost = scaling.unscaled(options.facility_cost * scaling.diagonal);
  result.connection_cost = scaling.unscaled(result.connection_cost);
}

SimdPath best_simd_path() { return SimdPath::portable; }

}  // namespace terrace::cluster
