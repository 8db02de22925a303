// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "format/record_source.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

/// The header of LAS 1.0 to 1.4 (ASPRS, "LAS specification 1.4 - R15", 2019) and the records around
/// the points.

namespace terrace::stream {

/// A variable length record, before the points or (EVLR) after them.
struct LasVlr {
  std::string user;  ///< "LASF_Projection", "LASF_Spec", "laszip encoded", ...
  std::uint16_t id = 0;
  std::string data;

  [[nodiscard]] bool is(std::string_view its_user, std::uint16_t its_id) const {
    return user == its_user && id == its_id;
  }
};

inline constexpr std::string_view kLasProjection = "LASF_Projection";
inline constexpr std::uint16_t kLasWkt = 2112;
inline constexpr std::string_view kLasSpec = "LASF_Spec";
inline constexpr std::uint16_t kLasExtraBytes = 4;

inline constexpr std::size_t kLasVlrHeaderBytes = 54, kLasEvlrHeaderBytes = 60;
inline constexpr std::size_t kLas14HeaderBytes = 375;
inline constexpr std::size_t kLasFirstBytes = 227;  ///< header of LAS 1.0 to 1.2; all begin with it

/// The fields of a header that readers use, and the records around the points.
struct LasHeader {
  unsigned minor = 0;          ///< minor version: 1.minor
  unsigned point_format = 0;   ///< 0 to 10
  bool compressed = false;     ///< LAZ
  bool wkt = false;            ///< WKT applies, not GeoKeys
  bool adjusted_time = false;  ///< GPS time is adjusted standard time, not time of the week
  std::size_t record_bytes = 0;
  std::uint64_t points = 0, points_offset = 0;
  std::uint64_t uncounted_records =
      0;  ///< more records than counted, at least, in an uncompressed file
  std::array<double, 3> scale{}, offset{};
  Box3 bounds;               ///< in the CRS, as stated; empty if not filled in or not finite
  std::vector<LasVlr> vlrs;  ///< those used here, including EVLRs unless from a pipe
  /// There are EVLRs, but the input is a pipe.
  bool has_unread_evlrs = false;
};

/// Reads the header and leaves `input` at the first byte of the points. EVLRs are read from `file`
/// separately, unless it is a pipe. Harmless faults are listed in `comments`. Throws: Error if it
/// is not LAS, or if the points exceed the rest of a regular file.
LasHeader read_las_header(Input& input, const std::string& file, std::vector<std::string>& comments,
                          const OnDamage& on_damage = {});

/// Scale, offset and bounds from the first kLasFirstBytes of a file; nullopt if it has fewer bytes,
/// is not LAS, or has an impossible scale or offset.
std::optional<LasHeader> peek_las_header(std::string_view head);

/// Returns the coordinate reference system named by the records. Throws: Error if it cannot be
/// reached in a pipe.
Crs las_crs(const LasHeader& header, const std::string& name, std::vector<std::string>& comments);

/// Returns the user's `crs`, which overrides that of a file. If it has no vertical part, it gets
/// the unit of heights of `file_crs`, from its WKT if necessary.
Crs with_own_height_unit(Crs crs, const Crs& file_crs);
/// Returns with_own_height_unit() for the CRS of a LAS file.
Crs las_crs_overridden(const LasHeader& header, const Crs& crs);

/// Returns the placement of the records' coordinates, without a CRS.
Placement las_placement(const LasHeader& header);

/// Returns the header's description of the points: their lattice, attributes and the positions of
/// these in the records. Adds `comments` to the stream's. Throws: Error naming `name` for too many
/// extra bytes.
RecordStream las_stream(const LasHeader& header, const std::string& name,
                        std::vector<std::string> comments);

}  // namespace terrace::stream
