// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/build.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/core.h>
#include <terrace/base/portable_math.hpp>
#include <terrace/cluster/hierarchy.hpp>
#include <terrace/stream/error.hpp>
#include <terrace/stream/input.hpp>
#include <terrace/stream/raster.hpp>
#include <terrace/stream/spatial_order.hpp>
#include <terrace/stream/store.hpp>

#include "base/progress_report.hpp"
#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "build/clustering.hpp"
#include "build/damage_report.hpp"
#include "build/joined_longitudes.hpp"
#include "build/mesh_input.hpp"
#include "build/store_extension.hpp"
#include "earth/crs/definition.hpp"
#include "earth/ground.hpp"
#include "earth/source_crs.hpp"
#include "terrace/terrain/error.hpp"
#include "terrace/terrain/latitudes.hpp"
#include "terrace/terrain/store_sink.hpp"
#include "terrace/terrain/undeclared_voids.hpp"

namespace terrace::terrain {
namespace {

stream::StoreSchema schema_of(const stream::SourceInfo& info, const SourceCrs& crs,
                              const BuildRequest& request) {
  const std::string& vertical = request.vertical;
  if (!vertical.empty() && vertical != "ellipsoidal" && vertical != "orthometric") {
    throw UsageError(
        stream::message("{vertical} is ellipsoidal or orthometric, not '{}'", vertical));
  }
  stream::StoreSchema schema{info};
  add_outlier_mark(request, schema.attributes);
  schema.crs = crs.crs;
  schema.vertical = request.vertical.empty() ? name_of(crs.heights) : request.vertical;
  if (schema.vertical != name_of(crs.heights)) {
    // An explicit height option overrides the file.
    schema.crs.vertical_epsg = 0;
    if (crs.system) {
      CrsDefinition definition = crs.system->definition();
      forget_heights(definition);
      schema.crs.epsg = definition.epsg();
      schema.crs.wkt = wkt_of(definition);
    }
  }
  schema.format = info.format;
  schema.parameters = recorded_parameters(request);
  return schema;
}

/// The CRS of a source and its map to the ground.
struct Located {
  Located(const stream::SourceInfo& info, const BuildRequest& request)
      : crs(crs_of_source(info, request.datum_shift)), ground(placement(info), request.z_weight) {}

  SourceCrs crs;
  Ground ground;

