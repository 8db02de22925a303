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
#include <terrace/stream/store.hpp>
#include <terrace/stream/stored_surface.hpp>

#include "terrace/terrain/context.hpp"
#include "terrace/terrain/input_triangles.hpp"
#include "terrace/terrain/metric_choice.hpp"

namespace terrace::terrain {

/// The inputs and options of a build.
struct BuildRequest {
  /// Rasters (several form a mosaic) or point files; "-" is standard input.
  std::vector<std::string> inputs{};
  /// Replaces `inputs`: opens the caller's own source, such as stream::open_memory(), with these
  /// options.
  std::function<std::unique_ptr<stream::PointSource>(const stream::SourceOptions&)> open{};
  std::filesystem::path store{};  ///< the folder to create
  bool replace = false;
  /// Adds the points to the store, which exists. It keeps its clusters with their ids, except the
  /// root, and its options of clustering: those of this request must be the same or defaults. The
  /// points must match it as in a merge (merge.hpp); cells of a raster that the store has with the
  /// same value are left out. The extended store takes the place of the old one in one step. Cost:
  /// that of building the new points alone, and of links to the files. A surface is not kept.
  /// Without `replace`, `surface` and `most_points`.
  bool append = false;
  std::string input_format{};  ///< empty: detected from the content
  /// What a point of the store represents. Triangles are clustered by how far corners must move
  /// (see cluster::triangle_distance). A triangle is located at its first corner, and detail_mesh()
  /// returns the triangles. Heights, tiles and bounded meshes need points.
  stream::Entities entities = stream::Entities::points;
  stream::Selection selection{};  ///< points and attributes to keep; see Region::restrict()
  /// Continues where parts of laser data are damaged: see stream::SourceOptions::on_damage.
  bool skip_damaged = false;
  std::optional<stream::Crs> crs{};  ///< overrides the source's
  /// Shift to WGS 84, for a CRS of another datum (see DatumShift).
  std::optional<std::array<double, 7>> datum_shift{};
  std::string vertical{};  ///< "ellipsoidal", "orthometric" or empty
  std::size_t block_points = 10000;
  /// Times the diagonal of a block. With 3, clusters hold about 160 points: docs/figures. Not used
  /// if k is positive.
  double facility_cost = 3.0;
  /// k-median over the stream: the top level has k points, the medians, and the clusters of the
  /// level below are theirs (see cluster::HierarchyOptions::medians). 0: the facility cost alone
  /// decides. At most kMaxMedians. Blocks hold at least 100 k points, so memory and the last step,
  /// which takes O((100 k)^2) time, grow with k. Other clusters are small,
  /// of 2 to 4 points with 100 medians. For
  /// points without outlier_price.
  std::size_t k = 0;
  cluster::Effort effort = cluster::Effort::standard;
  double z_weight = 1.0;
  MetricChoice metric{};  ///< in ground coordinates
  /// Attributes that are further axes of the distance, each with the metres on the ground that one
  /// unit of it is worth (scale and offset applied). Blocks are then clustered by a local search,
  /// which is ten to a hundred times slower.
  std::vector<std::pair<std::string, double>> channels{};
  /// Cost of leaving a point out of the clustering, times the diagonal of its block; infinite:
  /// every point is clustered. Outliers stay in the store as members of the nearest cluster, with 1
  /// in an additional attribute "outlier"; see cluster::HierarchyOptions::outlier_price.
  double outlier_price = std::numeric_limits<double>::infinity();
  /// How to search for facilities: automatic, or a local search of the thesis (7.3.2).
  cluster::FacilityStrategy strategy = cluster::FacilityStrategy::automatic;
  /// For a local search (another strategy, metric, channels or entities): the number of candidates
  /// evaluated at once, of which the best is opened, and of threads that share the work on one
  /// block (7.3.3). Threads do not change the store. More than 1 of either is an error if blocks
  /// are not clustered by a local search.
  std::size_t batch = 1;
  unsigned search_threads = 1;
  int band = 1;
  stream::HeightsOfColour heights_of_colour = stream::HeightsOfColour::none;  ///< encoding of PNG
  std::optional<double> cell{};  ///< cell size of rasters without georeferencing
  std::uint64_t seed = 1;
  /// How to order points that are not the cells of a raster: see stream::in_spatial_order(). The
  /// temporary file is next to the store.
  stream::Order order = stream::Order::automatic;
  /// Returns the surface through the points of the store, to be stored with it, such as
  /// surface_to_store() of scan_surface.hpp. Called with the complete store before it is published,
  /// and with the triangles of the input.
  std::function<stream::StoredSurface(const stream::Store&, const stream::ClusterOrder&,
                                      const InputTriangles&)>
      surface{};
  /// Whether the surface consists of the input's triangles. Files of meshes are then read twice.
  SurfaceOrigin surface_origin = SurfaceOrigin::automatic;
  /// With `open`: opens the triangles between its points as stream::Entities::triangles, in the
  /// same stored coordinates; empty if there are none.
  std::function<std::unique_ptr<stream::PointSource>(const stream::SourceOptions&)>
      open_triangles{};
  /// Ends a trial run after about this many points, without a store. 0 builds the store from all
  /// points.
  std::uint64_t most_points = 0;
};

/// The largest BuildRequest::k.
inline constexpr std::size_t kMaxMedians = 10'000;

struct BuildOutcome {
  std::uint64_t points = 0;        ///< added to the store
  std::uint64_t store_points = 0;  ///< in the store; more than `points` after an append
  std::uint64_t known = 0;         ///< cells that the store to append to had already
  std::uint64_t nodata = 0;        ///< cells without data; points with a NaN coordinate
  bool raster = false;             ///< the points are cells
  std::uint64_t excluded = 0;      ///< points that the selection left out
  std::uint64_t lost = 0;          ///< points lost in damaged parts
  std::uint64_t outliers = 0;      ///< points marked as outliers
  std::uint64_t empty_values = 0;  ///< attribute values missing from their file, stored as NaN
  std::uint64_t withheld = 0;      ///< points that their file marks as withheld; they are kept
  std::uint64_t store_bytes = 0;
  /// The surface that was stored with the points.
  std::optional<stream::SurfaceInfo> surface{};
  /// Number of triangles of the input that were read for it; 0 if it was restored from the points.
  std::uint64_t input_triangles = 0;
  stream::OrderedSource::Report order{};  ///< the order the points arrived in, and the work to sort
                                          ///< them
  unsigned top = 0;
  std::vector<std::uint64_t> level_points, level_clusters;
};

/// Streams the inputs once into a store. Reads ahead on a separate thread, clusters and encodes
/// blocks on the context's threads and appends them in order. The same input, options and seed give
/// the same bytes. Uses 256 MiB of memory unless the context sets another bound. Reports "points",
/// and at the end notes an unknown CRS and similar findings.
/// Throws: UsageError for options that exclude each other; stream::Error; stream::Stopped if the
/// context requests a stop. None leaves a new store, and a store to replace is left untouched.
BuildOutcome build_store(const BuildRequest& request, const Context& context = {});

/// Convert "fast", "default", "fine" and "full" to an effort and back.
std::optional<cluster::Effort> effort_of(const std::string& name);
std::string name_of(cluster::Effort effort);

}  // namespace terrace::terrain
