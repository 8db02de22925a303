// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "format/copc/hierarchy.hpp"
#include "fuzz_points.hpp"

/// Any input is read as an octree or refused. The input is 8 bytes with the header's number of
/// points, the info VLR, and then the file that contains its page.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  constexpr std::size_t kPointsBytes = 8, kInfoBytes = 160;
  if (size < kPointsBytes + kInfoBytes) return 0;
  std::uint64_t points = 0;
  std::copy_n(data, kPointsBytes, reinterpret_cast<std::uint8_t*>(&points));
  const std::string_view info(reinterpret_cast<const char*>(data) + kPointsBytes, kInfoBytes);
  const auto* const begin = reinterpret_cast<const std::byte*>(data) + kPointsBytes + kInfoBytes;
  std::vector<std::byte> bytes(begin, reinterpret_cast<const std::byte*>(data) + size);
  const std::uint64_t file_bytes = bytes.size();
  const auto file = bytes_in_memory("input", std::move(bytes));
  try {
    Octree octree = read_copc_hierarchy(*file, info, 0, points);
    std::uint64_t found = 0, coded = 0;
    for (const OctreeNode& node : octree.nodes) {
      found += node.points;
      coded += node.bytes;
      require(node.offset + node.bytes <= file_bytes, "nodes are in the file");
    }
    require(found == points, "nodes have the header's number of points");
    require(coded <= file_bytes, "nodes do not share bytes");
    const std::size_t nodes = octree.nodes.size();
    octree.keep({}, 0, {});
    require(octree.nodes.size() == nodes, "without a selection all nodes are kept");
    octree.keep(Box3{{-1, -1, -1}, {1, 1, 1}}, octree.spacing, {});
    require(octree.nodes.size() <= 1, "only the root is kept at its spacing");
  } catch (const Error&) {
    // The input is refused.
  }
  return 0;
}