 private:
  [[nodiscard]] stream::Placement placement(const stream::SourceInfo& info) const {
    stream::Placement placement = info;
    placement.crs = crs.crs;
    return placement;
  }
};

/// Memory for a source, unless it reports that it needs more. The source also gets the unused part
/// of --memory, so that it can keep more files of a mosaic open.
constexpr std::uint64_t kSourceMemory = std::uint64_t{64} << 20;
constexpr std::size_t kBlocksAhead = 4;
/// Memory limit of a build, unless its context sets another.
constexpr std::uint64_t kMemory = std::uint64_t{256} << 20;
/// Number of parts of points that are sorted ahead. Each uses about 20 MiB.
constexpr unsigned kMaxPartsAhead = 4;

/// Estimates peak memory with this many threads, excluding the source's. The estimate is generous:
/// a benchmark prints the true peak.
std::uint64_t memory_without_source(const BuildRequest& request, std::size_t payload_size,
                                    std::uint64_t threads) {
  const std::uint64_t point = sizeof(stream::Point3) + payload_size;
  // Counts the blocks that are read ahead, clustered or waiting, and one per level that is being
  // filled, with temporary data per point. Also counts the blocks that the store writer holds back
  // to train its compression tables.
  const std::uint64_t blocks =
      (8 * threads + 8 + kBlocksAhead) * request.block_points * (point + 64) +
      64 * request.block_points * (point + 16);
  // With many medians, clusters have a few points: what the writer keeps for each counts too,
  // several levels wait for their tables at once, each with a third of the blocks of the level
  // below, and threads keep more freed memory. Measured with up to 9 million points.
  const std::uint64_t small_clusters =
      std::min<std::uint64_t>(request.block_points, 100 * request.k) *
      (threads * 4100 + 32 * point + 96 * 72);
  return (std::uint64_t{32} << 20) + blocks + small_clusters;
}

/// Returns the ratio of a cell's height to its width on the ground, in the middle of the raster.
double cell_aspect(const Ground& ground, const stream::SourceInfo& info) {
  stream::Box3 raster;
  raster.include(stream::Point3{0, 0, 0});
  raster.include(
      stream::Point3{static_cast<double>(info.columns), static_cast<double>(info.rows), 0});
  const GroundMap map = ground.map(raster);
  const auto length = [&map](std::size_t axis) {
    return std::sqrt(map[axis] * map[axis] + map[3 + axis] * map[3 + axis]);
  };
  return length(1) / length(0);
}

/// Throws: stream::Error if cells of a raster, or steps of a cloud's coordinates, are too small or
/// too large to be distinguished. The store of such a source could not be read.
void check_cells(const stream::SourceInfo& info) {
  const std::array<double, 6>& m = info.world.xy;
  const double area = m[0] * m[4] - m[1] * m[3];
  bool apart = std::isfinite(area) && area != 0 && std::isfinite(m[2]) && std::isfinite(m[5]);
  if (info.grid && apart) {
    const auto last = [](std::uint64_t cells) { return static_cast<double>(cells - 1); };
    const auto same = [&](double column, double row, double next_column, double next_row) {
      const stream::Point3 a = world_point(info, {column, row, 0});
      const stream::Point3 b = world_point(info, {next_column, next_row, 0});
      return a[0] == b[0] && a[1] == b[1];
    };
    for (const double row : {0.0, last(info.rows)}) {
      for (const double column : {0.0, last(info.columns)}) {
        if (info.columns > 1) apart &= !same(column, row, column == 0 ? 1 : column - 1, row);
        if (info.rows > 1) apart &= !same(column, row, column, row == 0 ? 1 : row - 1);
      }
    }
  }
  if (apart) return;
  throw stream::Error(info.files.empty() ? std::string() : info.files.front(),
                      std::string("the places of its ") + (info.grid ? "cells" : "coordinates") +
                          " cannot be distinguished: steps of " +
                          plain_number(base::hypot(m[0], m[3])) + " x " +
                          plain_number(base::hypot(m[1], m[4])) + " from " + plain_number(m[2]) +
                          ", " + plain_number(m[5]))
      .remedy(info.grid ? "correct the size of its cells" : "correct the scale of its coordinates");
}

/// Limits a source to its first points.
class FirstPoints final : public stream::PointSource {
 public:
  FirstPoints(std::unique_ptr<stream::PointSource> source, std::uint64_t limit)
      : source_(std::move(source)), limit_(limit) {}

  [[nodiscard]] const stream::SourceInfo& info() const override { return source_->info(); }
  [[nodiscard]] stream::Progress progress() const override { return source_->progress(); }
  [[nodiscard]] std::uint64_t reading_bytes() const override { return source_->reading_bytes(); }
  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    source_->refine(cell_aspect, memory_bytes);
  }
  bool next(stream::PointBlock& block) override {
    block.clear();
    return source_->progress().points < limit_ && source_->next(block);
  }

