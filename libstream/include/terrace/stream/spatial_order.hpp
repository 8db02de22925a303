// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stop_token>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Whether the points of a source keep their order (`stream`), are reordered so that those of a
/// block are close together (`spatial`), or are reordered only if they are not close together
/// already (`automatic`).
enum class Order : std::uint8_t { automatic, stream, spatial };

/// Options of in_spatial_order().
struct SpatialOrderOptions {
  Order order = Order::automatic;
  std::size_t block_points = 10000;  ///< maximum points per block after reordering
  /// Returns the lengths on the ground of one unit of each of the three stored coordinates, within
  /// a box. Empty: all lengths are equal.
  std::function<std::array<double, 3>(const Box3&)> unit_lengths{};
  std::filesystem::path folder{};  ///< folder of the temporary file; empty: $TMPDIR or /tmp
  unsigned threads = 1;            ///< sorting threads; they do not change the order
  /// Number of parts of 262,144 points that are prepared in advance, each by a separate thread. It
  /// does not change the order.
  unsigned parts_ahead = 0;
  std::stop_token stop{};  ///< makes next() throw Stopped
  /// Called with the progress of the source while its points go to the temporary file.
  std::function<void(const Progress&)> reading{};
};

/// A source that may deliver points in another order than they are read in.
class OrderedSource : public PointSource {
 public:
  struct Report {
    bool reordered = false;
    /// Ratio of the widths, summed over the axes, of blocks in the order of the source and of
    /// blocks from a k-d tree over the same points. The maximum over the windows that were judged;
    /// 0 if none was.
    double spread = 0;
    std::uint64_t written_twice = 0;  ///< number of points in buckets that had to be divided
    /// Maximum size of the temporary file in bytes; with several threads it may vary by some
    /// chunks.
    std::uint64_t temporary_bytes = 0;
  };
  [[nodiscard]] virtual Report report() const = 0;
};

/// Puts the points of a source in order, holding only a part of them in memory.
///
/// The first window of 262,144 points of the stream and every fourth after it are judged, by every
/// fourth of their points. A window is not in order if its blocks are more than twice as wide as
/// those of a k-d tree over it. If the first window is not in order, all points are reordered; if a
/// later one is not, the points after it. They go into 256 buckets in a temporary file, the leaves
/// of a k-d tree over the window and the box that the source states, of which the first window is
/// often only a corner. At the end of the stream, the buckets are read back one after another, and
/// each is cut into blocks by a k-d tree. A bucket of more than 262,144 points is divided first,
/// which takes no more disk space because parts of the file that have been read are reused. The
/// file holds chunks of 32 KiB of packed records, without the bytes that are the same in a whole
/// chunk. Cells of a raster keep their order.
///
/// The result depends only on the points, their order, the stated box and the options. Memory,
/// which reading_bytes() includes: 262,144 points of the window or the next part, with at most 32
/// additional bytes each. A quarter as many are on their way to the buckets, or 262,144 for each
/// part ahead. The buckets take 8 MiB. Cost: O(n log n); points are written and read once, beyond
/// some 60 million twice. next() throws Error (of the source, or of the temporary file, for example
/// if the disk is full) and Stopped.
[[nodiscard]] std::unique_ptr<OrderedSource> in_spatial_order(std::unique_ptr<PointSource> source,
                                                              SpatialOrderOptions options);

}  // namespace terrace::stream
