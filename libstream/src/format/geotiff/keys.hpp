// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// The GeoKeys of a TIFF: small numbers and texts by key. Entries that point outside their arrays,
/// or are truncated, are dropped and listed in `faults`.
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

/// The coordinate reference system named by the keys; user-defined codes count as none.
Crs crs_of(const GeoKeys& keys);

}  // namespace terrace::stream