 private:
  std::unique_ptr<stream::PointSource> source_;
  std::uint64_t limit_;
};

/// Returns the lengths on the ground of the units of stored coordinates, with heights weighted.
std::array<double, 3> unit_lengths(const GroundMap& map) {
  const auto length = [&map](std::size_t axis) {
    return base::hypot(base::hypot(map[axis], map[3 + axis]), map[6 + axis]);
  };
  return {length(0), length(1), length(2)};
}

/// Notes the order in which the points arrived, if they were sorted.
void note_order(const stream::OrderedSource::Report& order, const std::filesystem::path& folder,
                const Context& context) {
  if (!order.reordered) return;
  std::string line = "the points were put in spatial order";
  if (order.spread > 0) {
    line += ": as they came, blocks were " + readable_number(order.spread, 2) +
            " times as wide as necessary";
  }
  if (order.temporary_bytes > 0) {
    line += "; this used " + readable_bytes(order.temporary_bytes) +
            " of temporary disk space in " + folder.string();
  }
  context.say(line);
}

[[noreturn]] void throw_no_points(const BuildRequest& request, const stream::SourceInfo& info,
                                  const stream::Progress& read) {
  const stream::Selection& selection = request.selection;
  const bool selected = !selection.where.empty() || selection.region;
  std::string cause;
  stream::Message remedy;
  if (selected && (read.excluded > 0 || read.nodata == 0)) {
    // Parts outside the region are neither read nor counted.
    cause = read.excluded > 0 ? fmt::format("none of its {} points is selected", read.excluded)
                              : "none of its points is selected";
    remedy = stream::message("give another {where} or {region}");
  } else {
    cause = info.grid ? "has no point with data" : "has no point";
    if (read.nodata > 0) {
      cause += fmt::format(" ({}, {})", counted(read.nodata, info.grid ? "cell" : "point"),
                           info.grid ? "all nodata" : "all without a coordinate");
    }
    remedy = info.grid ? "check the file and its nodata value" : "check the file";
  }
  throw stream::Error(info.files.empty() ? std::string() : info.files.front(), cause)
      .remedy(remedy);
}

/// Returns how to join the points across the antimeridian; nullopt if they need not be joined.
/// Throws: stream::Error if they must be joined and the input cannot be read again.
std::optional<JoinedLongitudes::Joint> needed_joint(const BuildRequest& request,
                                                    const JoinedLongitudes& longitudes,
                                                    const Context& context) {
  std::optional<JoinedLongitudes::Joint> joint = longitudes.joint();
  if (!joint || request.most_points > 0) return std::nullopt;
  if (request.entities != stream::Entities::points) {
    // Their corners are attributes, which cannot be shifted.
    context.say("the points " + joint->reason +
                ", and what connects them goes around the earth: continue longitudes beyond 180");
    return std::nullopt;
  }
  if (!request.open &&
      std::any_of(request.inputs.begin(), request.inputs.end(),
                  [](const std::string& name) { return stream::reads_once(name); })) {
    throw stream::Error(request.inputs.front(),
                        "its points " + joint->reason +
                            ", which is known only at the end, and the input can be read only once")
        .remedy("pass a file, or count longitudes from 0 to 360 or continue them beyond 180");
  }
  return joint;
}

/// Reads the input once and builds the store. A separate thread reads ahead, and the context's
/// threads cluster.
class Build {
 public:
  /// extension: the store to append to, or null. middle: for joining points across the
  /// antimeridian; see JoinedLongitudes.
  Build(const BuildRequest& request, const Context& context, StoreExtension* extension,
        std::optional<double> middle)
      : request_(request), context_(context), extension_(extension), middle_(middle) {}

  /// Returns the outcome. If a middle is needed and was not given, returns the joint to build again
  /// with. Call it only once.
  std::variant<BuildOutcome, JoinedLongitudes::Joint> run();

 private:
  [[nodiscard]] std::unique_ptr<stream::PointSource> open_input();
  [[nodiscard]] std::unique_ptr<stream::PointSource> in_order(
      std::unique_ptr<stream::PointSource> points);
  /// Returns the number of threads: the requested number, or fewer if they do not fit into
  /// --memory. Results do not depend on it. Throws: stream::Error if not even one thread fits.
  [[nodiscard]] unsigned threads_for(std::size_t payload_bytes) const;
  /// Pushes all points to the builder.
  void read_all(cluster::HierarchyBuilder& builder, const stream::StoreSchema& schema,
                UndeclaredVoids& voids, JoinedLongitudes& longitudes);
  [[nodiscard]] bool next(cluster::HierarchyBuilder& builder, stream::PointBlock& block);
  [[nodiscard]] BuildOutcome outcome_of(const stream::Progress& read,
                                        const cluster::HierarchyResult& result,
                                        std::uint64_t store_bytes) const;
  void describe_extension(const stream::Progress& read, BuildOutcome& outcome) const;
  /// Notes what a user should know about the input.
  void note(const BuildOutcome& outcome, const UndeclaredVoids& voids) const;

  [[nodiscard]] std::filesystem::path folder() const {
    return std::filesystem::absolute(request_.store).parent_path();
  }

