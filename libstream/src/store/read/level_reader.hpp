// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "store/manifest.hpp"
#include "store/read/cluster_decoder.hpp"
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
  [[nodiscard]] std::uint64_t pages() const { return pages_; }
  [[nodiscard]] std::uint64_t page_offset(std::uint64_t page) const {
    return directory_[static_cast<std::size_t>(page)];
  }

  /// The box of the page that has the cluster, or a larger one. Requires that the cluster exists.
  [[nodiscard]] Box3 coarse_box(std::uint64_t ordinal) const {
    const std::uint64_t page = ordinal / layout_.page_clusters();
    return page < boxes_.size() ? boxes_[static_cast<std::size_t>(page)] : bounds_;
  }
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
  /// Calls visit(first ordinal, IndexPage, bytes of its clusters, padded). Throws: Error.
  template <class Visit>
  void for_each_page(Visit&& visit) const {
    Bytes bytes;
    for (std::uint64_t number = 0; number < pages_; ++number) {
      const auto page = read_page(number);
      const std::uint64_t begin = page->offset(0);
      const std::uint64_t first = number * layout_.page_clusters();
      check_range(first, begin, page->end() - begin);
      const std::size_t size = memory_size(page->end() - begin);
      bytes.resize(size + 2 * kPadding);
      data_->read(begin, std::as_writable_bytes(std::span(bytes).subspan(kPadding, size)));
      visit(first, *page, ByteView(bytes));
    }
  }

  /// An Error about a cluster of this level.
  [[nodiscard]] Error damaged(std::uint64_t ordinal, const std::string& cause) const;

 private:
  struct TablesAt {
    std::uint64_t first = 0;  ///< ordinal of the first cluster that they are for
    std::size_t offset = 0, size = 0;
  };

  void read_directory(std::uint64_t bytes);
  [[nodiscard]] std::shared_ptr<const IndexPage> read_page(std::uint64_t number) const;
  [[nodiscard]] std::shared_ptr<const DecodingTables> tables(std::uint64_t ordinal) const;
  void check_range(std::uint64_t ordinal, std::uint64_t offset, std::uint64_t size) const;
  void check_points(const Entry& entry, const ClusterPoints& points) const;

  Layout layout_;
  std::uint64_t clusters_, pages_;
  std::uint64_t most_points_;  ///< of a cluster
  bool top_;
  std::uint64_t store_points_;
  Box3 bounds_;                                ///< of the store
  std::vector<std::uint64_t> clusters_below_;  ///< of each level below
  std::unique_ptr<ByteSource> data_, index_;
  Bytes tail_;
  std::vector<std::uint64_t> directory_;  ///< pages_ + 1 offsets in the index file
  std::vector<Box3> boxes_;               ///< of the pages, from version 4 on
  std::vector<TablesAt> tables_at_;
  mutable SlotCache<IndexPage> page_cache_;
  mutable SlotCache<DecodingTables> tables_cache_;
};

}  // namespace terrace::stream::store
