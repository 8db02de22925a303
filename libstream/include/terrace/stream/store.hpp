// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/schema.hpp"
#include "terrace/stream/where.hpp"

/// The store: a folder that holds every input point exactly once in a hierarchy of clusters, each
/// of which can be read alone. FORMAT.md describes the bytes.
///
/// Level 0 is full resolution; levels grow coarser upward to the *top*. A cluster of level L has
/// one *representative*, a point whose highest level is above L, and *members*, the points whose
/// highest level is exactly L. A point of highest level h heads one cluster on every level below h
/// and carries their h ordinals (its *children*, level 0 first). The points of the top level, which
/// no cluster represents, are the *root*: cluster 0 of the top level, without a representative.

namespace terrace::stream {

struct Ownership;  // atomic_file.hpp

/// Identifies a cluster for the lifetime of the store: level in the upper 8 bits, ordinal in the
/// lower 56.
enum class ClusterId : std::uint64_t {};

constexpr ClusterId cluster_id(unsigned level, std::uint64_t ordinal) {
  return ClusterId{(std::uint64_t{level} << 56) | ordinal};
}
constexpr unsigned level_of(ClusterId id) {
  return static_cast<unsigned>(static_cast<std::uint64_t>(id) >> 56);
}
constexpr std::uint64_t ordinal_of(ClusterId id) {
  return static_cast<std::uint64_t>(id) & ((std::uint64_t{1} << 56) - 1);
}

/// Summary of a cluster over all its descendants down to level 0, including the representative.
/// `box` is in stored coordinates; `error` is an upper bound of the ground distance in metres from
/// the representative to a descendant.
struct ClusterSummary {
  Box3 box;
  double error = 0.0;
  std::uint64_t descendants = 0;  ///< number of level-0 points below, including the representative

  friend bool operator==(const ClusterSummary&, const ClusterSummary&) = default;
};

/// A clustered block on its way into the store. Points are numbered within the block. Cluster c has
/// the points order[first[c]] ... order[first[c + 1] - 1], including its representative. `children`
/// has `level` ordinals per point, level 0 first. `payload` has the attribute values of each point,
/// packed in the order of the schema, Schema::payload_size() bytes per point.
struct ClusteredBlock {
  unsigned level = 0;
  std::span<const Point3> positions;  ///< stored coordinates
  std::span<const std::byte> payload;
  std::span<const std::uint64_t> children;
  std::span<const std::uint32_t> first;
  std::span<const std::uint32_t> order;
  std::span<const std::uint32_t> representatives;  ///< point number, one per cluster
  std::span<const ClusterSummary> summaries;       ///< one per cluster
};

/// The description of a store's points and of how it was made. It never contains a time, path or
/// host.
struct StoreSchema : Schema {
  std::string vertical{};    ///< "ellipsoidal", "orthometric", or empty: unknown
  std::uint64_t nodata = 0;  ///< cells left out; see StoreWriter::set_nodata()
  std::string format{};      ///< of the source
  /// Parameters of the clustering, in this order, as name and value (already printed).
  std::vector<std::pair<std::string, std::string>> parameters{};
};

/// Writes a store. It appears under its name, complete and synced, when finish() returns, and not
/// before: a writer that dies or throws leaves nothing that opens.
class StoreWriter {
 public:
  /// An encoded block, on its way from encode() to append().
  class Encoded;
  struct EncodedDeleter {
    void operator()(Encoded*) const;
  };
  using EncodedPtr = std::unique_ptr<Encoded, EncodedDeleter>;

  /// threads: how many work where one call of append() or finish() encodes many blocks, which is
  /// when symbols have been counted in 64 of them. The bytes do not depend on it.
  /// Throws: Error if `path` exists (unless `replace`, and it is a store without files of others,
  /// see Store::ownership_of()) or cannot be written.
  StoreWriter(const std::filesystem::path& path, StoreSchema schema, bool replace = false,
              unsigned threads = 1);
  ~StoreWriter();
  StoreWriter(const StoreWriter&) = delete;
  StoreWriter& operator=(const StoreWriter&) = delete;

  /// The expensive half: may be called by several threads at once. Copies what it needs.
  [[nodiscard]] EncodedPtr encode(const ClusteredBlock& block) const;
  /// The ordered half: one thread at a time, blocks of one level in the order that defines the
  /// ordinals. The first cluster of the block gets the returned ordinal, the others follow.
  std::uint64_t append(EncodedPtr block);
  /// Number of clusters appended to `level` so far.
  [[nodiscard]] std::uint64_t clusters(unsigned level) const;

