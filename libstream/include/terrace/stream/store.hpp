// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include <terrace/base/cluster.hpp>

#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/schema.hpp"
#include "terrace/stream/where.hpp"

/// A store is a folder that holds every input point exactly once in a hierarchy of clusters, each
/// of which can be read separately. FORMAT.md describes the bytes.
///
/// <terrace/base/cluster.hpp> defines levels, representatives, members, children and the root.

namespace terrace::stream {

struct Ownership;      // atomic_file.hpp
struct StoredSurface;  // stored_surface.hpp
struct ClusterOrder;

using base::cluster_id;
using base::ClusteredBlock;
using base::ClusterId;
using base::ClusterSummary;
using base::kNoRepresentative;
using base::level_of;
using base::ordinal_of;

/// The description of a store's points and of how the store was made. Never contains a time, path
/// or host.
struct StoreSchema : Schema {
  std::string vertical{};    ///< "ellipsoidal", "orthometric", or empty: unknown
  std::uint64_t nodata = 0;  ///< cells left out; see StoreWriter::set_nodata()
  std::string format{};      ///< format of the source
  /// Parameters of the clustering, in this order, as name and text of the value.
  std::vector<std::pair<std::string, std::string>> parameters{};
};

class Store;
struct StorePart;

/// Writes a store. It appears under its name, complete and synced, when finish() returns; a writer
/// that dies or throws before that leaves nothing that can be opened.
class StoreWriter {
 public:
  /// An encoded block, the result of encode() for append().
  class Encoded;
  struct EncodedDeleter {
    void operator()(Encoded*) const;
  };
  using EncodedPtr = std::unique_ptr<Encoded, EncodedDeleter>;

  /// threads: number of threads for calls of append() or finish() that encode many blocks, as when
  /// symbols have been counted in 64 of them. The bytes do not depend on it.
  /// Throws: Error if `path` exists (unless `replace` is true and it is a store without foreign
  /// files, see Store::ownership_of()) or cannot be written.
  StoreWriter(const std::filesystem::path& path, StoreSchema schema, bool replace = false,
              unsigned threads = 1);
  /// Writes a store of the clusters of other stores and of those that are appended. On each level
  /// the clusters of the parts come first, in the order of the parts, without those of their roots:
  /// the caller appends the points of the roots on the roots' levels, with the new ordinals of the
  /// clusters that they head. Clusters are not decoded: files are linked, or copied from another
  /// file system. Surfaces are left out.
  ///
  /// One of the parts may be at `path`. The new store then replaces it in one step, unless another
  /// process has changed it meanwhile, which is an Error of finish(). The ordinals of the clusters
  /// of the first part stay the same.
  /// schema: fits all parts once they are shifted; includes their `nodata`. Throws: Error, also for
  /// a damaged copy; Stopped.
  StoreWriter(const std::filesystem::path& path, StoreSchema schema,
              std::span<const StorePart> parts, bool replace = false, unsigned threads = 1);
  ~StoreWriter();
  StoreWriter(const StoreWriter&) = delete;
  StoreWriter& operator=(const StoreWriter&) = delete;

  /// The expensive half of appending a block, whose positions are stored coordinates and whose
  /// payload has Schema::payload_size() bytes per point, the attributes in the order of the schema.
  /// Its ordinal on its level is not used. May be called by several threads at once. The block
  /// need not outlive the call.
  [[nodiscard]] EncodedPtr encode(const ClusteredBlock& block) const;
  /// The ordered half: one thread at a time. The order of a level's blocks defines the ordinals.
  /// Returns the ordinal of the block's first cluster; the others follow it.
  std::uint64_t append(EncodedPtr block);
  /// Number of clusters of `level` so far.
  [[nodiscard]] std::uint64_t clusters(unsigned level) const;

  [[nodiscard]] const StoreSchema& schema() const;
  /// Sets the number of cells that the source left out for lack of data. It is known at the
  /// source's end, so it must be set before finish().
  void set_nodata(std::uint64_t cells);

