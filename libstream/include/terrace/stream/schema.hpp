// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "terrace/stream/point.hpp"

/// The meaning of a point's numbers: its coordinates, how they relate to a coordinate reference
/// system, and the packed record of its attributes. Shared by sources, stores and writers.

namespace terrace::stream {

/// The types of a column. Multi-byte values are little-endian on disk, native in memory.
enum class ScalarType : std::uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

/// Returns the bytes of one value.
std::size_t size_of(ScalarType type);
/// Returns "int8", "uint8", ..., "float32", "float64", the names in manifests and PLY headers.
std::string_view name_of(ScalarType type);
/// Returns the type of that name (also PLY's "char", "uchar", "short", ...); nullopt for other
/// names.
std::optional<ScalarType> scalar_type_of(std::string_view name);
/// Returns the value of that type at `bytes`, which need not be aligned, rounded to a double.
double to_double(ScalarType type, const std::byte* bytes);

/// A column of the points. Its real values are stored value * scale + offset.
struct Channel {
  std::string name;
  ScalarType type = ScalarType::f64;
  double scale = 1.0;
  double offset = 0.0;
  std::string unit{};  ///< "metre", "foot", ...; empty if unknown

  friend bool operator==(const Channel&, const Channel&) = default;
};

/// A GeoKey of a GeoTIFF that describes its CRS, as in the file.
struct GeoKey {
  std::uint16_t key = 0;
  std::vector<double> values{};  ///< numbers of any type
  std::string text{};

  friend bool operator==(const GeoKey&, const GeoKey&) = default;
};

/// A coordinate reference system as the file describes it, not interpreted.
struct Crs {
  int epsg = 0;                 ///< EPSG code of the horizontal CRS; 0 if none is given
  int vertical_epsg = 0;        ///< EPSG code of the vertical CRS; 0 if none is given
  std::string name;             ///< name or citation
  std::string wkt;              ///< WKT, if the file has it
  bool geographic = false;      ///< x, y are longitude and latitude
  std::string horizontal_unit;  ///< "metre", "foot", "US survey foot", "degree"; empty if unknown
  std::string vertical_unit;    ///< likewise for heights
  /// A GeoTIFF's keys in ascending order: datum, projection, parameters. Not kept in a store.
  std::vector<GeoKey> geo_keys{};

  friend bool operator==(const Crs&, const Crs&) = default;
};

/// How the stored coordinates of a source relate to its CRS:
///   x = xy[0] * c0 + xy[1] * c1 + xy[2]
///   y = xy[3] * c0 + xy[4] * c1 + xy[5]
///   z = channel[2].scale * c2 + channel[2].offset
/// For a raster (c0, c1, c2) = (column, row, raw sample) and xy maps to the *sample's* position
/// (the centre of the cell for PixelIsArea). For points stored unchanged, xy is the identity.
struct WorldTransform {
  std::array<double, 6> xy{1, 0, 0, 0, 1, 0};

  friend bool operator==(const WorldTransform&, const WorldTransform&) = default;
};

/// The placement of stored coordinates, shared by sources and stores.
struct Placement {
  WorldTransform world;
  std::array<Channel, 3> coordinates;  ///< of the stored coordinates c0, c1, c2
  Crs crs;
};

/// A lattice of coordinates in the CRS: an integer k represents k * scale + offset.
struct Lattice {
  Point3 scale{1, 1, 1};
  Point3 offset{0, 0, 0};

  friend bool operator==(const Lattice&, const Lattice&) = default;
};
/// Returns the lattice of stored integers of up to 32 bits; nullopt for other types and for a
/// rotated transform.
[[nodiscard]] std::optional<Lattice> lattice_of(const Placement& placement);

/// Converts a point in stored coordinates to coordinates of the CRS.
[[nodiscard]] inline Point3 world_point(const Placement& placement, const Point3& stored) {
  const std::array<double, 6>& xy = placement.world.xy;
  return {stored[0] * xy[0] + stored[1] * xy[1] + xy[2],
          stored[0] * xy[3] + stored[1] * xy[4] + xy[5],
          stored[2] * placement.coordinates[2].scale + placement.coordinates[2].offset};
}
/// Returns the axis-aligned box in the CRS around a box in stored coordinates; empty for an empty
/// box. For a rotated raster it is larger than the rotated box.
[[nodiscard]] Box3 world_box(const Placement& placement, const Box3& stored);
/// Returns the stored x, y (column and row of a raster) of a place in the CRS, the inverse of
/// world_point().
[[nodiscard]] std::array<double, 2> stored_place(const Placement& placement,
                                                 const std::array<double, 2>& world);

/// The range of an attribute's values over some points, with scale and offset applied.
struct ValueRange {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool nan = true;  ///< whether some may be NaN
};

/// One attribute of packed records, read as values of type T.
template <class T>
class AttributeView {
 public:
  /// records: complete records of record_bytes each, with the attribute at byte `offset`.
  AttributeView(std::span<const std::byte> records, std::size_t record_bytes, std::size_t offset)
      : first_(records.empty() ? nullptr : records.data() + offset),
        stride_(record_bytes),
        size_(records.size() / record_bytes) {
    assert(records.size() % record_bytes == 0 && offset + sizeof(T) <= record_bytes);
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] T operator[](std::size_t i) const {
    assert(i < size_);
    T value;
    std::memcpy(&value, first_ + i * stride_, sizeof value);
    return value;
  }

 private:
  const std::byte* first_;
  std::size_t stride_, size_;
};

/// The components of a point. Its attribute values are packed into one record without gaps, in the
/// order of `attributes` and in native byte order; records of many points are contiguous.
struct Schema : Placement {
  bool grid = false;                    ///< coordinates are integer column, row and a raw sample
  std::vector<Channel> attributes;      ///< further columns, in order
  std::uint64_t columns = 0, rows = 0;  ///< of the raster or mosaic; 0 otherwise

  /// Bytes of one record.
  [[nodiscard]] std::size_t payload_size() const { return attribute_offset(attributes.size()); }
  /// Offset of an attribute in a record.
  [[nodiscard]] std::size_t attribute_offset(std::size_t attribute) const;
  /// A view of one attribute of packed records; T is its type.
  template <class T>
  [[nodiscard]] AttributeView<T> view(std::span<const std::byte> records,
                                      std::size_t attribute) const {
    assert(size_of(attributes[attribute].type) == sizeof(T));
    return {records, payload_size(), attribute_offset(attribute)};
  }
};

/// Returns how far a region is widened on each side along x and y, in units of the CRS. It is 0 for
/// points, and a millionth of a cell for a raster, because the computed positions of columns and
/// rows are rounded.
[[nodiscard]] std::array<double, 2> border_tolerance(const Schema& schema);

}  // namespace terrace::stream
