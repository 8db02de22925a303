// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/georeference.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include <fmt/core.h>

#include "format/geotiff/tags.hpp"
#include "format/sidecars.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {
namespace {

constexpr char kGeoreferenceRemedy[] = "set the georeferencing again (gdal_edit.py -a_ullr)";

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// Moves the origin by `shift` cells along both axes.
WorldTransform shifted(WorldTransform world, double shift) {
  world.xy[2] += shift * (world.xy[0] + world.xy[1]);
  world.xy[5] += shift * (world.xy[3] + world.xy[4]);
  return world;
}

/// Returns the value of attribute `name` in the text of an XML tag.
std::string_view attribute(std::string_view tag, std::string_view name) {
  const std::string pattern = std::string(" ").append(name).append("=\"");
  const std::size_t begin = tag.find(pattern);
  if (begin == tag.npos) return {};
  tag.remove_prefix(begin + pattern.size());
  return tag.substr(0, tag.find('"'));
}

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::optional<double> number_in(std::string_view text) {
  text = trimmed(text);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return std::nullopt;
  return value;
}

/// Returns the file's own georeferencing; nullopt if it has none, or only ground control points.
std::optional<WorldTransform> embedded_transform(const GeoTiffHandle& handle, const GeoKeys& keys,
                                                 std::vector<std::string>& comments) {
  const auto matrix = handle.doubles(kModelTransformation);
  const auto scale = handle.doubles(kModelPixelScale);
  const auto tie = handle.doubles(kModelTiepoint);
  const double to_sample =
      keys.number(kGTRasterType).value_or(kPixelIsArea) == kPixelIsPoint ? 0.0 : 0.5;

  // As in GDAL, scale and tie point override the matrix if a file has both, which is not allowed.
  if (scale.size() >= 2 && tie.size() >= 6) {
    if (!all_finite(scale) || !all_finite(tie)) {
      throw handle.fault("is not finite").at("ModelPixelScale").remedy(kGeoreferenceRemedy);
    }
    if (scale[0] == 0 || scale[1] == 0)
      throw handle.fault("is zero").at("ModelPixelScale").remedy(kGeoreferenceRemedy);
    if (scale[1] < 0) {
      comments.emplace_back("the pixel scale's negative y is read as positive, as in GDAL");
    }
    const double sx = scale[0], sy = std::abs(scale[1]);
    return shifted({{sx, 0, tie[3] - tie[0] * sx, 0, -sy, tie[4] + tie[1] * sy}}, to_sample);
  }
  if (matrix.size() >= 8) {
    const WorldTransform world{{matrix[0], matrix[1], matrix[3], matrix[4], matrix[5], matrix[7]}};
    const double determinant = world.xy[0] * world.xy[4] - world.xy[1] * world.xy[3];
    if (!all_finite(matrix) || !std::isfinite(determinant) || determinant == 0) {
      throw handle.fault("does not map cells to distinct places")
          .at("ModelTransformation")
          .remedy(kGeoreferenceRemedy);
    }
    return shifted(world, to_sample);
  }
  return std::nullopt;
}

/// Adds a note if a world file places the raster elsewhere than the file itself does.
void compare_with_world_file(const std::string& file, RasterInfo& info) {
  std::optional<WorldFile> world_file;
  try {
    world_file = world_file_of(file);
  } catch (const Error&) {
    return;  // it is ignored
  }
  if (!world_file) return;
  const auto &m = info.world.xy, &n = world_file->world.xy;
  const double cell = std::max({std::abs(m[0]), std::abs(m[1]), std::abs(m[3]), std::abs(m[4])});
  double max_distance = 0;
  for (const double c : {0.0, static_cast<double>(info.columns)}) {
    for (const double r : {0.0, static_cast<double>(info.rows)}) {
      for (const std::size_t i : {std::size_t{0}, std::size_t{3}}) {
        max_distance =
            std::max(max_distance,
                     std::abs((m[i] - n[i]) * c + (m[i + 1] - n[i + 1]) * r + m[i + 2] - n[i + 2]));
      }
    }
  }
  if (max_distance <= kNearestCell * cell) return;
  info.notes.push_back(
      fmt::format("{} is ignored: {} itself places the raster elsewhere; remove the wrong one",
                  world_file->name, file));
}

}  // namespace

void place_geotiff(const GeoTiffHandle& handle, const GeoKeys& keys, RasterInfo& info) {
  if (const auto transform = embedded_transform(handle, keys, info.comments)) {
    info.world = *transform;
    compare_with_world_file(handle.file(), info);
    return;
  }
  info.world = kPlainWorld;
  info.comments.push_back(kNoGeoreferencing);
  place_by_world_file(handle.file(), info);
  const std::size_t points = handle.doubles(kModelTiepoint).size() / 6;
  if (points > 1 && info.world == kPlainWorld) {
    throw handle
        .fault(fmt::format("has {} ground control points instead of a transformation", points))
        .at("ModelTiepoint")
        .remedy("rectify it first: gdalwarp");
  }
}

BandMetadata band_metadata(const std::string& xml, unsigned band) {
  BandMetadata metadata;
  std::string_view rest = xml;
  const std::string sample = fmt::format("{}", band);
  for (;;) {
    const std::size_t begin = rest.find("<Item");
    if (begin == rest.npos) return metadata;
    rest.remove_prefix(begin + 5);
    const std::size_t end = rest.find('>');
    if (end == rest.npos) return metadata;
    const std::string_view tag = rest.substr(0, end);
    rest.remove_prefix(end + 1);
    const std::string_view text = rest.substr(0, rest.find('<'));
    if (attribute(tag, "sample") != sample) continue;
    const std::string_view role = attribute(tag, "role");
    if (role == "scale") metadata.scale = number_in(text);
    if (role == "offset") metadata.offset = number_in(text);
    if (role == "unittype") metadata.unit = canonical_unit(text);
  }
}

}  // namespace terrace::stream
