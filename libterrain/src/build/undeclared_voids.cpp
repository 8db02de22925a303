// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/undeclared_voids.hpp"

#include <algorithm>
#include <cmath>

#include "base/units.hpp"

namespace terrace::terrain {
namespace {

constexpr double kMost = 1e30;
/// Nodata values that programs commonly write, the greatest first: -9999 is Esri's, -10000 is black
/// in Mapbox's encoding, -32768 is used by SRTM files and Terrarium's encoding.
constexpr std::array<double, 8> kUsualVoids{-9999,  -10000, -32767,  -32768,
                                            -99999, -99998, -999999, -2147483648.0};
/// A common value counts as nodata only if all other heights exceed it by more than this.
constexpr double kApart = 1000;

}  // namespace

void UndeclaredVoids::add(const stream::PointBlock& block) {
  Tally tally;
  for (const stream::Point3& point : block.positions) {
    const double z = height(point[2]);
    if (z > kUsualVoids.front() && z <= kMost) {
      tally.least = std::min(tally.least, z);
      continue;
    }
    if (!(std::abs(z) <= kMost)) {
      ++tally.beyond;
      tally.value = point[2];
      continue;
    }
    // A raster declares the nodata value of its samples, before scale and offset.
    const auto* const usual =
        std::find_if(kUsualVoids.begin(), kUsualVoids.end(),
                     [&](double value) { return z == value || (info_.grid && point[2] == value); });
    if (usual == kUsualVoids.end()) {
      tally.least = std::min(tally.least, z);
    } else {
      ++tally.usual[static_cast<std::size_t>(usual - kUsualVoids.begin())];
    }
  }
  const std::lock_guard lock(mutex_);
  if (tally.beyond > 0) tally_.value = tally.value;
  tally_.beyond += tally.beyond;
  tally_.least = std::min(tally_.least, tally.least);
  for (std::size_t i = 0; i < kUsual; ++i) tally_.usual[i] += tally.usual[i];
}

stream::Message UndeclaredVoids::note_of(std::uint64_t count, double stored,
                                         const std::string& heights) const {
  const std::string value = number_text(stored);
  stream::Message remedy;
  if (!info_.grid) {
    const std::string limit = std::abs(stored) > kMost ? (stored > 0 ? "1e30" : "-1e30") : value;
    remedy = stream::message("leave them out: {where} 'z {} {}'", stored > 0 ? "<" : ">", limit);
  } else if (info_.format == "ascii-grid" || info_.format == "binary-grid") {
    remedy = "declare the value in the header: NODATA_value " + value;
  } else {
    remedy = "declare the value: gdal_edit.py -a_nodata " + value + " FILE";
  }
  const bool one = count == 1;
  return stream::message("{}{} {} {}, and {} kept; if {} no data, {}",
                         info_.files.size() == 1 ? info_.files.front() + ": " : "",
                         counted(count, info_.grid ? "cell" : "point"), one ? "has" : "have",
                         heights, one ? "is" : "are", one ? "that means" : "these mean", remedy);
}

stream::Message UndeclaredVoids::note() const {
  if (tally_.beyond > 0) {
    return note_of(tally_.beyond, tally_.value,
                   "heights beyond 1e30, such as " + number_text(tally_.value));
  }
  std::size_t most = 0;
  for (std::size_t i = 0; i < kUsual; ++i) {
    if (tally_.usual[i] > tally_.usual[most]) most = i;
  }
  const double value = kUsualVoids[most];
  if (tally_.usual[most] == 0 || !(tally_.least > value + kApart)) return {};
  return note_of(tally_.usual[most], value,
                 "the height " + number_text(value) + ", far below all others");
}

}  // namespace terrace::terrain
