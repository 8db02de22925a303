// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

/// The marks that identify files written by terrace.

namespace terrace::terrain {

/// The comment that marks files of formats with comments.
inline constexpr const char* kWriterMark = "written by terrace";
/// How files begin in formats without comments.
inline constexpr std::string_view kContourHead =
    R"({"type":"FeatureCollection","generator":"terrace contour",)";
/// How all GeoJSON of ours begins.
inline constexpr std::string_view kGeoJsonMark =
    R"({"type":"FeatureCollection","generator":"terrace)";
inline constexpr std::string_view kLinesHead =
    R"({"type":"FeatureCollection","generator":"terrace",)";
inline constexpr std::string_view kProfileHead = "distance,x,y,height";

/// Whether the regular file at `path` is empty or has terrace's mark at the place that its format
/// has for that: a comment of the header (PLY, OBJ, VTK), the generator (GLB, GeoJSON, LAS), the
/// tag Software (TIFF, PNG), the first bytes (overlays). nullopt for formats without such a place,
/// as CSV; false if the file cannot be read.
[[nodiscard]] std::optional<bool> marked_by_terrace(const std::string& path);

}  // namespace terrace::terrain
