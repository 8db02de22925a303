// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "store/manifest.hpp"
#include "store/read/cluster_decoder.hpp"
#include "store/read/directory.hpp"
#include "store/read/index_page.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::store {

/// Opens a file that the manifest lists. Throws: Error if its size differs.
[[nodiscard]] std::unique_ptr<ByteSource> open_listed(const OpenByName& files,
                                                      const FileEntry& entry);

/// A thread-safe cache of `Value`s by number. A slot holds one value, which the next value for the
/// slot replaces. Values stay alive as long as callers hold them.
template <class Value>
class SlotCache {
 public:
  explicit SlotCache(std::size_t slots) : slots_(slots) {}

  /// Returns the value of `key`, created by make() if it is not cached.
  template <class Make>
  std::shared_ptr<const Value> get(std::uint64_t key, Make&& make) {
    Slot& slot = slots_[key % slots_.size()];
    {
      const std::lock_guard lock(slot.mutex);
      if (slot.value != nullptr && slot.key == key) return slot.value;
    }
    std::shared_ptr<const Value> value = make();
    const std::lock_guard lock(slot.mutex);
    slot.key = key;
    slot.value = value;
    return value;
  }

 private:
  struct Slot {
    std::mutex mutex;
    std::uint64_t key = 0;
    std::shared_ptr<const Value> value;
  };
  std::vector<Slot> slots_;
};

/// Reads parts of a file that are mostly contiguous, many at a time. Earlier parts may be requested
/// again.
class SequentialBytes {
 public:
  explicit SequentialBytes(const ByteSource& file) : file_(file) {}

  /// Returns the bytes, with kPadding readable bytes before and after, valid until the next call.
  /// Requires that they exist.
  ByteView at(std::uint64_t offset, std::size_t size) {
    const std::uint64_t end = ahead_.begin + ahead_.size();
    if (offset >= ahead_.begin && offset + size <= end) return ahead_.part(offset, size);
    if (offset < ahead_.begin) {
      again_.read(file_, offset, size);
      return again_.part(offset, size);
    }
    const std::uint64_t remaining = file_.size() - offset;
    ahead_.read(file_, offset,
                std::max(size, static_cast<std::size_t>(std::min(remaining, kAtOnce))));
    return ahead_.part(offset, size);
  }

 private:
  static constexpr std::uint64_t kAtOnce = std::uint64_t{32} << 10;

  struct Window {
    Bytes padded = Bytes(2 * kPadding);
    std::uint64_t begin = 0;

    [[nodiscard]] std::size_t size() const { return padded.size() - 2 * kPadding; }
    void read(const ByteSource& file, std::uint64_t offset, std::size_t bytes) {
      begin = offset;
      padded.resize(bytes + 2 * kPadding);
      file.read(offset, std::as_writable_bytes(std::span(padded).subspan(kPadding, bytes)));
    }
    [[nodiscard]] ByteView part(std::uint64_t offset, std::size_t bytes) const {
      return ByteView(padded).subspan(kPadding + static_cast<std::size_t>(offset - begin), bytes);
    }
  };

  const ByteSource& file_;
  Window ahead_, again_;
};

/// The decoder and the buffer of one thread that reads clusters.
struct ReadSpace {
  ClusterDecoder decoder;
  Bytes bytes;
};

/// The two files of a segment, open for reading. Clusters are numbered from 0 within the segment.
/// Positions and the numbers of children are those of the store. Thread-safe.
class SegmentReader {
 public:
  /// Reads directory and tables. first: the ordinal in the level of the segment's first cluster.
  /// Throws: Error.
  SegmentReader(const OpenByName& files, const Manifest& manifest, unsigned level,
                const SegmentEntry& segment, std::uint64_t first);

  [[nodiscard]] const Layout& layout() const { return layout_; }
  [[nodiscard]] std::uint64_t clusters() const { return clusters_; }
  /// The ordinal in the level of the first cluster.
  [[nodiscard]] std::uint64_t first() const { return first_; }
  /// Contains all points of the clusters and below them.
  [[nodiscard]] Box3 bounds() const { return in_store(bounds_); }
  [[nodiscard]] bool top() const { return top_; }
  [[nodiscard]] const ByteSource& data() const { return *data_; }
  [[nodiscard]] const ByteSource& index() const { return *index_; }
  [[nodiscard]] std::uint64_t pages() const { return directory_->pages(); }
  /// Returns the offset of a page. Throws: Error.
  [[nodiscard]] std::uint64_t page_offset(std::uint64_t page) const;

