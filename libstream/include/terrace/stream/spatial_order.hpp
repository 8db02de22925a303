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
/// block are close together (`spatial`), or are reordered only if they are not close already
/// (`automatic`).
enum class Order : std::uint8_t { automatic, stream, spatial };

struct SpatialOrderOptions {
  Order order = Order::automatic;
  std::size_t block_points = 10000;  ///< maximum points per block after reordering
  /// Lengths on the ground of one unit of each of the three stored coordinates, within this box.
  /// Empty: all are equal.
  std::function<std::array<double, 3>(const Box3&)> unit_lengths{};
  std::filesystem::path folder{};  ///< folder of the temporary file; empty: $TMPDIR or /tmp
  unsigned threads = 1;            ///< that sort points; they do not change the order
  /// Parts of 262,144 points that are prepared while the one before is delivered, each by a thread
  /// of its own. They do not change the order either.
  unsigned parts_ahead = 0;
  std::stop_token stop{};  ///< ends next() with Stopped
  /// Called while points are set aside, with the number read so far.
  std::function<void(const Progress&)> reading{};
};

/// A source that may deliver points in a different order from that of reading.
class OrderedSource : public PointSource {
 public:
  struct Report {
    bool reordered = false;
    /// How much wider blocks in the order of the source are than those of a k-d tree over the same
    /// points, averaged over the axes; for the points that decided, 0 if there were none.
    double spread = 0;
    std::uint64_t written_twice = 0;  ///< points of buckets that had to be divided
    /// Maximum disk space used at one time; with several threads it may vary by some chunks.
    std::uint64_t temporary_bytes = 0;
  };
  [[nodiscard]] virtual Report report() const = 0;
};

/// Puts the points of a source in order without ever holding more than a part of them.
///
/// The stream is judged by windows of 262,144 points, the first and, by every fourth of its points,
/// every fourth after it: blocks that are not compact are more than twice as wide as those of a k-d
/// tree over the window. If they are in the first window, all points are put in order; later, those
/// that follow. They go into 256 buckets, the leaves of a k-d tree over the window (and over the
/// box that the source states, of which the first window is often but a corner), in a temporary
/// file; once all are there the buckets come back one after another, each cut by a k-d tree into
/// blocks. A bucket of more than 262,144 points is first divided in turn, which takes no more disk
/// as what has been read is written over. The file holds chunks of 32 KiB of packed records, less
/// the bytes that are the same in a whole chunk. Cells of a raster stay as they are.
///
/// The order depends on nothing but the points, their order, the stated box and the options.
/// Memory, which reading_bytes() states with the source's: 262,144 points, of the window or of what
/// comes next, with at most 32 bytes more each, a quarter as many on their way to the buckets or as
/// many for each part ahead, and 8 MiB for the buckets. Cost: O(n log n); points are written and
/// read once, twice beyond some 60 million. Throws in next(): Error (of the source, or of the
/// temporary file: a full disk); Stopped.
[[nodiscard]] std::unique_ptr<OrderedSource> in_spatial_order(std::unique_ptr<PointSource> source,
                                                              SpatialOrderOptions options);

}  // namespace terrace::stream