  [[nodiscard]] const StoreSchema& schema() const;
  /// Number of cells that the source left out; known at its end, to be set before finish().
  void set_nodata(std::uint64_t cells);

  /// Writes the points of the top level (as a block of one cluster whose representative is
  /// UINT32_MAX), syncs and publishes. Without `publish` it is a trial, and nothing remains.
  /// Returns the bytes of the store.
  std::uint64_t finish(const ClusteredBlock& root, bool publish = true);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A decoded cluster. `positions` are the members in the order that defines their ids; vectors are
/// reused between calls.
struct ClusterPoints {
  std::vector<Point3> positions;
  std::vector<std::byte> payload;       ///< Schema::payload_size() bytes per member
  std::vector<std::uint64_t> children;  ///< `level` ordinals per member, level 0 first
  bool has_representative = false;      ///< false only for the root
  Point3 representative{};
  std::uint32_t before_representative = 0;  ///< so many members come first in the order of coding
  std::vector<std::byte> representative_payload;
  std::vector<std::uint64_t> representative_children;  ///< its `level` ordinals, level 0 first
  /// In a view (Store::where()): 1 for members that meet the condition. Empty: all do.
  std::vector<std::uint8_t> matches;

  [[nodiscard]] std::size_t size() const { return positions.size(); }
  [[nodiscard]] bool match(std::size_t member) const {
    return matches.empty() || matches[member] != 0;
  }
};

/// The index entry of a cluster.
struct ClusterRecord {
  ClusterSummary summary;    ///< as stored: box exact or grown outward, error rounded up
  std::uint64_t offset = 0;  ///< of its bytes in the level's file
  std::uint32_t bytes = 0;
  std::uint32_t points = 0;  ///< members
};

struct LevelInfo {
  unsigned level = 0;
  std::uint64_t points = 0;    ///< points whose highest level is this or above
  std::uint64_t members = 0;   ///< points whose highest level is exactly this
  std::uint64_t clusters = 0;  ///< stored at this level
  std::uint64_t bytes = 0;     ///< clusters and index
  std::uint64_t index_bytes = 0;
};

struct Problem {
  std::string file;
  std::uint64_t offset = 0;
  std::string what;
};

/// A store opened for reading. All const members may be called by several threads at once.
///
/// Whatever the files hold, data read from an open store is consistent with its manifest, so that
/// callers can size arrays by it: points lie in bounds(), those of a raster on its columns and
/// rows; children exist; a level that for_each() has completed has as many members as levels()
/// says, and no more are visited before it throws. The hierarchy as a whole is checked by verify().
///
/// Copies share the files and the indices read so far; they are cheap.
class Store {
 public:
  /// Throws: Error if there is no store, for a newer version, or a damaged manifest.
  static Store open(const std::filesystem::path& path);
  /// The same for files that are not in a folder: in memory, in an archive, on a server. `name`
  /// replaces the folder in messages and in path(). Throws as above, and what `files` throws.
  static Store open(const std::string& name, const OpenByName& files);
  /// Whether there is a store. One that a writer moved aside in order to replace it gets its name
  /// back, if the writer died then. open() calls this.
  static bool exists(const std::filesystem::path& path);
  /// Whether a folder is a store, of any version, and has no files besides those that its manifest
  /// lists, and overlays. Reads the manifest and the names in the folder.
  static Ownership ownership_of(const std::filesystem::path& folder);

  /// The same store for cancellable work: once `stop` is requested, every read throws Stopped, so
  /// loops that read need no check of their own.
  [[nodiscard]] Store with_stop(std::stop_token stop) const;
  /// Throws: Stopped once that is requested. For loops that continue without reading.
  void check_stop() const;

  /// A view: the same store, of which those points alone count that meet a condition (see Where).
  /// bounds() is theirs, read() and for_each() mark them, StoreQuery finds no others; what counts
  /// points, clusters and bytes remains that of the whole store. The points of a level of a view
  /// are those of the level that meet the condition: a representative that does not is left out,
  /// whatever it stands for. Called on a view: one of the points that meet both conditions; an
  /// empty condition gives the same store. Copies share the bounds once they are known. Throws:
  /// Error that names the character of a bad condition.
  [[nodiscard]] Store where(const std::string& condition) const;
  /// The condition of a view, else null. Valid as long as a copy of the view exists.
  [[nodiscard]] const Where* condition() const;
  /// The store that this is a view of, or itself.
  [[nodiscard]] Store whole() const;
  /// False if the index tells that no point of the cluster, its representative aside, meets the
  /// condition. Its children may head clusters with some. Throws: as record().
  [[nodiscard]] bool may_match(ClusterId id) const;

