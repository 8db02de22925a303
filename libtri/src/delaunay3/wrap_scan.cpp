// SPDX-License-Identifier: GPL-3.0-or-later
#include "wrap_scan.hpp"

#include <limits>

namespace terrace::tri::spatial {
namespace {

constexpr std::size_t kLanes = 2;
using Lanes = double __attribute__((vector_size(kLanes * sizeof(double))));
using Unaligned = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(8)));

Lanes all(double value) { return value - Lanes{}; }

double scan(const double* x, const double* y, const double* z, std::size_t count,
            const ScanFacet& facet, double* power, double* volume) {
  const Lanes infinity = all(std::numeric_limits<double>::infinity());
  Lanes least = infinity;
  const Lanes zero{};
  for (std::size_t i = 0; i < count; i += kLanes) {
    const Lanes wx = *reinterpret_cast<const Unaligned*>(x + i) - facet.corner[0];
    const Lanes wy = *reinterpret_cast<const Unaligned*>(y + i) - facet.corner[1];
    const Lanes wz = *reinterpret_cast<const Unaligned*>(z + i) - facet.corner[2];
    const Lanes t = facet.normal[0] * wx + facet.normal[1] * wy + facet.normal[2] * wz;
    const Lanes s = wx * (wx - facet.diameter[0]) + wy * (wy - facet.diameter[1]) +
                    wz * (wz - facet.diameter[2]);
    *reinterpret_cast<Unaligned*>(power + i) = s;
    *reinterpret_cast<Unaligned*>(volume + i) = t;
    const Lanes above = s + facet.power_error;
    const Lanes ratio =
        above / (t + (above > zero ? all(-facet.volume_error) : all(facet.volume_error)));
    const Lanes counted = t > all(facet.volume_error) ? ratio : infinity;
    least = counted < least ? counted : least;
  }
  double result = least[0];
  for (std::size_t i = 1; i < kLanes; ++i) result = least[i] < result ? least[i] : result;
  return result;
}

}  // namespace

ScanFunction scan_function() { return &scan; }

}  // namespace terrace::tri::spatial
