// SPDX-License-Identifier: GPL-3.0-or-later
#include "synth/synth_cloud.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <numbers>

#include <terrace/base/portable_math.hpp>
#include <terrace/base/random.hpp>

#include "base/units.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::tools {

using namespace terrain;
namespace {

/// Returns the k-th random number of point `n`, in [0, 1).
double random_unit(std::uint64_t seed, std::uint64_t n, std::uint64_t k) {
  return base::unit_interval(base::splitmix64(base::splitmix64(seed ^ (k << 48)) + n));
}

/// Returns the nearest multiple of 1/units.
double rounded(double value, double units) { return std::nearbyint(value * units) / units; }

/// Returns a uniformly random direction, by rejection from the cube.
stream::Point3 random_direction(std::uint64_t seed, std::uint64_t n) {
  stream::Point3 v{};
  double square = 0;
  for (std::uint64_t k = 0; square < 1e-4 || square > 1; k += 3) {
    square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      v[axis] = 2 * random_unit(seed, n, k + axis) - 1;
      square += v[axis] * v[axis];
    }
  }
  for (double& x : v) x /= std::sqrt(square);
  return v;
}

/// The cloud of surface_cloud().
class CloudSurface {
 public:
  CloudSurface(std::uint64_t points, std::uint64_t seed) : seed_(seed) {
    for (std::size_t i = 0; i < waves_.size(); ++i) {
      // The waves range from broad lobes to fine bumps, which are flatter.
      const double cycles = 1.0 + 0.8 * static_cast<double>(i * i) / 4;
      waves_[i].direction = random_direction(base::splitmix64(seed), i);
      waves_[i].degrees = 57.3 * cycles;
      waves_[i].phase = 360 * random_unit(base::splitmix64(seed), i, 9);
      waves_[i].amplitude = 0.12 / cycles;
    }
    // Reduce the spacing until the swaths have room for all points. The last one is not quite full.
    spacing_ =
        std::sqrt(4 * std::numbers::pi / static_cast<double>(std::max<std::uint64_t>(points, 8)));
    while (make_swaths() < points) spacing_ *= 0.999;
  }

  stream::Point3 operator()(std::uint64_t n) const {
    const auto next = std::upper_bound(swaths_.begin(), swaths_.end(), n,
                                       [](std::uint64_t v, const Swath& s) { return v < s.first; });
    const Swath& swath = *(next - 1);
    const std::uint64_t line = (n - swath.first) / swath.across;
    const std::uint64_t across = (n - swath.first) % swath.across;
    const double jitter_a = 0.6 * (random_unit(seed_, n, 1) - 0.5);
    const double jitter_b = 0.6 * (random_unit(seed_, n, 2) - 0.5);
    const double latitude = swath.south + (swath.north - swath.south) *
                                              ((static_cast<double>(across) + 0.5 + jitter_a) /
                                               static_cast<double>(swath.across));
    const double longitude =
        360 * (static_cast<double>(line) + 0.5 + jitter_b) / static_cast<double>(swath.lines);
    const double c = base::cos_degrees(latitude);
    const stream::Point3 d{c * base::cos_degrees(longitude), c * base::sin_degrees(longitude),
                           base::sin_degrees(latitude)};
    double radius = 1;
    for (const Wave& wave : waves_) {
      const double along =
          d[0] * wave.direction[0] + d[1] * wave.direction[1] + d[2] * wave.direction[2];
      radius += wave.amplitude * base::sin_degrees(along * wave.degrees + wave.phase);
    }
    radius += 0.05 * spacing_ * (random_unit(seed_, n, 3) - 0.5);  // the scanner's noise
    constexpr double kMetres = 100, kMillimetres = 1000;
    return {rounded(kMetres * radius * d[0], kMillimetres),
            rounded(kMetres * radius * d[1], kMillimetres),
            rounded(kMetres * radius * d[2], kMillimetres)};
  }

 private:
  struct Wave {
    stream::Point3 direction{};
    double degrees = 0, phase = 0, amplitude = 0;
  };
  struct Swath {
    std::uint64_t first = 0, across = 1, lines = 1;
    double south = 0, north = 0;  ///< latitudes, degrees
  };

  /// Sets swaths_ from pole to pole at the current spacing. Returns their number of points.
  std::uint64_t make_swaths() {
    constexpr double kAcross = 500;
    const double spacing_degrees = spacing_ / base::kRadiansPerDegree;
    const auto count = static_cast<std::uint64_t>(std::ceil(180 / (kAcross * spacing_degrees)));
    swaths_.clear();
    std::uint64_t points = 0;
    for (std::uint64_t i = 0; i < count; ++i) {
      Swath s;
      s.first = points;
      s.south = -90 + 180 * static_cast<double>(i) / static_cast<double>(count);
      s.north = -90 + 180 * static_cast<double>(i + 1) / static_cast<double>(count);
      s.across = static_cast<std::uint64_t>(std::ceil((s.north - s.south) / spacing_degrees));
      // The mean circumference of the swath, from the height of its zone.
      const double circle = 2 * std::numbers::pi *
                            (base::sin_degrees(s.north) - base::sin_degrees(s.south)) /
                            ((s.north - s.south) * base::kRadiansPerDegree);
      s.lines = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(circle / spacing_));
      points += s.across * s.lines;
      swaths_.push_back(s);
    }
    return points;
  }

  std::uint64_t seed_;
  double spacing_ = 1;
  std::array<Wave, 10> waves_;
  std::vector<Swath> swaths_;
};

