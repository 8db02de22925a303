// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <terrace/cluster/block.hpp>
#include <terrace/cluster/facility_location.hpp>
#include <terrace/stream/source.hpp>
#include <terrace/stream/spatial_order.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/metric_choice.hpp"

namespace terrace::terrain {

/// What is to be built, and how.
struct BuildRequest {
  /// Rasters (several form a mosaic) or point files; "-" is standard input.
  std::vector<std::string> inputs{};
  /// In place of `inputs`: opens a source of the caller's, such as stream::open_memory(), with
  /// these options.
  std::function<std::unique_ptr<stream::PointSource>(const stream::SourceOptions&)> open{};
  std::filesystem::path store{};  ///< the folder to create
  bool replace = false;
  std::string input_format{};  ///< empty: told by content
  /// What the points of the store are. Triangles are clustered by how far corners must move (see
  /// cluster::triangle_distance); a triangle is where its first corner is; detail_mesh() gives them
  /// back. Heights, tiles and bounded meshes need points.
  stream::Entities entities = stream::Entities::points;
  stream::Selection selection{};  ///< of points and attributes; see Region::restrict()
  /// Goes on where parts of laser data are damaged: see stream::SourceOptions::on_damage.
  bool skip_damaged = false;
  std::optional<stream::Crs> crs{};  ///< replaces the source's
  /// To WGS 84, for a CRS of another datum (see DatumShift).
  std::optional<std::array<double, 7>> datum_shift{};
  std::string vertical{};  ///< "ellipsoidal", "orthometric" or empty
  std::size_t block_points = 10000;
  /// Times the diagonal of a block. At 3 clusters hold about 160 points: docs/FIGURES.md.
  double facility_cost = 3.0;
  cluster::Effort effort = cluster::Effort::standard;
  double z_weight = 1.0;
  MetricChoice metric{};  ///< on the ground
  /// Attributes that count in distances as further axes: metres on the ground that a unit of the
  /// attribute (scale and offset applied) is worth. Blocks are then clustered by a local search,
  /// ten to a hundred times slower.
  std::vector<std::pair<std::string, double>> channels{};
  /// What leaving a point out of the clustering costs, times the diagonal of its block; infinite:
  /// none is left out. Outliers stay in the store, as members of the nearest cluster, with 1 in a
  /// further attribute "outlier"; see cluster::HierarchyOptions::outlier_price.
  double outlier_price = std::numeric_limits<double>::infinity();
  /// How facilities are searched: automatic, or a local search of the thesis (7.3.2).
  cluster::FacilityStrategy strategy = cluster::FacilityStrategy::automatic;
  int band = 1;
  stream::HeightsOfColour heights_of_colour = stream::HeightsOfColour::none;  ///< of PNG
  std::optional<double> cell{};  ///< side of the cells of rasters without georeferencing
  std::uint64_t seed = 1;
  /// How points are ordered that are not the cells of a raster: see stream::in_spatial_order().
  /// The temporary file is beside the store.
  stream::Order order = stream::Order::automatic;
  /// A trial run that stops after about this many points and leaves no store; 0: read everything.
  std::uint64_t most_points = 0;
};

struct BuildOutcome {
  std::uint64_t points = 0;
  std::uint64_t nodata = 0;        ///< cells without data; points of which a coordinate is NaN
  bool raster = false;             ///< the points are cells
  std::uint64_t excluded = 0;      ///< points that the selection left out
  std::uint64_t lost = 0;          ///< points in damaged parts, left out
  std::uint64_t outliers = 0;      ///< points marked as outliers
  std::uint64_t empty_values = 0;  ///< attributes without a value in their file: NaN
  std::uint64_t withheld = 0;      ///< points that their file marks as withheld, kept
  std::uint64_t store_bytes = 0;
  stream::OrderedSource::Report order{};  ///< how the points came, and what it took to order them
  unsigned top = 0;
  std::vector<std::uint64_t> level_points, level_clusters;
};

/// Streams the inputs once into a store: reads ahead on a thread of its own, clusters and encodes
/// blocks on the context's threads, appends in order. Same input, options and seed: same bytes.
/// Takes 256 MiB of memory unless the context gives another bound; reports "points", and
/// at the end notes an unknown CRS and the like.
/// Throws: stream::Error; stream::Stopped if the context asks to stop. No store stands then, and
/// one that was to be replaced still does.
BuildOutcome build_store(const BuildRequest& request, const Context& context = {});

/// "fast", "default", "fine", "full" and back.
std::optional<cluster::Effort> effort_of(const std::string& name);
std::string name_of(cluster::Effort effort);

}  // namespace terrace::terrain
