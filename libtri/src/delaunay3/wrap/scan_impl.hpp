// SPDX-License-Identifier: Apache-2.0
#pragma once

// Included once for each instruction set, after the definition of kLanes and of a function
// bits_of() for masks. This code must not be shared between objects, so all names are local to the
// object, and no function of another header is called.
#include "scan.hpp"

namespace terrace::tri::spatial {
namespace {

// Loads from memory aligned for one double only.
[[gnu::always_inline]] inline Lanes load(const double* from) {
  Lanes lanes;
  __builtin_memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
[[gnu::always_inline]] inline void store(double* to, Lanes lanes) {
  __builtin_memcpy(to, &lanes, sizeof lanes);
}

constexpr double kNoQuotient = __builtin_inf();

/// Writes powers and volumes. Returns an upper bound of the least quotient: the quotient of the
/// vertex that has the least up to rounding, among those of certainly positive volume, or infinity
/// if there is none.
[[gnu::always_inline]] inline double measure_all(const ScanVertices& v, const ScanFacet& f) {
  const Lanes volume_error = f.volume_error - Lanes{};
  Lanes best_power = kNoQuotient - Lanes{};
  Lanes best_volume = 1.0 - Lanes{};
  for (std::size_t i = 0; i < v.count; i += kLanes) {
    const Lanes x = load(v.x + i) - f.corner[0];
    const Lanes y = load(v.y + i) - f.corner[1];
    const Lanes z = load(v.z + i) - f.corner[2];
    const Lanes volume = f.normal[0] * x + f.normal[1] * y + f.normal[2] * z;
    const Lanes power = x * (x - f.diameter[0]) + y * (y - f.diameter[1]) + z * (z - f.diameter[2]);
    store(v.power + i, power);
    store(v.volume + i, volume);
    const Mask better = (volume > volume_error) & (power * best_volume < best_power * volume);
    best_power = better ? power : best_power;
    best_volume = better ? volume : best_volume;
  }
  const Lanes power = best_power + f.power_error;
  const Lanes ratio = power / (best_volume + (power > 0.0 ? -volume_error : volume_error));
  const Lanes quotient = best_power < kNoQuotient ? ratio : kNoQuotient - Lanes{};
  double least[kLanes];
  for (std::size_t i = 0; i < kLanes; ++i) least[i] = quotient[i];
  for (std::size_t half = kLanes / 2; half > 0; half /= 2)
    for (std::size_t i = 0; i < half; ++i)
      least[i] = least[i + half] < least[i] ? least[i + half] : least[i];
  return least[0];
}

[[gnu::always_inline]] inline std::size_t scan_with_lanes(const ScanVertices& v, const ScanFacet& f,
                                                          std::uint32_t* near) {
  const double least = measure_all(v, f);
  const bool any = least < kNoQuotient;
  const double factor = any ? least : 0;
  const double margin =
      any ? f.power_error + (least < 0 ? -least : least) * f.volume_error : kNoQuotient;
  std::size_t listed = 0;
  for (std::size_t i = 0; i < v.count; i += kScanPadding) {
    unsigned hits = 0;
    for (std::size_t k = 0; k < kScanPadding; k += kLanes) {
      const Lanes power = load(v.power + i + k);
      const Lanes volume = load(v.volume + i + k);
      const Mask hit = (volume + f.volume_error > 0.0) & (power - factor * volume <= margin);
      hits |= bits_of(hit) << k;
    }
    for (; hits != 0; hits &= hits - 1)
      near[listed++] = static_cast<std::uint32_t>(i) + static_cast<unsigned>(__builtin_ctz(hits));
  }
  return listed;
}

}  // namespace
}  // namespace terrace::tri::spatial
