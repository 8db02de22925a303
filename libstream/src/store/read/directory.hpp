// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <vector>

#include "store/codec/layout.hpp"
#include "terrace/stream/byte_source.hpp"

namespace terrace::stream::store {

/// A box inside another, with its ends in steps of 1/kMax of the outer box. A default object is
/// empty.
template <class Number>
struct QuantisedBox {
  static constexpr Number kMax = std::numeric_limits<Number>::max();

  std::array<Number, 3> low{kMax, kMax, kMax}, high{};

  [[nodiscard]] Box3 in(const Box3& outer) const {
    Box3 box;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] = interpolate(outer.min[axis], outer.max[axis], low[axis]);
      box.max[axis] = interpolate(outer.min[axis], outer.max[axis], high[axis]);
    }
    return box;
  }
  /// Returns the smallest quantised box that contains the intersection of `box` and `outer`.
  static QuantisedBox around(const Box3& box, const Box3& outer) {
    QuantisedBox quantised;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double low = outer.min[axis], high = outer.max[axis];
      const auto quantise = [&](double value) {
        // Halves, so that no difference overflows.
        const double share = (0.5 * value - 0.5 * low) / (0.5 * high - 0.5 * low) * kMax;
        return static_cast<Number>(share > 0 ? std::min<double>(share, kMax) : 0);
      };
      // Rounding may have moved an end inside.
      Number& first = quantised.low[axis];
      first = quantise(box.min[axis]);
      while (first > 0 && !(interpolate(low, high, first) <= box.min[axis])) --first;
      Number& last = quantised.high[axis];
      last = quantise(box.max[axis]);
      while (last < kMax && !(interpolate(low, high, last) >= box.max[axis])) ++last;
    }
    return quantised;
  }

 private:
  /// Interpolates; exact at both ends.
  static double interpolate(double low, double high, Number step) {
    const double share = step / static_cast<double>(kMax);
    return low * (1 - share) + high * share;
  }
};

/// Pages of the index in a chapter; the last one may have fewer.
inline constexpr std::uint64_t kChapterPages = 64;
/// A box in the bounds of the store.
using ChapterBox = QuantisedBox<std::uint16_t>;
/// A box in its chapter's box.
using PageBox = QuantisedBox<std::uint8_t>;

/// The positions of the parts of a level's index: pages, the contents of each chapter, sets of
/// tables. The contents of chapters are read when needed, unless all of them together are small.
/// Thread-safe.
class Directory {
 public:
  struct TablesPosition {
    std::uint64_t first = 0;  ///< ordinal of the first cluster that uses them
    std::uint64_t offset = 0;
    std::size_t size = 0;  ///< without the checksum
  };

  /// bytes: the directory's, at the end of `index`, which must outlive this. Throws: Damage, Error.
  Directory(const ByteSource& index, std::uint64_t bytes, std::uint64_t clusters,
            const Layout& layout, const Box3& bounds);
  ~Directory();
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;

  [[nodiscard]] std::uint64_t pages() const { return pages_; }
  [[nodiscard]] std::uint64_t chapters() const { return chapters_.size(); }
  struct Range {
    std::uint64_t begin = 0, end = 0;
  };
  /// Returns the position of a page in the index. Throws: Damage, Error.
  [[nodiscard]] Range page_range(std::uint64_t page) const;
  /// Returns a box around all points of the page's clusters and below them. Throws: Damage, Error.
  [[nodiscard]] Box3 page_box(std::uint64_t page) const;
  /// Like page_box(), but without reading: the chapter's box until the chapter's contents have been
  /// read.
  [[nodiscard]] Box3 coarse_box(std::uint64_t page) const;
  /// Returns what page_range() and page_box() read for a page; of no bytes if they do not read.
  [[nodiscard]] BytePart contents_part(std::uint64_t page) const;
  /// Returns the sets of tables, in the order of clusters.
  [[nodiscard]] const std::vector<TablesPosition>& tables() const { return tables_; }
  /// Returns the bytes of a set. Throws: Damage, Error.
  [[nodiscard]] Bytes read_tables(const TablesPosition& at) const;

 private:
  struct Contents {
    std::vector<std::uint64_t> offsets;  ///< offsets of the pages, and of the end of the last
    std::vector<PageBox> boxes;
  };
  struct Chapter {
    std::uint64_t pages_at = 0, pages_end = 0;  ///< in the index
    std::uint64_t contents_at = 0;
    std::size_t contents_bytes = 0;
    Box3 box;
  };

  void read_chapters(ByteReader& in, std::uint64_t start);
  void read_sets(ByteReader& in, std::uint64_t at);
  [[nodiscard]] Bytes read(std::uint64_t offset, std::uint64_t size) const;
  [[nodiscard]] const Contents& contents(std::uint64_t chapter) const;

  const ByteSource& index_;
  std::uint64_t clusters_, pages_;
  std::size_t attributes_;
  Box3 bounds_;
  Bytes cache_;  ///< the part of the file from cache_offset_ on that was read with the directory
  std::uint64_t cache_offset_ = 0;
  std::vector<Chapter> chapters_;
  std::vector<TablesPosition> tables_;
  mutable std::vector<std::atomic<const Contents*>> contents_;
  mutable std::mutex mutex_;
};

}  // namespace terrace::stream::store
