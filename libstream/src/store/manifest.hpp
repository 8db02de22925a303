// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/temporary.hpp"
#include "store/codec/layout.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream::store {

inline constexpr std::uint64_t kMaxManifestBytes = 64u << 20;
inline constexpr std::size_t kMaxAttributes = 4096;
/// Limits of points, cells without data, columns and rows, so that their sums and products, and
/// that of points and the bytes of a point, fit into 64 bits.
inline constexpr std::uint64_t kMaxStorePoints = std::uint64_t{1} << 48;
inline constexpr std::uint64_t kMaxColumns = std::uint64_t{1} << 31;

/// The version of the format.
inline constexpr int kVersion = 1;
inline constexpr std::string_view kFormatName = "terrace-store";
/// The text ends with this key, eight hexadecimal digits, and the closing below. The checksum is
/// the CRC-32 of the whole text with zeros for its digits.
inline constexpr std::string_view kChecksumKey = "\"checksum\": \"";
inline constexpr std::string_view kClosing = "\"\n}\n";
inline constexpr std::string_view kZeros = "00000000";

/// The file of the surface.
inline constexpr const char* kSurfaceName = "surface.0";

/// A file as the manifest lists it.
struct FileEntry {
  std::string name;
  std::uint64_t bytes = 0;
  std::uint32_t checksum = 0;
};

/// The clusters that one run wrote to a level, with consecutive ordinals. Its files never change,
/// so what differs between the run's store and this one is added when they are read.
struct SegmentEntry {
  std::uint64_t clusters = 0;
  FileEntry data, index;
  std::uint64_t directory_bytes = 0;  ///< at the end of the index file
  /// Contains all points of the clusters and below them, in the segment's coordinates.
  Box3 bounds;
  /// To be added to the ordinals of clusters that its points head, by level.
  std::vector<std::uint64_t> base;
  /// To be added to stored coordinates.
  std::array<std::int64_t, 3> shift{};
};

/// A level as the manifest lists it.
struct LevelEntry {
  std::uint64_t points = 0, members = 0, clusters = 0;
  std::vector<SegmentEntry> segments;  ///< in the order of their clusters

  [[nodiscard]] std::uint64_t data_bytes() const;
  [[nodiscard]] std::uint64_t index_bytes() const;
};

/// The surface as the manifest lists it.
struct SurfaceEntry {
  std::uint64_t vertices = 0, triangles = 0;
  FileEntry file;
};

/// The contents of manifest.json.
struct Manifest {
  int version = kVersion;
  StoreSchema schema;
  std::uint64_t points = 0;
  Box3 bounds;
  double mean_height = 0.0;
  std::vector<LevelEntry> levels;  ///< level 0 first
  std::optional<SurfaceEntry> surface;
  std::uint32_t checksum = 0;  ///< checksum of the text; set by parse_manifest()
};

/// The limit of segments of all levels, and of a segment's shift.
inline constexpr std::size_t kMaxSegments = std::size_t{1} << 20;
inline constexpr std::int64_t kMaxShift = std::int64_t{1} << 52;

/// Returns the box moved by a segment's shift.
[[nodiscard]] Box3 shifted(Box3 box, const std::array<std::int64_t, 3>& shift);

/// True if the corners of the box in the CRS are finite.
bool is_finite_in_crs(const Placement& placement, const Box3& stored);

/// Returns eight lower-case hexadecimal digits.
std::string hexadecimal(std::uint32_t value);

/// Returns the manifest as JSON text, including its checksum.
std::string to_text(const Manifest& manifest);

/// Reads the text of a manifest. Throws: Error if it is too large or cannot be read.
std::string read_manifest(const ByteSource& file);

/// Parses a manifest. Throws: Error, naming `file`, if the text is not a manifest of this
/// version, or was modified.
Manifest parse_manifest(const std::string& text, const std::string& file);

/// Whether `text`, the source of `manifest`, has exactly the keys of the format, in the format's
/// order.
bool is_as_written(const std::string& text, const Manifest& manifest);

}  // namespace terrace::stream::store
