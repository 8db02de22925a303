// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

/// Marks that identify files written by terrace.

namespace terrace::terrain {

/// The comment that marks files in formats with comments.
inline constexpr const char* kWriterMark = "written by terrace";
/// The first bytes that mark files in formats without comments.
inline constexpr std::string_view kContourHead =
    R"({"type":"FeatureCollection","generator":"terrace contour",)";
/// The first bytes of every GeoJSON file that terrace writes.
inline constexpr std::string_view kGeoJsonMark =
    R"({"type":"FeatureCollection","generator":"terrace)";
inline constexpr std::string_view kLinesHead =
    R"({"type":"FeatureCollection","generator":"terrace",)";
inline constexpr std::string_view kProfileHead = "distance,x,y,height";

/// Whether the regular file at `path` is empty or has terrace's mark. The mark is a header comment
/// (PLY, OBJ, VTK), the generator (GLB, GeoJSON, LAS), the tag Software (TIFF, PNG) or the first
/// bytes (overlays). Returns nullopt for formats without room for a mark, such as CSV, and false if
/// the file cannot be read.
[[nodiscard]] std::optional<bool> marked_by_terrace(const std::string& path);

}  // namespace terrace::terrain
