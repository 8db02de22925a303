// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/stream/store_query.hpp"

/// Counts the pieces in which parts of a store are read.

namespace terrace::stream::testing {

/// Returns random windows over all heights, whose sides are a share of the bounds' sides.
inline std::vector<Box3> windows(const Box3& bounds, double share, std::size_t count,
                                 std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Box3> boxes(count, bounds);
  for (Box3& box : boxes) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double size = share * (bounds.max[axis] - bounds.min[axis]);
      const double place = static_cast<double>(random() >> 11) * 0x1p-53;
      box.min[axis] += place * (bounds.max[axis] - bounds.min[axis] - size);
      box.max[axis] = box.min[axis] + size;
    }
  }
  return boxes;
}

struct Pieces {
  std::size_t clusters = 0, index = 0;
};

/// Returns the number of contiguous pieces of the cluster files and of the indices that are read,
/// summed over the windows.
inline Pieces pieces_read(const std::filesystem::path& path, std::span<const Box3> boxes) {
  std::map<std::string, std::map<std::uint64_t, std::uint64_t>> ends;  // by offset
  const OpenByName files = [&](const std::string& name) {
    const std::shared_ptr<ByteSource> file = open_file(path / name);
    return bytes_by_function(file->name(), file->size(),
                             [&ends, file, name](std::uint64_t at, std::span<std::byte> out) {
                               std::uint64_t& end = ends[name][at];
                               end = std::max(end, at + out.size());
                               file->read(at, out);
                             });
  };
  Pieces pieces;
  for (const Box3& box : boxes) {
    const Store store = Store::open(path.string(), files);
    ends.clear();
    static_cast<void>(StoreQuery(store).in_box(box));
    for (const auto& [name, parts] : ends) {
      std::size_t& count = name.ends_with(".index") ? pieces.index : pieces.clusters;
      std::uint64_t end = 0;
      for (const auto& [begin, after] : parts) {
        if (end == 0 || begin > end) ++count;
        end = std::max(end, after);
      }
    }
  }
  return pieces;
}

}  // namespace terrace::stream::testing