  /// See Store::coarse_box(). Requires that the cluster exists.
  [[nodiscard]] Box3 coarse_box(std::uint64_t ordinal) const {
    return in_store(directory_->coarse_box(ordinal / layout_.page_clusters()));
  }
  /// See Store::page_box(). Throws: Error.
  [[nodiscard]] Box3 page_box(std::uint64_t ordinal) const;
  /// Reads a page, or returns it from the cache. Throws: Error.
  [[nodiscard]] std::shared_ptr<const IndexPage> page(std::uint64_t number) const;
  /// Return what page_box(), page() and read() read for a cluster, from the index, the index and
  /// the data; of no bytes if they do not read. Throws: Error.
  [[nodiscard]] BytePart page_box_part(std::uint64_t ordinal) const;
  [[nodiscard]] BytePart page_part(std::uint64_t ordinal) const;
  [[nodiscard]] BytePart cluster_part(std::uint64_t ordinal) const;
  /// Returns the entry of a cluster that exists, and where its bytes begin. Throws: Error.
  [[nodiscard]] Entry entry(std::uint64_t ordinal, std::uint64_t& offset) const;
  /// Returns the entry of a cluster in `page`, checked against the manifest. Throws: Error.
  [[nodiscard]] Entry entry(const IndexPage& page, std::uint64_t ordinal) const;
  /// Returns the record of a cluster with that entry, whose bytes begin at `offset`.
  [[nodiscard]] ClusterRecord record(const Entry& entry, std::uint64_t offset) const {
    ClusterRecord record = record_of(entry, layout_.level, offset, top_);
    if (entry.points > 0) record.summary.box = in_store(record.summary.box);
    return record;
  }
  /// Reads the ranges of a cluster that exists. Throws: Error.
  void ranges(std::uint64_t ordinal, std::vector<KeyRange>& out) const;
  /// Reads a cluster that exists. Throws: Error.
  void read(std::uint64_t ordinal, ReadSpace& space, ClusterPoints& out) const;
  /// Reads a cluster whose entry and offset are known. ahead: reads data(). The points are in the
  /// entry's box and in the bounds of segment and store, and the clusters that they head exist.
  /// Throws: Error.
  void read(std::uint64_t ordinal, const Entry& entry, std::uint64_t offset, SequentialBytes& ahead,
            ClusterDecoder& decoder, ClusterPoints& out) const;
  /// Calls visit(page, first, end) for each page of the index that has clusters in [first, end),
  /// with the range of those clusters in the page. Throws: Error.
  template <class Visit>
  void for_each_page(std::uint64_t first, std::uint64_t end, Visit&& visit) const {
    SequentialBytes ahead(*index_);
    const std::uint64_t page_clusters = layout_.page_clusters();
    while (first < end) {
      const std::uint64_t number = first / page_clusters;
      const std::uint64_t page_end = std::min(end, (number + 1) * page_clusters);
      visit(*read_page(number, &ahead), first, page_end);
      first = page_end;
    }
  }

  /// Returns an Error about a cluster.
  [[nodiscard]] Error damaged(std::uint64_t ordinal, const std::string& cause) const;

 private:
  /// Returns the result of read(); turns damage in the directory into an Error.
  template <class Read>
  auto from_directory(Read&& read) const;
  [[nodiscard]] std::shared_ptr<const IndexPage> read_page(std::uint64_t number,
                                                           SequentialBytes* ahead = nullptr) const;
  [[nodiscard]] std::shared_ptr<const DecodingTables> tables(std::uint64_t ordinal) const;
  void check_entry(const Entry& entry) const;
  void check_range(std::uint64_t ordinal, std::uint64_t offset, std::uint64_t size) const;
  /// Decodes a cluster. bytes: the cluster's, padded. Throws: Error.
  void decode(std::uint64_t ordinal, const Entry& entry, std::uint64_t offset, ByteView bytes,
              ClusterDecoder& decoder, ClusterPoints& out) const;
  void check_points(const Entry& entry, const ClusterPoints& points) const;
  /// Moves a box by the segment's shift.
  [[nodiscard]] Box3 in_store(Box3 box) const {
    if (!is_shifted_) return box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] += shift_[axis];
      box.max[axis] += shift_[axis];
    }
    return box;
  }
  void move_into_store(ClusterPoints& points) const;

  Layout layout_;
  std::uint64_t clusters_, first_;
  std::uint64_t max_points_;  ///< maximum number of points of a cluster
  bool top_;
  std::uint64_t store_points_;
  Box3 bounds_;   ///< of the segment, before its shift
  Point3 shift_;  ///< from the segment's coordinates to the store's
  bool is_shifted_, is_based_ = false;
  std::vector<std::uint64_t> base_;            ///< see SegmentEntry
  std::vector<std::uint64_t> clusters_below_;  ///< number of clusters of each level below
  std::unique_ptr<ByteSource> data_, index_;
  std::unique_ptr<const Directory> directory_;
  mutable SlotCache<IndexPage> page_cache_;
  mutable SlotCache<RangeColumns> range_cache_;
  mutable SlotCache<DecodingTables> tables_cache_;
};

}  // namespace terrace::stream::store