  const BuildRequest& request_;
  const Context& context_;
  StoreExtension* extension_;
  std::optional<double> middle_;
  std::uint64_t memory_bytes_ = context_.memory_or(kMemory);

  DamageReport damage_;
  std::stop_source reading_;
  std::function<void()> stop_reading_ = [this] { reading_.request_stop(); };
  std::stop_callback<std::function<void()>> on_stop_{context_.stop, stop_reading_};
  std::mutex reporting_;                          ///< guards both reports
  std::optional<ProgressReport> records_report_;  ///< until the first points are sorted
  std::optional<ProgressReport> points_report_;
  stream::SourceInfo info_;
  /// Computed on first use. PROJ takes tens of milliseconds to open its database; the first points
  /// are read meanwhile.
  std::shared_future<Located> located_;
  stream::OrderedSource* ordered_ = nullptr;  ///< in points_, unless they are cells
  /// The last member, because its thread uses the members above.
  std::unique_ptr<stream::PointSource> points_;
};

std::unique_ptr<stream::PointSource> Build::open_input() {
  stream::SourceOptions options;
  options.format = request_.input_format;
  options.entities = request_.entities;
  options.block_points = request_.block_points;
  options.memory_bytes = std::max(kSourceMemory, memory_bytes_);
  options.band = request_.band;
  options.selection = request_.selection;
  options.heights_of_colour = request_.heights_of_colour;
  options.cell = request_.cell.value_or(0);
  options.crs = request_.crs;
  options.same_crs = &same_crs;
  options.threads = std::max(1U, context_.threads);
  if (request_.skip_damaged) options.on_damage = damage_.handler();
  options.stop = reading_.get_token();
  auto source =
      request_.open ? request_.open(options) : stream::open_source(request_.inputs, options);
  if (request_.most_points == 0) return source;
  return std::make_unique<FirstPoints>(std::move(source), request_.most_points);
}

std::unique_ptr<stream::PointSource> Build::in_order(std::unique_ptr<stream::PointSource> points) {
  const auto on_the_ground = [located = located_](const stream::Box3& box) {
    return unit_lengths(located.get().ground.map(box));
  };
  const auto report = [this](const stream::Progress& progress) {
    const std::lock_guard lock(reporting_);
    if (!records_report_) records_report_.emplace(context_, "records");
    records_report_->update(progress.points, progress.fraction);
  };
  auto ordered = stream::in_spatial_order(
      std::move(points),
      {.order = request_.order,
       .block_points = request_.block_points,
       .unit_lengths = on_the_ground,
       .folder = folder(),
       .threads = std::max(1U, context_.threads),
       .parts_ahead = memory_bytes_ < kMemory ? 0 : std::min(context_.threads / 4, kMaxPartsAhead),
       .stop = reading_.get_token(),
       .reading = report});
  ordered_ = ordered.get();
  return ordered;
}

unsigned Build::threads_for(std::size_t payload_bytes) const {
  const std::uint64_t source_bytes = std::max(kSourceMemory, points_->reading_bytes());
  const auto needed = [&](unsigned threads) {
    return source_bytes + memory_without_source(request_, payload_bytes, threads);
  };
  for (unsigned threads = std::max(1U, context_.threads); threads > 0; --threads) {
    if (needed(threads) <= memory_bytes_) return threads;
  }
  const auto in_mebibytes = [](std::uint64_t bytes) {
    return fmt::format("{}M", (bytes >> 20) + 1);
  };
  throw stream::Error(
      request_.store.string(),
      stream::message(
          "{memory_bytes} {}M is not enough: the build needs {}, {} of it to read the input",
          memory_bytes_ >> 20, in_mebibytes(needed(1)), in_mebibytes(source_bytes)))
      .remedy(request_.k > 0 ? stream::message("raise {memory_bytes}, or lower {k}")
              : source_bytes > kSourceMemory && info_.grid
                  ? stream::message(
                        "raise {memory_bytes}, lower {block_points}, or rewrite large strips and "
                        "tiles as small tiles: gdal_translate -co TILED=YES")
                  : stream::message("raise {memory_bytes}, or lower {block_points}"));
}

bool Build::next(cluster::HierarchyBuilder& builder, stream::PointBlock& block) {
  // Reading stops if the context requests it, or after a failure that push() rethrows.
  try {
    return points_->next(block);
  } catch (const stream::Stopped&) {
    if (!context_.stop.stop_requested()) builder.push({});
    throw;
  }
}

void Build::read_all(cluster::HierarchyBuilder& builder, const stream::StoreSchema& schema,
                     UndeclaredVoids& voids, JoinedLongitudes& longitudes) {
  const LatitudeCheck check_latitude(schema,
                                     info_.files.empty() ? std::string() : info_.files.front());
  stream::PointBlock block;
  std::vector<std::byte> marked;
  while (next(builder, block)) {
    voids.add(block);
    if (extension_ != nullptr) extension_->place(block);
    check_latitude(block.positions);
    if (!info_.grid) longitudes(block.positions);
    if (schema.payload_size() > info_.payload_size()) {  // room for the mark
      append_zero_byte(block.payload, info_.payload_size(), block.positions.size(), marked);
      builder.push(block.positions, marked);
    } else {
      builder.push(block.positions, block.payload);
    }
    const stream::Progress progress = points_->progress();
    if (context_.stop.stop_requested()) throw stream::Stopped();
    const std::lock_guard lock(reporting_);
    records_report_.reset();
    points_report_->update(progress.points, progress.fraction);
  }
}

BuildOutcome Build::outcome_of(const stream::Progress& read, const cluster::HierarchyResult& result,
                               std::uint64_t store_bytes) const {
  BuildOutcome outcome;
  outcome.points = outcome.store_points = result.points;
  outcome.nodata = read.nodata;
  outcome.raster = info_.grid;
  outcome.excluded = read.excluded;
  outcome.lost = read.lost;
  outcome.outliers = result.outliers;
  outcome.empty_values = read.empty_values;
  outcome.withheld = read.withheld;
  outcome.store_bytes = store_bytes;
  if (ordered_ != nullptr) outcome.order = ordered_->report();
  outcome.top = result.top;
  outcome.level_points = result.level_points;
  outcome.level_clusters = result.level_clusters;
  return outcome;
}

/// Counts the added points alone, and the levels of the whole store.
void Build::describe_extension(const stream::Progress& read, BuildOutcome& outcome) const {
  const stream::Store store = stream::Store::open(request_.store);
  outcome.known = extension_->known_cells();
  outcome.points = read.points - outcome.known;
  outcome.store_points = store.points();
  outcome.top = store.top();
  outcome.level_points.clear();
  outcome.level_clusters.clear();
  for (const stream::LevelInfo& level : store.levels()) {
    outcome.level_points.push_back(level.points);
    outcome.level_clusters.push_back(level.clusters);
  }
}

void Build::note(const BuildOutcome& outcome, const UndeclaredVoids& voids) const {
  const auto say = [this](const stream::Message& note) {
    if (!note.empty()) context_.say(note);
  };
  if (outcome.empty_values > 0) {
    say(counted(outcome.empty_values, "attribute", "has no value in its file; it is NaN",
                "have no value in their file; they are NaN"));
  }
  if (outcome.withheld > 0) {
    say(counted(outcome.withheld, "point",
                "is marked as withheld in its file; it is kept, with the mark",
                "are marked as withheld in their file; they are kept, with the mark"));
  }
  note_spooled(info_, context_);
  say(info_.note);
  say(voids.note());
  damage_.note(context_);
  note_order(outcome.order, folder(), context_);
  const auto& [crs, ground] = located_.get();
  say(crs.note);
  say(ground.assumption());
}

std::variant<BuildOutcome, JoinedLongitudes::Joint> Build::run() {
  points_ = open_input();
  info_ = points_->info();
  check_cells(info_);
  located_ = std::async(std::launch::deferred, [this] { return Located(info_, request_); });
  points_report_.emplace(context_, "points");
  if (!info_.grid) points_ = in_order(std::move(points_));
  // Checks memory before reading begins, without the bytes that the store adds, which are known
  // later.
  static_cast<void>(threads_for(info_.payload_size()));
  // Reads ahead from now on, except for rasters, which need their cell size first (see below).
  points_ = stream::read_ahead(std::move(points_), kBlocksAhead, reading_, reading_.get_token());
  const auto& [crs, ground] = located_.get();
  stream::StoreSchema schema = schema_of(info_, crs, request_);
  const unsigned threads = threads_for(schema.payload_size());
  if (info_.grid) {
    // Tiles should be square on the ground, and the size of a cell there is known only now.
    points_->refine(
        cell_aspect(ground, info_),
        memory_bytes_ - memory_without_source(request_, schema.payload_size(), threads));
  }

  std::span<const stream::StorePart> parts;
  std::optional<Ground> extended_ground;
  if (extension_ != nullptr) {
    extension_->set_source(info_, schema);
    schema = extension_->schema();
    extended_ground.emplace(schema, request_.z_weight);
    parts = extension_->parts();
  }
  stream::StoreWriter writer(request_.store, schema, parts, request_.replace, threads);
  const bool trial = request_.most_points > 0;
  MeshInput mesh(request_, info_, schema, middle_, context_);
  stream::StoreWriter::MakeSurface make_surface;
  if (request_.surface && !trial) {
    make_surface = [&](const stream::Store& store, const stream::ClusterOrder& order) {
      return request_.surface(store, order, mesh.triangles());
    };
  }
  StoreSink sink(writer, !trial, context_.stop, make_surface);
  cluster::HierarchyOptions options =
      clustering_of(request_, schema, extended_ground ? *extended_ground : ground);
  if (extension_ != nullptr) options.existing_clusters = extension_->clusters();
  options.threads = threads;
  options.stop = context_.stop;
  // Reports a full disk at once, even if the producer of the input is idle.
  options.on_failure = stop_reading_;
  cluster::HierarchyBuilder builder(options, sink);
  UndeclaredVoids voids(info_);
  JoinedLongitudes longitudes(schema, middle_);
  read_all(builder, schema, voids, longitudes);

  const stream::Progress read = points_->progress();
  if (read.points == 0) throw_no_points(request_, info_, read);
  if (!middle_) {
    if (auto joint = needed_joint(request_, longitudes, context_)) return *std::move(joint);
  }
  writer.set_nodata(schema.nodata + read.nodata);
  if (extension_ != nullptr) extension_->push_root(builder);
  const cluster::HierarchyResult result = builder.finish();
  BuildOutcome outcome = outcome_of(read, result, sink.store_bytes());
  if (extension_ != nullptr) describe_extension(read, outcome);
  if (request_.surface && !trial) {
    outcome.surface = stream::Store::open(request_.store).surface();
    outcome.input_triangles = mesh.read();
  }
  note(outcome, voids);
  if (extension_ != nullptr && extension_->parts().front().store.surface()) {
    context_.say("the surface of the store is left out: it lacks the new points");
  }
  return outcome;
}

void check_append(const BuildRequest& request) {
  if (request.replace) throw UsageError(stream::message("give either {append} or {replace}"));
  if (request.most_points > 0) {
    throw UsageError(stream::message("{append} excludes a trial run"));
  }
  if (request.surface) {
    throw UsageError(stream::message("{append} excludes a surface: build the store again with it"));
  }
}

}  // namespace

BuildOutcome build_store(const BuildRequest& given, const Context& context) {
  check_clustering(given);
  BuildRequest request = given;
  std::optional<StoreExtension> extension;
  if (given.append) {
    check_append(given);
    extension.emplace(given);
    request = extension->clustering_as_before(given);
  }
  StoreExtension* const extended = extension ? &*extension : nullptr;
  request.block_points = block_points_for(request);
  auto built = Build(request, context, extended, std::nullopt).run();
  if (const auto* const joint = std::get_if<JoinedLongitudes::Joint>(&built)) {
    const bool beyond = joint->reason.ends_with("antimeridian");
    context.say("the points " + joint->reason + ": they are read again and joined" +
                (beyond ? ", with longitudes that continue beyond 180 degrees" : ""));
    built = Build(request, context, extended, joint->middle).run();
  }
  return std::get<BuildOutcome>(std::move(built));
}

}  // namespace terrace::terrain
