// SPDX-License-Identifier: GPL-3.0-or-later
#include <cstddef>

namespace {
constexpr std::size_t kLanes = 8;
}
#include "wrap_scan_impl.hpp"

namespace terrace::tri::spatial {

std::size_t scan_avx512(const ScanVertices& vertices, const ScanFacet& facet, std::uint32_t* near) {
  return scan_with_lanes(vertices, facet, near);
}

}  // namespace terrace::tri::spatial
