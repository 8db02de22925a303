// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Included once for each instruction set, with kLanes defined before: what is here must not be
// shared between objects, so nothing has a name outside its object, and no function of another
// header is called.
#include "wrap_scan.hpp"

namespace terrace::tri::spatial {
namespace {

using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Loaded = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(8), may_alias));
using Mask = std::int64_t __attribute__((vector_size(kLanes * sizeof(double))));

constexpr double kNothing = __builtin_inf();

/// Writes powers and volumes. Returns an upper bound of the least quotient, or infinity: that of
/// the vertex that has it up to rounding, among those of certainly positive volume.
[[gnu::always_inline]] inline double measure_all(const ScanVertices& v, const ScanFacet& f) {
  const Lanes volume_error = f.volume_error - Lanes{};
  Lanes best_power = kNothing - Lanes{};
  Lanes best_volume = 1.0 - Lanes{};
  for (std::size_t i = 0; i < v.count; i += kLanes) {
    const Lanes x = *reinterpret_cast<const Loaded*>(v.x + i) - f.corner[0];
    const Lanes y = *reinterpret_cast<const Loaded*>(v.y + i) - f.corner[1];
    const Lanes z = *reinterpret_cast<const Loaded*>(v.z + i) - f.corner[2];
    const Lanes volume = f.normal[0] * x + f.normal[1] * y + f.normal[2] * z;
    const Lanes power = x * (x - f.diameter[0]) + y * (y - f.diameter[1]) + z * (z - f.diameter[2]);
    *reinterpret_cast<Loaded*>(v.power + i) = power;
    *reinterpret_cast<Loaded*>(v.volume + i) = volume;
    const Mask better = (volume > volume_error) & (power * best_volume < best_power * volume);
    best_power = better ? power : best_power;
    best_volume = better ? volume : best_volume;
  }
  double least = kNothing;
  for (std::size_t i = 0; i < kLanes; ++i) {
    if (!(best_power[i] < kNothing)) continue;
    const double power = best_power[i] + f.power_error;
    const double ratio =
        power / (power > 0 ? best_volume[i] - f.volume_error : best_volume[i] + f.volume_error);
    least = ratio < least ? ratio : least;
  }
  return least;
}

[[gnu::always_inline]] inline std::size_t scan_with_lanes(const ScanVertices& v, const ScanFacet& f,
                                                          std::uint32_t* near) {
  const double least = measure_all(v, f);
  const bool any = least < kNothing;
  const double factor = any ? least : 0;
  const double margin =
      any ? f.power_error + (least < 0 ? -least : least) * f.volume_error : kNothing;
  std::size_t listed = 0;
  // Hits are rare: eight vertices are asked at once whether one of them is.
  for (std::size_t i = 0; i < v.count; i += kScanPadding) {
    Mask hits{};
    for (std::size_t k = i; k < i + kScanPadding; k += kLanes) {
      const Lanes power = *reinterpret_cast<const Loaded*>(v.power + k);
      const Lanes volume = *reinterpret_cast<const Loaded*>(v.volume + k);
      hits |= (volume + f.volume_error > 0.0) & (power - factor * volume <= margin);
    }
    std::int64_t hit = 0;
    for (std::size_t k = 0; k < kLanes; ++k) hit |= hits[k];
    if (hit == 0) [[likely]]
      continue;
    for (std::size_t k = i; k < i + kScanPadding; ++k)
      if (v.volume[k] + f.volume_error > 0 && v.power[k] - factor * v.volume[k] <= margin)
        near[listed++] = static_cast<std::uint32_t>(k);
  }
  return listed;
}

}  // namespace
}  // namespace terrace::tri::spatial
