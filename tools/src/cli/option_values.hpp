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

#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/fill.hpp"
#include "terrace/terrain/height_reference.hpp"
#include "terrace/terrain/raster.hpp"
#include "terrace/terrain/region.hpp"

/// What the values of options mean. All parsers throw UsageError for a value that makes no sense.

namespace terrace::tools {

using namespace terrain;

/// The value that `text` names; the error lists the names.
template <class T>
T choice(const std::string& text, const char* option,
         std::initializer_list<std::pair<std::string_view, T>> choices) {
  std::string names;
  for (const auto& [name, value] : choices) {
    if (name == text) return value;
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  throw UsageError(std::string(option) + " '" + text + "': one of " + names);
}

/// "none", "flat", "interpolate".
Fill parse_fill(const std::string& text);
/// "ellipsoidal", "orthometric", "ignore", or empty: what the store records.
HeightReference parse_height_reference(const std::string& text);
/// "greedy", "removal", "fitted".
tri::TinQuality parse_quality(const std::string& text);
/// "all", "min", "max", "mean", "first", "error".
tri::PointDuplicates parse_duplicates(const std::string& text);
/// "linear", "natural", "nearest".
tri::Interpolation parse_interpolation(const std::string& text);
/// "height", "slope", "aspect", "hillshade".
RasterValue parse_raster_value(const std::string& text);
/// The searches over points: "automatic", "fast", "full-scan", "quadtree", "octree", "kd-tree",
/// "facilities".
cluster::FacilityStrategy parse_strategy(const std::string& text);

/// "L:N", a cluster's level and its number there.
stream::ClusterId parse_cluster(const std::string& text);

/// "laplacian", "taubin" or "bilateral", and after a colon the number of steps (10 unless given, at
/// most 10,000); nullopt for an empty text. The edge_height of "bilateral" stays 0: it depends on
/// the data.
std::optional<tri::SmoothingOptions> parse_smoothing(const std::string& text);

/// NAME:WEIGHT of --channel; the name may hold colons, the weight is a number from 0 up.
std::pair<std::string, double> channel_of(const std::string& text);

struct Line {
  std::vector<Point2> places;      ///< at least two
  std::optional<PlacesCrs> crs{};  ///< as of Region::crs()
};
/// "x1,y1,x2,y2[,...]", or a GeoJSON file with one LineString (plain, in a Feature, or in a
/// FeatureCollection of one). Throws: stream::Error for a bad file.
Line parse_line(const std::string& text);

/// A number from 0 to 255; nullopt for "top".
std::optional<unsigned> parse_level(const std::string& text);

/// A region and the level wanted there, nullopt for the top.
struct Focus {
  Region region;
  std::optional<unsigned> level;
};
/// "BOX:L" with L a number or "top". Throws: as Region::parse.
Focus parse_focus(const std::string& text);

/// The levels as asked for, checked against the store. An empty level is the top if there are
/// focuses, else level 0. conversion: of regions that are given in another CRS.
/// Throws: as Region::parse; UsageError for a level above the store's top.
Detail parse_detail(const stream::Store& store, const std::string& level, const std::string& region,
                    const std::vector<std::string>& focuses,
                    const RegionConversion& conversion = {});

}  // namespace terrace::tools
