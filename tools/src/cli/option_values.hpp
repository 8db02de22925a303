// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <terrace/cluster/facility_location.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/tri/grid_tin.hpp>
#include <terrace/tri/interpolation.hpp>
#include <terrace/tri/point_tin.hpp>
#include <terrace/tri/smoothing.hpp>
#include <terrace/tri/surface_smoothing.hpp>

#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/fill.hpp"
#include "terrace/terrain/height_reference.hpp"
#include "terrace/terrain/raster.hpp"
#include "terrace/terrain/region.hpp"

/// Parsers for option values. All of them throw UsageError for an invalid value.

namespace terrace::tools {

/// Returns the value that `text` names. The error lists the valid names.
template <class T>
T choice(const std::string& text, const char* option,
         std::initializer_list<std::pair<std::string_view, T>> choices) {
  std::string names;
  for (const auto& [name, value] : choices) {
    if (name == text) return value;
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  throw terrain::UsageError(std::string(option) + " '" + text + "': one of " + names);
}

/// Parses "none", "flat" or "interpolate".
terrain::Fill parse_fill(const std::string& text);
/// Parses "ellipsoidal", "orthometric" or "ignore". An empty text gives HeightReference::recorded.
terrain::HeightReference parse_height_reference(const std::string& text);
/// Parses "greedy", "removal" or "fitted".
tri::TinQuality parse_quality(const std::string& text);
/// Parses "all", "min", "max", "mean", "first" or "error".
tri::PointDuplicates parse_duplicates(const std::string& text);
/// Parses "linear", "natural" or "nearest".
tri::Interpolation parse_interpolation(const std::string& text);
/// Parses "height", "slope", "aspect" or "hillshade".
terrain::RasterValue parse_raster_value(const std::string& text);
/// Parses the name of a search over points: "automatic", "fast", "full-scan", "quadtree", "octree",
/// "kd-tree" or "facilities".
cluster::FacilityStrategy parse_strategy(const std::string& text);

/// Parses "L:N", a cluster's level and its number within that level.
stream::ClusterId parse_cluster(const std::string& text);

/// Parses "laplacian", "taubin" or "bilateral", optionally followed by a colon and the number of
/// steps (10 by default, at most 10,000). Returns nullopt for an empty text. For "bilateral",
/// edge_height stays 0 because it depends on the data.
std::optional<tri::SmoothingOptions> parse_smoothing(const std::string& text);
/// Parses "taubin" or "bilateral" for surfaces in space, otherwise as parse_smoothing().
std::optional<tri::SurfaceSmoothingOptions> parse_surface_smoothing(const std::string& text);

/// Parses the NAME:WEIGHT of --channel. The name may contain colons; the weight is a non-negative
/// number.
std::pair<std::string, double> parse_channel(const std::string& text);

/// A line of straight segments.
struct Line {
  std::vector<terrain::Point2> places;      ///< at least two
  std::optional<terrain::PlacesCrs> crs{};  ///< as Region::crs()
};
/// Parses "x1,y1,x2,y2[,...]" or a GeoJSON file with one LineString (plain, in a Feature, or in a
/// FeatureCollection with one feature). Throws stream::Error for an invalid file.
Line parse_line(const std::string& text);

/// Parses a level from 0 to 255. Returns nullopt for "top".
std::optional<unsigned> parse_level(const std::string& text);

/// A region and the level requested there; nullopt means the top.
struct Focus {
  terrain::Region region;
  std::optional<unsigned> level;
};
/// Parses "BOX:L", where L is a number or "top". Throws as Region::parse does.
Focus parse_focus(const std::string& text);

/// Parses the requested levels and checks that the store has them. An empty level means the top if
/// there are focuses, otherwise level 0. `conversion` converts regions to the store's CRS.
/// Throws as Region::parse does, and UsageError for a level above the store's top.
terrain::Detail parse_detail(const stream::Store& store, const std::string& level,
                             const std::string& region, const std::vector<std::string>& focuses,
                             const terrain::RegionConversion& conversion = {});

}  // namespace terrace::tools
