// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scan.hpp"
#include "terrace/tri/point_tin.hpp"

namespace terrace::tri::tin::rows {

/// Coordinates of frames are below this: predicates are exact in 128 bits.
inline constexpr double kFarthest = 0x1p20;
/// Columns and rows are at most as many: both fit into Triangle::place.
inline constexpr std::size_t kMostRows = 65535;

/// Whether the frame is an upright rectangle with whole coordinates from 0 to kFarthest, its
/// vertices counter-clockwise along the sides, the corners among them.
bool is_rectangle(std::span<const Point3> frame);

/// Samples as scans want them; what lies outside the frame is no sample.
struct PaddedSamples {
  std::vector<double> x, y, z;
  std::size_t known = 0;  ///< samples, those outside the frame too
  RowSamples layout{};    ///< without the arrays

  [[nodiscard]] RowSamples view() const;
};

/// Nothing, if they do not stand as a RowSurface needs it. frame: see is_rectangle(). Throws as
/// point_tin() does for heights.
std::optional<PaddedSamples> padded_samples(const SampleRows& samples,
                                            std::span<const Point3> frame);
std::optional<PaddedSamples> padded_samples(const SampleGrid& samples,
                                            std::span<const Point3> frame);

}  // namespace terrace::tri::tin::rows
