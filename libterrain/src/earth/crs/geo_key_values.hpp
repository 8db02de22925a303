// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "earth/crs/projection.hpp"
#include "terrace/stream/source.hpp"

/// The keys of a GeoTIFF by their numbers: OGC 19-008r4 (GeoTIFF 1.1), annex; 2062 is GDAL's.

namespace terrace::terrain {

/// The value of a code that says: by the parameters beside it.
inline constexpr int kUserDefined = 32767;

/// Throws: CrsError with that cause; the remedy is to name the system by its code.
[[noreturn]] void fail_geo_keys(const std::string& cause);

/// The key of a projection's parameter.
struct KeyOfParameter {
  std::uint16_t key;
  double ProjectionParameters::*member;
  enum class Kind { angle, length, scale } kind;
};
/// Several keys set one member; a file has one of them.
extern const std::array<KeyOfParameter, 19> kParameterKeys;

/// The keys of one file.
class GeoKeyValues {
 public:
  explicit GeoKeyValues(const stream::Crs& crs) : crs_(crs) {}

  [[nodiscard]] const stream::GeoKey* find(int key) const;
  /// Nothing if there is none. Throws: CrsError if it is not finite.
  [[nodiscard]] std::optional<double> number(int key) const;
  /// 0 if there is none. Throws: CrsError if it is not a whole number of 16 bits, as codes are.
  [[nodiscard]] int code(int key) const;
  [[nodiscard]] std::string text(int key) const;

  /// Degrees in the angular unit, metres in the linear one (0 if the file names none).
  /// Throws: CrsError for a unit that is not known.
  [[nodiscard]] double degrees_per_unit() const;
  [[nodiscard]] double metres_per_unit() const;

 private:
  const stream::Crs& crs_;
};

}  // namespace terrace::terrain
