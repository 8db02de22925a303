// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The GeoKeys of a TIFF: numbers and texts by key. Entries that point outside their arrays, or are
/// truncated, are dropped and listed in faults().
class GeoKeys {
 public:
  GeoKeys(std::span<const std::uint16_t> directory, std::span<const double> doubles,
          const std::string& ascii);

  [[nodiscard]] std::optional<std::uint16_t> number(std::uint16_t key) const;
  [[nodiscard]] std::string text(std::uint16_t key) const;  ///< empty if there is none
  /// All keys from `first` to `last`, ascending.
  [[nodiscard]] std::vector<GeoKey> range(std::uint16_t first, std::uint16_t last) const;
  [[nodiscard]] bool empty() const {
    return numbers_.empty() && texts_.empty() && doubles_.empty();
  }
  [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }

 private:
  std::unordered_map<std::uint16_t, std::uint16_t> numbers_;
  std::unordered_map<std::uint16_t, std::string> texts_;
  std::unordered_map<std::uint16_t, std::vector<double>> doubles_;
  std::vector<std::string> faults_;
};

/// Returns the coordinate reference system named by the keys; user-defined codes count as none.
Crs crs_of(const GeoKeys& keys);

/// Collects GeoKeys to write; they must be added in ascending order.
class GeoKeyDirectory {
 public:
  void add(std::uint16_t key, std::uint16_t value) { entries_.push_back({key, 0, 1, value}); }
  void add(std::uint16_t key, const std::string& text);
  void add(std::uint16_t key, const std::vector<double>& values);
  /// Adds a key as it was read: measures are doubles, codes are shorts.
  void add(const GeoKey& key);

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] std::vector<std::uint16_t> shorts() const;
  [[nodiscard]] const std::string& ascii() const { return ascii_; }
  [[nodiscard]] const std::vector<double>& doubles() const { return doubles_; }

 private:
  std::vector<std::array<std::uint16_t, 4>> entries_;
  std::vector<double> doubles_;
  std::string ascii_;
};

/// Returns the keys that describe a CRS and its units. raster_type: kPixelIsArea or kPixelIsPoint
/// for a raster, nullopt for points. A vertical unit without a vertical CRS is written only for
/// points, because the samples of a raster state their own unit.
GeoKeyDirectory keys_of(const Crs& crs, std::optional<std::uint16_t> raster_type);

}  // namespace terrace::stream
