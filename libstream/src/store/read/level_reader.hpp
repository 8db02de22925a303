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

/// A cache of `Value`s by number, any thread. A slot holds one value; what falls on it takes its
/// place. Values stay alive for those who have them.
template <class Value>
class SlotCache {
 public:
  explicit SlotCache(std::size_t slots) : slots_(slots) {}

  /// The value of `key`, made by `make` if it is not there.
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

/// Parts of a file that mostly follow one another, read many at a time.
class SequentialBytes {
 public:
  explicit SequentialBytes(const ByteSource& file) : file_(file) {}

  /// The bytes, with kPadding readable ones before and behind, until the next call. Requires that
  /// they exist.
  ByteView at(std::uint64_t offset, std::size_t size) {
    if (bytes_.empty() || offset < begin_ || offset + size > begin_ + size_) {
      const std::uint64_t left = file_.size() - offset;
      size_ = std::max(size, static_cast<std::size_t>(std::min<std::uint64_t>(left, kAtOnce)));
      begin_ = offset;
      bytes_.resize(size_ + 2 * kPadding);
      file_.read(offset, std::as_writable_bytes(std::span(bytes_).subspan(kPadding, size_)));
    }
    return ByteView(bytes_).subspan(kPadding + static_cast<std::size_t>(offset - begin_), size);
  }

 private:
  static constexpr std::uint64_t kAtOnce = std::uint64_t{32} << 10;

  const ByteSource& file_;
  Bytes bytes_;
  std::uint64_t begin_ = 0;
  std::size_t size_ = 0;
};

/// What one thread needs to read clusters.
struct ReadSpace {
  ClusterDecoder decoder;
  Bytes bytes;
};

/// The two files of a level, open for reading. Any thread.
class LevelReader {
 public:
  /// Reads directory and tables. Throws: Error.
  LevelReader(const OpenByName& files, const Manifest& manifest, unsigned level);

  [[nodiscard]] const Layout& layout() const { return layout_; }
  [[nodiscard]] std::uint64_t clusters() const { return clusters_; }
  [[nodiscard]] bool top() const { return top_; }
  [[nodiscard]] const ByteSource& data() const { return *data_; }
  [[nodiscard]] const ByteSource& index() const { return *index_; }
  [[nodiscard]] std::uint64_t pages() const { return directory_->pages(); }
  /// Where a page begins. Throws: Error.
  [[nodiscard]] std::uint64_t page_offset(std::uint64_t page) const;

  /// A box around all points of the cluster and below it, and those of its neighbours in the index:
  /// without reading there, or as the index's contents tell. Requires that the cluster exists.
  [[nodiscard]] Box3 coarse_box(std::uint64_t ordinal) const {
    return directory_->coarse_box(ordinal / layout_.page_clusters());
  }
  /// Throws: Error.
  [[nodiscard]] Box3 page_box(std::uint64_t ordinal) const;
  /// Throws: Error.
  [[nodiscard]] std::shared_ptr<const IndexPage> page(std::uint64_t number) const;
  /// The entry and where its bytes begin. Throws: Error.
  [[nodiscard]] Entry entry(std::uint64_t ordinal, std::uint64_t& offset) const;
  /// The entry of the i-th cluster of `page`, checked against the manifest. Throws: Damage.
  [[nodiscard]] Entry entry(const IndexPage& page, std::uint32_t i) const;
  /// The ranges of a cluster that exists. Throws: Error.
  void ranges(std::uint64_t ordinal, std::vector<KeyRange>& out) const;
  /// Throws: Error.
  void read(std::uint64_t ordinal, ReadSpace& space, ClusterPoints& out) const;
  /// `bytes`: of the cluster, padded. Its points lie in the entry's box and in the bounds of the
  /// store, and what they head exists. Throws: Error.
  void decode(std::uint64_t ordinal, const Entry& entry, std::uint64_t offset, ByteView bytes,
              ClusterDecoder& decoder, ClusterPoints& out) const;
  /// Calls visit(ordinal, IndexPage, number in the page, its bytes, padded) for each cluster.
  /// Throws: Error.
  template <class Visit>
  void for_each_cluster(Visit&& visit) const {
    SequentialBytes pages_ahead(*index_), clusters_ahead(*data_);
    for (std::uint64_t number = 0; number < pages(); ++number) {
      const auto page = read_page(number, &pages_ahead);
      for (std::uint32_t i = 0; i < page->clusters(); ++i) {
        const std::uint64_t ordinal = number * layout_.page_clusters() + i;
        const std::uint64_t begin = page->offset(i), size = page->end(i) - begin;
        check_range(ordinal, begin, size);
        visit(ordinal, *page, i, clusters_ahead.at(begin, memory_size(size)));
      }
    }
  }

  /// An Error about a cluster of this level.
  [[nodiscard]] Error damaged(std::uint64_t ordinal, const std::string& cause) const;

 private:
  /// What `read` returns, damage in the directory made an Error.
  template <class Read>
  auto from_directory(Read&& read) const;
  [[nodiscard]] std::shared_ptr<const IndexPage> read_page(std::uint64_t number,
                                                           SequentialBytes* ahead = nullptr) const;
  [[nodiscard]] std::shared_ptr<const DecodingTables> tables(std::uint64_t ordinal) const;
  void check_range(std::uint64_t ordinal, std::uint64_t offset, std::uint64_t size) const;
  void check_points(const Entry& entry, const ClusterPoints& points) const;

  Layout layout_;
  std::uint64_t clusters_;
  std::uint64_t most_points_;  ///< of a cluster
  bool top_;
  std::uint64_t store_points_;
  Box3 bounds_;                                ///< of the store
  std::vector<std::uint64_t> clusters_below_;  ///< of each level below
  std::unique_ptr<ByteSource> data_, index_;
  std::unique_ptr<const Directory> directory_;
  mutable SlotCache<IndexPage> page_cache_;
  mutable SlotCache<RangeColumns> range_cache_;
  mutable SlotCache<DecodingTables> tables_cache_;
};

}  // namespace terrace::stream::store
