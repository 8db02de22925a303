// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "terrace/tri/point_tin.hpp"
#include "tin/scan.hpp"

namespace terrace::tri::tin::rows {

/// Coordinates of frames are below this, so that predicates are exact in 128 bits.
inline constexpr double kMaxCoordinate = 0x1p20;
/// The largest number of columns or rows that fits into Triangle::place.
inline constexpr std::size_t kMaxRows = 65535;

/// True if the frame is an axis-parallel rectangle with integer coordinates of at least 0 and below
/// kMaxCoordinate, and lists its vertices counter-clockwise along the sides, including the corners.
bool is_rectangle(std::span<const Point3> frame);

/// Samples with the padding that scans require. Samples outside the frame are omitted.
struct PaddedSamples {
  std::vector<double> x, y, z;
  std::size_t known = 0;  ///< number of samples, including those outside the frame
  RowSamples layout{};    ///< without the arrays

  [[nodiscard]] RowSamples view() const;
};

/// Returns nullopt if the places are not regular enough for scans. frame: see is_rectangle().
/// Throws as point_tin() does for heights.
std::optional<PaddedSamples> padded_samples(const SampleRows& samples,
                                            std::span<const Point3> frame);
std::optional<PaddedSamples> padded_samples(const SampleGrid& samples,
                                            std::span<const Point3> frame);

}  // namespace terrace::tri::tin::rows
