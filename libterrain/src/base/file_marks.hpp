// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

/// By what files can be told to be terrace's.

namespace terrace::terrain {

/// The comment that marks files of formats with comments.
inline constexpr const char* kWriterMark = "written by terrace";
/// How files begin that have no room for comments.
inline constexpr std::string_view kContourHead =
    R"({"type":"FeatureCollection","generator":"terrace contour","features":[)";
/// How all GeoJSON of ours begins.
inline constexpr std::string_view kGeoJsonMark =
    R"({"type":"FeatureCollection","generator":"terrace)";
inline constexpr std::string_view kLinesHead =
    R"({"type":"FeatureCollection","generator":"terrace",)";
inline constexpr std::string_view kProfileHead = "distance,x,y,height";

}  // namespace terrace::terrain
