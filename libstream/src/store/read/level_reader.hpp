// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "store/manifest.hpp"
#include "store/read/segment_reader.hpp"
#include "terrace/stream/byte_source.hpp"

namespace terrace::stream::store {

/// The segments of a level. The only segment of a level is open from the beginning. One of several
/// is opened when it is first needed, and closed when many others have been used since, so that any
/// number needs few files. Thread-safe.
class LevelReader {
 public:
  /// files: kept if there are several segments. manifest: must outlive the reader. Throws: Error.
  LevelReader(const OpenByName& files, const Manifest& manifest, unsigned level);

  [[nodiscard]] const Layout& layout() const { return layout_; }
  [[nodiscard]] std::uint64_t clusters() const { return firsts_.back(); }
  [[nodiscard]] std::size_t segments() const { return firsts_.size() - 1; }

  /// A segment, open as long as this object exists.
  class Handle {
   public:
    explicit Handle(const SegmentReader& open) : reader_(&open) {}
    explicit Handle(std::shared_ptr<const SegmentReader> kept)
        : kept_(std::move(kept)), reader_(kept_.get()) {}
    const SegmentReader* operator->() const { return reader_; }
    const SegmentReader& operator*() const { return *reader_; }

   private:
    std::shared_ptr<const SegmentReader> kept_;  ///< null for the only segment
    const SegmentReader* reader_;
  };
  /// Throws: Error if it cannot be opened.
  [[nodiscard]] Handle segment(std::size_t number) const;

  /// A cluster: its segment, and its number there.
  struct Place {
    Handle segment;
    std::uint64_t ordinal = 0;
  };
  /// Throws: Error if there is no such cluster, or its segment cannot be opened.
  [[nodiscard]] Place find(std::uint64_t ordinal) const;

  /// Calls visit(segment, first, end) for each segment that has clusters in [first, end) of the
  /// level, with their range in the segment.
  template <class Visit>
  void for_each_segment(std::uint64_t first, std::uint64_t end, Visit&& visit) const {
    while (first < end) {
      const std::size_t number = segment_of(first);
      const std::uint64_t begin = firsts_[number];
      const std::uint64_t segment_end = std::min(end, firsts_[number + 1]);
      visit(*segment(number), first - begin, segment_end - begin);
      first = segment_end;
    }
  }

 private:
  [[nodiscard]] std::size_t segment_of(std::uint64_t ordinal) const {
    const auto after = std::upper_bound(firsts_.begin(), firsts_.end(), ordinal);
    return static_cast<std::size_t>(after - firsts_.begin()) - 1;
  }

  OpenByName files_;  ///< empty for a single segment
  const Manifest& manifest_;
  Layout layout_;
  /// The ordinal of each segment's first cluster, and the number of the level's clusters.
  std::vector<std::uint64_t> firsts_;
  std::unique_ptr<const SegmentReader> only_;
  mutable SlotCache<SegmentReader> open_;  ///< one of several
};

}  // namespace terrace::stream::store