constexpr double kMillionths = 1e6;

}  // namespace

Cloud surface_cloud(std::uint64_t points, std::uint64_t seed) { return CloudSurface(points, seed); }

Cloud uniform_cloud(std::uint64_t seed) {
  return [seed](std::uint64_t n) -> stream::Point3 {
    return {rounded(random_unit(seed, n, 0), kMillionths),
            rounded(random_unit(seed, n, 1), kMillionths),
            rounded(random_unit(seed, n, 2), kMillionths)};
  };
}

Cloud cluster_cloud(std::uint64_t points, std::uint64_t seed) {
  const std::uint64_t blobs = std::max<std::uint64_t>(1, points / 1000);
  const std::uint64_t per_blob = std::max<std::uint64_t>(1, (points + blobs - 1) / blobs);
  return [seed, per_blob](std::uint64_t n) {
    const std::uint64_t blob = n / per_blob;
    const double deviation = 0.002 + 0.02 * random_unit(base::splitmix64(seed), blob, 3);
    stream::Point3 p{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // The sum of twelve uniform numbers minus 6 has variance 1 and is within 1 % of the normal
      // density where that matters.
      double sum = -6;
      for (std::uint64_t k = 0; k < 12; ++k) sum += random_unit(seed, n, axis * 12 + k);
      p[axis] =
          rounded(random_unit(base::splitmix64(seed), blob, axis) + deviation * sum, kMillionths);
    }
    return p;
  };
}

Permutation::Permutation(std::uint64_t size, std::uint64_t seed)
    : size_(size),
      seed_(base::splitmix64(seed)),
      half_bits_(static_cast<unsigned>(std::bit_width(std::max<std::uint64_t>(size, 2) - 1) + 1) /
                 2) {}

std::uint64_t Permutation::operator()(std::uint64_t n) const {
  const std::uint64_t mask = (std::uint64_t{1} << half_bits_) - 1;
  do {
    std::uint64_t left = n >> half_bits_, right = n & mask;
    for (std::uint64_t round = 0; round < 4; ++round) {
      const std::uint64_t mixed = left ^ (base::splitmix64(seed_ + round + (right << 3)) & mask);
      left = right;
      right = mixed;
    }
    n = left << half_bits_ | right;
  } while (n >= size_);
  return n;
}

DeliveryOrder::DeliveryOrder(const std::string& shuffle, std::uint64_t points, std::uint64_t seed,
                             std::uint64_t memory_bytes) {
  if (shuffle.empty()) return;
  if (shuffle == "all") {
    all_ = std::make_unique<Permutation>(std::max<std::uint64_t>(points, 1), seed);
    return;
  }
  std::uint64_t least = 0, most = 0;
  const std::size_t dash = shuffle.find('-');
  if (!shuffle.starts_with("pieces:") || dash == std::string::npos) {
    throw UsageError("--shuffle '" + shuffle + "': write all or pieces:MIN-MAX");
  }
  least = parse_count(shuffle.substr(7, dash - 7));
  most = parse_count(shuffle.substr(dash + 1));
  if (least < 1 || most < least) {
    throw UsageError("--shuffle '" + shuffle + "': pieces have at least 1 point, and MIN <= MAX");
  }
  if (points / ((least + most) / 2) > memory_bytes / 32) {
    throw stream::Error(
        {}, "the table of that many pieces does not fit into " + readable_bytes(memory_bytes))
        .remedy("make the pieces longer or raise --memory");
  }
  std::vector<std::uint64_t> starts;
  for (std::uint64_t start = 0; start < points;) {
    starts.push_back(start);
    start += least + static_cast<std::uint64_t>(random_unit(seed, starts.size(), 77) *
                                                static_cast<double>(most - least + 1));
  }
  const Permutation order(std::max<std::size_t>(starts.size(), 1), seed);
  std::uint64_t position = 0;
  for (std::uint64_t i = 0; i < starts.size(); ++i) {
    const std::uint64_t piece = order(i);
    positions_.push_back(position);
    numbers_.push_back(starts[piece]);
    position += (piece + 1 < starts.size() ? starts[piece + 1] : points) - starts[piece];
  }
}

std::uint64_t DeliveryOrder::operator()(std::uint64_t n) const {
  if (all_) return (*all_)(n);
  if (positions_.empty()) return n;
  const auto next = std::upper_bound(positions_.begin(), positions_.end(), n);
  const auto piece = static_cast<std::size_t>(next - positions_.begin()) - 1;
  return numbers_[piece] + (n - positions_[piece]);
}

}  // namespace terrace::tools
