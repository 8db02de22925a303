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

/// Whether the points of a source come as they are (`stream`), such that those of a block lie close
/// together (`spatial`), or the latter only if they do not already (`automatic`).
enum class Order : std::uint8_t { automatic, stream, spatial };

struct SpatialOrderOptions {
  Order order = Order::automatic;
  std::size_t block_points = 10000;  ///< most points per block that has been put in order
  /// Lengths on the ground of a unit of the three stored coordinates, in a box of these. Empty: all
  /// count alike.
  std::function<std::array<double, 3>(const Box3&)> unit_lengths{};
  std::filesystem::path folder{};  ///< of the temporary file; empty: $TMPDIR or /tmp
  std::stop_token stop{};          ///< ends next() with Stopped
  /// Called while points are set aside, with those read so far.
  std::function<void(const Progress&)> reading{};
};

/// A source whose points may come in another order than they are read.
class OrderedSource : public PointSource {
 public:
  struct Report {
    bool reordered = false;
    /// How much wider blocks in the order of the source are than those of a k-d tree over the same
    /// points, the mean over the axes; of the points that decided, 0 without any.
    double spread = 0;
    std::uint64_t temporary_bytes = 0;  ///< of disk, at most at one time
  };
  [[nodiscard]] virtual Report report() const = 0;
};

/// Puts the points of a source in order without ever holding more than a part of them.
///
/// The stream is judged by windows of 262,144 points, the first and, by every fourth of its points,
/// every fourth after it: blocks that are not compact are more than twice as wide as those of a k-d
/// tree over the window. If they are in the first window, all points are put in order; later, those
/// that follow. They go into 256 buckets, the leaves of a k-d tree over the window, in a temporary
/// file as large as their packed records; once all are there the buckets come back one after
/// another, each cut by a k-d tree into blocks. A bucket of more than 262,144 points is first
/// divided in turn, which takes no more disk as what has been read is written over. Cells of a
/// raster stay as they are.
///
/// The order depends on nothing but the points, their order and the options. Memory, which
/// reading_bytes() states with the source's: 262,144 points, of the window or of what comes next,
/// with 40 bytes more each, and 8 MiB for the buckets. Cost: O(n log n); points are written and
/// read once, twice beyond some 60 million. Throws in next(): Error (of the source, or of the
/// temporary file: a full disk); Stopped.
[[nodiscard]] std::unique_ptr<OrderedSource> in_spatial_order(std::unique_ptr<PointSource> source,
                                                              SpatialOrderOptions options);

}  // namespace terrace::stream
