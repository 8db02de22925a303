// SPDX-License-Identifier: Apache-2.0
#include "format/octree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include <fmt/core.h>

#include "format/packed_column.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Data that the readers of all threads share for their checks.
struct CubeCheck {
  RecordParts parts;
  std::vector<OctreeNode> nodes;
  std::vector<Box3> boxes;  ///< in which the nodes' points must be, in the CRS
  Placement placement;
  std::array<ScalarType, 3> types{};
  std::array<std::size_t, 3> offsets{};
  std::string file;
};

/// Checks that the points of each node are in its cube.
class CubeCheckingReader final : public PartReader {
 public:
  explicit CubeCheckingReader(std::shared_ptr<const CubeCheck> check)
      : check_(std::move(check)), reader_(check_->parts.make_reader()) {}

  void start(std::size_t part) override {
    part_ = part;
    reader_->start(part);
  }

  std::size_t read(std::span<std::byte> room) override {
    const std::size_t bytes = reader_->read(room);
    const std::size_t stride = check_->parts.record_bytes;
    points_.resize(bytes / stride);
    PackedColumn column{.rows = nullptr,
                        .stride = stride,
                        .count = points_.size(),
                        .type = ScalarType::i32,
                        .swap = std::endian::native == std::endian::big};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      column.rows = reinterpret_cast<const char*>(room.data()) + check_->offsets[axis];
      column.type = check_->types[axis];
      decode_coordinate(column, points_.data(), axis);
    }
    const Box3& box = check_->boxes[part_];
    for (const Point3& point : points_) {
      if (!box.contains(world_point(check_->placement, point))) throw outside_cube();
    }
    return bytes;
  }

 private:
  [[nodiscard]] Error outside_cube() const {
    return Error(check_->file,
                 "has a point outside its cube: the header or the hierarchy is wrong, and a region "
                 "would miss points")
        .at("node " + key_of(check_->nodes[part_]))
        .remedy("convert the whole file to LAS or LAZ and select the region from that");
  }

  std::shared_ptr<const CubeCheck> check_;
  std::unique_ptr<PartReader> reader_;
  std::size_t part_ = 0;
  std::vector<Point3> points_;
};

}  // namespace

std::string key_of(const OctreeNode& node) {
  return fmt::format("{}-{}-{}-{}", node.depth, node.position[0], node.position[1],
                     node.position[2]);
}

bool precedes(const OctreeNode& a, const OctreeNode& b) {
  // The axis whose positions differ in the highest bit decides; in a tie z, then y.
  std::uint32_t highest_difference = 0;
  bool less = false;
  for (const std::size_t axis : {std::size_t{2}, std::size_t{1}, std::size_t{0}}) {
    const std::uint32_t p = a.position[axis] << (kMaxDepth - a.depth);
    const std::uint32_t q = b.position[axis] << (kMaxDepth - b.depth);
    const std::uint32_t difference = p ^ q;
    // True if difference's highest bit is above that of highest_difference (T. Chan's XOR test).
    if (highest_difference < difference && highest_difference < (difference ^ highest_difference)) {
      highest_difference = difference;
      less = p < q;
    }
  }
  return highest_difference == 0 ? a.depth < b.depth : less;
}

Box3 Octree::box(const OctreeNode& node) const {
  const double side = std::ldexp(2 * half_size, -static_cast<int>(node.depth));
  Box3 box;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    box.min[axis] = centre[axis] - half_size + side * node.position[axis];
    box.max[axis] = box.min[axis] + side;
  }
  return box;
}

std::uint64_t Octree::points() const {
  std::uint64_t points = 0;
  for (const OctreeNode& node : nodes) points += node.points;
  return points;
}

OctreeInfo Octree::info() const {
  OctreeInfo info{.spacing = spacing, .nodes = nodes.size()};
  for (const OctreeNode& node : nodes) info.depths = std::max(info.depths, node.depth + 1);
  return info;
}

const OctreeNode* Octree::arrange() {
  std::sort(nodes.begin(), nodes.end(), precedes);
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    if (!precedes(nodes[i - 1], nodes[i])) return &nodes[i];
  }
  return nullptr;
}

void Octree::keep(const std::optional<Box3>& region, double resolution, const Point3& steps) {
  unsigned deepest = kMaxDepth;
  if (resolution > 0) {
    deepest = 0;
    while (deepest < kMaxDepth && std::ldexp(spacing, -static_cast<int>(deepest)) > resolution) {
      ++deepest;
    }
  }
  std::erase_if(nodes, [&](const OctreeNode& node) {
    if (node.depth > deepest) return true;
    // The first node is kept for any region, see the header.
    if (!region || &node == nodes.data()) return false;
    const Box3 cube = box(node);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (cube.min[axis] - 2 * steps[axis] > region->max[axis] ||
          cube.max[axis] + 2 * steps[axis] < region->min[axis]) {
        return true;
      }
    }
    return false;
  });
}

Point3 steps_of(const Placement& placement) {
  return {std::abs(placement.world.xy[0]), std::abs(placement.world.xy[4]),
          std::abs(placement.coordinates[2].scale)};
}

RecordParts parts_in_cubes(RecordParts parts, const Octree& octree, const RecordStream& stream,
                           const std::string& file) {
  auto check = std::make_shared<CubeCheck>();
  check->nodes = octree.nodes;
  check->placement = stream.info;
  check->offsets = stream.coordinate_offsets;
  check->file = file;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    check->types[axis] = stream.info.coordinates[axis].type;
  }
  // A smaller tolerance than that of keep(), so that a region misses no point that passes.
  const Point3 steps = steps_of(stream.info);
  for (const OctreeNode& node : octree.nodes) {
    Box3& box = check->boxes.emplace_back(octree.box(node));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box.min[axis] -= 1.5 * steps[axis];
      box.max[axis] += 1.5 * steps[axis];
    }
  }
  check->parts = std::move(parts);
  RecordParts checked{.record_bytes = check->parts.record_bytes, .parts = check->parts.parts};
  checked.make_reader = [check] { return std::make_unique<CubeCheckingReader>(check); };
  return checked;
}

}  // namespace terrace::stream