  [[nodiscard]] const StoreSchema& schema() const;
  [[nodiscard]] int version() const;
  [[nodiscard]] const std::filesystem::path& path() const;
  [[nodiscard]] unsigned top() const;
  [[nodiscard]] std::span<const LevelInfo> levels() const;  ///< level 0 first
  [[nodiscard]] std::uint64_t points() const;
  [[nodiscard]] std::uint64_t bytes() const;
  /// The CRC-32 of the manifest, which contains those of all files: it identifies the store.
  [[nodiscard]] std::uint32_t checksum() const;
  /// The bounding box of all points, in stored coordinates. For a view it is found when first asked
  /// for, from the root down to the clusters at the border. Throws, of a view: Error if no point
  /// meets the condition or the store is damaged; Stopped.
  [[nodiscard]] const Box3& bounds() const;
  /// Mean of stored coordinate 2 over all points.
  [[nodiscard]] double mean_height() const;
  [[nodiscard]] ClusterId root() const;

  /// Throws: Error for a bad page or an ordinal that does not exist.
  [[nodiscard]] ClusterRecord record(ClusterId id) const;
  /// A box that holds all points of the cluster and below it, and those of its neighbours in the
  /// index. What does not meet it need not be looked up by record(). Reads a few bytes for each
  /// 8192 clusters, once. In stores before version 5 it is the store's. Requires that the cluster
  /// exists. Throws: Error.
  [[nodiscard]] Box3 page_box(ClusterId id) const;
  /// The same without reading, and so perhaps larger. Requires that the cluster exists.
  [[nodiscard]] Box3 coarse_box(ClusterId id) const;
  /// The range of the values of each attribute over the cluster's points, including the
  /// representative, without reading them. It may be wider by a 32nd of the range over the
  /// neighbouring clusters. Empty if the store has no ranges (version 1). Throws: Error for a bad
  /// page or an ordinal that does not exist.
  [[nodiscard]] std::vector<ValueRange> attribute_ranges(ClusterId id) const;
  /// Throws: Error for damage (checksum, counts), never returns a wrong point.
  void read(ClusterId id, ClusterPoints& out) const;
  using VisitCluster = std::function<void(ClusterId, const ClusterRecord&, const ClusterPoints&)>;
  /// Visits every cluster of `level` in order of ordinals; reads sequentially. In a view, clusters
  /// of level 0 that may_match() excludes are neither read nor visited.
  void for_each(unsigned level, const VisitCluster& visit) const;
  /// The same for the clusters from ordinal `first` to before `end`. Returns their members, those
  /// not visited included, which for all of a level together are to be as many as levels() says.
  /// Requires first <= end <= the number of clusters.
  std::uint64_t for_each(unsigned level, std::uint64_t first, std::uint64_t end,
                         const VisitCluster& visit) const;
  /// What for_each() throws where a level has not as many members as levels() says.
  [[nodiscard]] Error miscounted(unsigned level) const;
  /// Checks every byte and invariant and reports each fault, from the calling thread and in the
  /// same order whatever the threads; returns true if there is none.
  bool verify(const std::function<void(const Problem&)>& report, unsigned threads = 1) const;

 private:
  struct Impl;
  class View;
  class ConditionView;
  explicit Store(std::shared_ptr<Impl> impl);
  void mark(ClusterPoints& points) const;

  std::shared_ptr<Impl> impl_;
  std::shared_ptr<const View> view_;
  std::stop_token stop_;
};

/// Writes a store of the same clusters, those of each level in the order in which a Hilbert curve
/// passes through the middles of their boxes: what lies together is then read in few ranges of
/// bytes. Its checksum differs, so overlays of the one do not fit the other. Boxes above level 0
/// may be a step of coding wider. Returns the bytes of the new store, which do not depend on
/// `threads`. Memory: 16 bytes a cluster of level 0, and 64 blocks of 10,000 points. Throws: Error
/// as StoreWriter, and for damage; Stopped.
std::uint64_t repack(const Store& store, const std::filesystem::path& path, bool replace = false,
                     unsigned threads = 1);

}  // namespace terrace::stream