  /// Writes the points of the top level, passed as a block of one cluster without a
  /// representative, syncs and publishes the store. If `publish` is false it is a trial run and
  /// removes the store. Returns the size of the store in bytes.
  ///
  /// surface: returns the surface through the points of the complete but not yet published store,
  /// to be stored with it. Its exceptions leave no store.
  using MakeSurface = std::function<StoredSurface(const Store&, const ClusterOrder&)>;
  std::uint64_t finish(const ClusteredBlock& root, bool publish = true,
                       const MakeSurface& surface = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A decoded cluster. `positions` are the members in the order that defines their numbers. Vectors
/// are reused between calls.
struct ClusterPoints {
  std::vector<Point3> positions;
  std::vector<std::byte> payload;       ///< Schema::payload_size() bytes per member
  std::vector<std::uint64_t> children;  ///< `level` ordinals per member, level 0 first
  bool has_representative = false;      ///< false only for the root
  Point3 representative{};
  std::uint32_t before_representative = 0;  ///< number of members coded before it
  std::vector<std::byte> representative_payload;
  std::vector<std::uint64_t> representative_children;  ///< its `level` ordinals, level 0 first
  /// In a view (see Store::where()), 1 for members that meet the condition; empty if all do.
  std::vector<std::uint8_t> matches;

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  [[nodiscard]] bool match(std::size_t member) const {
    return matches.empty() || matches[member] != 0;
  }
};

/// The index entry of a cluster.
struct ClusterRecord {
  ClusterSummary summary;    ///< as stored: box exact or rounded outward, error rounded up
  std::uint64_t offset = 0;  ///< of the cluster's bytes in the level's file
  std::uint32_t bytes = 0;
  std::uint32_t points = 0;  ///< members
};

/// The size of a level, as the manifest states it.
struct LevelInfo {
  unsigned level = 0;
  std::uint64_t points = 0;    ///< points whose highest level is this or a higher one
  std::uint64_t members = 0;   ///< points whose highest level is exactly this
  std::uint64_t clusters = 0;  ///< stored at this level
  std::uint64_t bytes = 0;     ///< clusters and index
  std::uint64_t index_bytes = 0;
  std::size_t segments = 1;  ///< runs that wrote its clusters
};

/// The size of a store's surface, as the manifest states it.
struct SurfaceInfo {
  std::uint64_t vertices = 0, triangles = 0;
  std::uint64_t bytes = 0;
};

/// A fault that Store::verify() reports: what is wrong, and where.
struct Problem {
  std::string file;
  std::uint64_t offset = 0;
  std::string what;
};

/// A store opened for reading. Several threads may call const members at once.
///
/// Even if files are damaged, data read from an open store is consistent with its manifest, so
/// callers can size arrays by it. Points are inside bounds(), those of a raster on its columns and
/// rows. Children exist. When for_each() has completed a level, it has visited as many members as
/// levels() states, and it never visits more before it throws. verify() checks the hierarchy as a
/// whole.
///
/// Copies are cheap; they share the files and the indices read so far.
class Store {
 public:
  /// Opens a store in a folder, or at a URL of http, https or s3 (see network.hpp; its path() has
  /// neither password nor query). Throws: Error if `path` is not a store, or has a newer version or
  /// a damaged manifest.
  static Store open(const std::filesystem::path& path);
  /// Opens a store whose files are not in a folder but in memory, in an archive or on a server.
  /// `name` replaces the folder in messages and in path(). `files` is kept if the store has a
  /// surface or several segments. Throws as above, and what `files` throws.
  static Store open(const std::string& name, const OpenByName& files);
  /// Whether `path` is a store. If a writer moved the store aside in order to replace it and then
  /// died, this gives the store its name back. open() calls this. True for every URL, without
  /// asking the server.
  static bool exists(const std::filesystem::path& path);
  /// Whether a folder is a store, of any version, and contains only overlays and the files that its
  /// manifest lists. Reads the manifest and the names in the folder.
  static Ownership ownership_of(const std::filesystem::path& folder);

  /// Returns the same store for cancellable work: once a stop is requested, every read throws
  /// Stopped, so loops that read need not check for a stop.
  [[nodiscard]] Store with_stop(std::stop_token stop) const;
  /// Throws: Stopped if a stop was requested. For loops that do not read.
  void check_stop() const;

  /// Returns a view: the same store restricted to the points that meet a condition (see Where).
  /// bounds() is their bounding box, read() and for_each() mark them, and StoreQuery finds only
  /// them; numbers of points, clusters and bytes are still those of the whole store. The points of
  /// a level of a view are the level's points that meet the condition. A representative that does
  /// not meet it is left out, even if points below it do. Called on a view, combines both
  /// conditions; an empty condition gives the same store. Copies share the bounds once they are
  /// known. Throws: Error that names the character of a bad condition.
  [[nodiscard]] Store where(const std::string& condition) const;
  /// The condition of a view, otherwise null. Valid as long as a copy of the view exists.
  [[nodiscard]] const Where* condition() const;
  /// The whole store of a view; otherwise the store itself.
  [[nodiscard]] Store whole() const;
  /// False if the index shows that no member of the cluster meets the condition. Clusters below it
  /// may still have points that do. Throws: as record() does.
  [[nodiscard]] bool may_match(ClusterId id) const;

  [[nodiscard]] const StoreSchema& schema() const;
  /// The version of the format.
  [[nodiscard]] int version() const;
  [[nodiscard]] const std::filesystem::path& path() const;
  [[nodiscard]] unsigned top() const;
  [[nodiscard]] std::span<const LevelInfo> levels() const;  ///< level 0 first
  [[nodiscard]] std::uint64_t points() const;
  [[nodiscard]] std::uint64_t bytes() const;
  /// The CRC-32 of the manifest, which contains those of all other files, so it identifies the
  /// store.
  [[nodiscard]] std::uint32_t checksum() const;
  /// The bounding box of all points, in stored coordinates. That of a view is computed by the first
  /// call, which reads clusters from the root down along the border. Throws, for a view: Error if
  /// no point meets the condition or the store is damaged; Stopped.
  [[nodiscard]] const Box3& bounds() const;
  /// Mean of stored coordinate 2 over all points.
  [[nodiscard]] double mean_height() const;
  [[nodiscard]] ClusterId root() const;
  /// The surface that is stored with the points, of a view that of the whole store; nullopt without
  /// one.
  [[nodiscard]] std::optional<SurfaceInfo> surface() const;
  /// Reads the surface; order: cluster_order() of this store. Throws: Error if there is none, or
  /// for damage.
  [[nodiscard]] StoredSurface read_surface(const ClusterOrder& order) const;

  /// Reads a cluster's index entry. Throws: Error for a damaged page or an ordinal that does not
  /// exist.
  [[nodiscard]] ClusterRecord record(ClusterId id) const;
  /// A box that contains all points of the cluster, those below it, and those of its neighbours in
  /// the index. A query that does not intersect it can skip the cluster without calling record().
  /// Reads a few bytes per 64 pages of the index, once. Requires that the cluster exists. Throws:
  /// Error.
  [[nodiscard]] Box3 page_box(ClusterId id) const;
  /// Like page_box(), but does not read, so it may be larger. Requires that the cluster exists.
  [[nodiscard]] Box3 coarse_box(ClusterId id) const;
  /// The range of each attribute's values over the cluster's points, including the representative,
  /// from the index. It may be wider than that by a 32nd of the range over the neighbouring
  /// clusters. Throws: Error for a damaged page or an ordinal that does not exist.
  [[nodiscard]] std::vector<ValueRange> attribute_ranges(ClusterId id) const;
  /// What calls for a cluster read: page_box(), record(), or read().
  enum class Part : std::uint8_t { page_box, record, cluster };
  /// Whether reads wait for a server, so that prefetch() saves time.
  [[nodiscard]] bool is_remote() const;
  /// Requests, together, what later calls for these clusters of a level read, if the store is on a
  /// server. Of many clusters, it requests those of the first ones only, as many as are in one file
  /// and are kept until they are read; returns their number, at least 1. Clusters of level 0 for
  /// which may_match() is false are left out. Requires that the clusters exist. Throws: Error.
  std::size_t prefetch(Part part, unsigned level, std::span<const std::uint64_t> ordinals) const;
  /// Decodes a cluster. Throws: Error for damage (checksum, counts); never returns a wrong point.
  void read(ClusterId id, ClusterPoints& out) const;
  using VisitCluster = std::function<void(ClusterId, const ClusterRecord&, const ClusterPoints&)>;
  /// Visits every cluster of `level` in order of ordinals; reads sequentially. In a view, clusters
  /// of level 0 for which may_match() is false are neither read nor visited.
  void for_each(unsigned level, const VisitCluster& visit) const;
  /// Visits the clusters from ordinal `first` up to, but not including, `end`. Returns their number
  /// of members, including clusters not visited; over all of a level it must add up to
  /// LevelInfo::members, which the caller checks. Requires first <= end <= the number of clusters.
  std::uint64_t for_each(unsigned level, std::uint64_t first, std::uint64_t end,
                         const VisitCluster& visit) const;
  /// The Error that for_each() throws if the number of a level's members differs from levels().
  [[nodiscard]] Error miscounted(unsigned level) const;
  /// Checks every byte and invariant and reports each fault, from the calling thread, in an order
  /// that does not depend on `threads`. Returns true if there are no faults.
  bool verify(const std::function<void(const Problem&)>& report, unsigned threads = 1) const;

 private:
  friend class StoreWriter;
  struct Impl;
  class View;
  class ConditionView;
  explicit Store(std::shared_ptr<Impl> impl);
  void mark(ClusterPoints& points) const;

  std::shared_ptr<Impl> impl_;
  std::shared_ptr<const View> view_;
  std::stop_token stop_;
};

/// A store whose clusters become those of another one.
struct StorePart {
  Store store;
  /// Added to its stored coordinates. Zero on axes whose coordinates are not integers.
  std::array<std::int64_t, 3> shift{};
};

/// Writes a store of the same clusters, with those of each level in the order of a Hilbert curve
/// through the centres of their boxes, so that clusters near each other are read in few ranges of
/// bytes. Its checksum differs, so it does not accept overlays of the old store. Boxes above level
/// 0 may be wider by a step of their coding. Returns the size of the new store in bytes; its bytes
/// do not depend on `threads`. Memory: 16 bytes per cluster of level 0, and 64 blocks of 10,000
/// points; a stored surface is held as a whole. Throws: Error as StoreWriter does, and for damage;
/// Stopped.
std::uint64_t repack(const Store& store, const std::filesystem::path& path, bool replace = false,
                     unsigned threads = 1);

}  // namespace terrace::stream
