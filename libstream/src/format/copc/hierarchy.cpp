// SPDX-License-Identifier: Apache-2.0
#include "format/copc/hierarchy.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <set>
#include <span>
#include <string>
#include <utility>

#include <fmt/core.h>

#include "io/bytes.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

Error damaged(const ByteSource& file, std::uint64_t byte, std::string cause) {
  return Error(file.name(), std::move(cause))
      .at_byte(byte)
      .remedy("the file is damaged: download it again");
}

/// A part of the hierarchy that is read in one piece.
struct Page {
  std::uint64_t offset = 0, bytes = 0;
};

/// Reads the pages of a hierarchy and checks that their nodes are inside the file.
class HierarchyReader {
 public:
  HierarchyReader(const ByteSource& file, std::uint64_t first_chunk)
      : file_(file), first_chunk_(first_chunk) {}

  std::vector<OctreeNode> read(const Page& root) {
    add_page(root, root.offset);
    while (!pages_.empty()) {
      const Page page = pages_.back();
      pages_.pop_back();
      std::string bytes(page.bytes, '\0');
      file_.read(page.offset, std::as_writable_bytes(std::span(bytes)));
      for (std::size_t at = 0; at < bytes.size(); at += kCopcEntryBytes) {
        read_entry(bytes.data() + at, page.offset + at);
      }
    }
    return std::move(nodes_);
  }

 private:
  /// reference_offset: of the entry that refers to the page. No page is read twice, so circular
  /// references end.
  void add_page(const Page& page, std::uint64_t reference_offset) {
    if (page.bytes % kCopcEntryBytes != 0 || page.bytes == 0 || page.offset > file_.size() ||
        page.bytes > file_.size() - page.offset) {
      throw damaged(file_, reference_offset, "a page of the COPC hierarchy is outside the file");
    }
    // Pages that overlap could be many more bytes than the file has.
    page_bytes_ += page.bytes;
    if (!page_offsets_.insert(page.offset).second || page_bytes_ > file_.size()) {
      throw damaged(file_, reference_offset, "a page of the COPC hierarchy is referred to twice");
    }
    pages_.push_back(page);
  }

  void read_entry(const char* at, std::uint64_t byte) {
    const auto depth = load_little_endian<std::int32_t>(at);
    OctreeNode node{.offset = load_little_endian<std::uint64_t>(at + 16)};
    const auto bytes = load_little_endian<std::int32_t>(at + 24);
    const auto points = load_little_endian<std::int32_t>(at + 28);
    if (depth < 0 || depth > static_cast<std::int32_t>(kMaxDepth)) {
      throw damaged(file_, byte, fmt::format("a node of the COPC hierarchy has depth {}", depth));
    }
    node.depth = static_cast<unsigned>(depth);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto position = load_little_endian<std::int32_t>(at + 4 + 4 * axis);
      if (position < 0 || (position >> depth) != 0) {
        throw damaged(file_, byte, "a node of the COPC hierarchy is outside its root");
      }
      node.position[axis] = static_cast<std::uint32_t>(position);
    }
    if (points < -1 || bytes < 0) {
      throw damaged(file_, byte, "a node of the COPC hierarchy has a negative size");
    }
    node.bytes = static_cast<std::uint64_t>(bytes);
    if (points == -1) {
      add_page({.offset = node.offset, .bytes = node.bytes}, byte);
      return;
    }
    if (points == 0) return;
    node.points = static_cast<std::uint64_t>(points);
    if (node.offset < first_chunk_ || node.offset > file_.size() ||
        node.bytes > file_.size() - node.offset || node.bytes == 0) {
      throw damaged(file_, byte, "the points of a node of the COPC hierarchy are outside the file");
    }
    nodes_.push_back(node);
  }

  const ByteSource& file_;
  std::uint64_t first_chunk_;
  std::vector<Page> pages_;
  std::set<std::uint64_t> page_offsets_;  ///< offsets of pages
  std::uint64_t page_bytes_ = 0;
  std::vector<OctreeNode> nodes_;
};

/// Throws: Error if two nodes share a key or a byte, which would deliver points twice.
void check_disjoint(const ByteSource& file, Octree& octree) {
  std::vector<OctreeNode>& nodes = octree.nodes;
  std::sort(nodes.begin(), nodes.end(),
            [](const OctreeNode& a, const OctreeNode& b) { return a.offset < b.offset; });
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    if (nodes[i].offset - nodes[i - 1].offset < nodes[i - 1].bytes) {
      throw damaged(file, nodes[i].offset, "two nodes of the COPC hierarchy share points");
    }
  }
  if (const OctreeNode* const duplicate = octree.arrange()) {
    throw damaged(file, duplicate->offset, "a node of the COPC hierarchy is listed twice");
  }
}

void append_entry(std::string& page, const OctreeNode& node, std::uint64_t offset,
                  std::uint64_t bytes, std::int64_t points) {
  append_little_endian(page, static_cast<std::int32_t>(node.depth));
  for (const std::uint32_t position : node.position) {
    append_little_endian(page, static_cast<std::int32_t>(position));
  }
  append_little_endian(page, offset);
  append_little_endian(page, static_cast<std::int32_t>(bytes));
  append_little_endian(page, static_cast<std::int32_t>(points));
}

void append_entry(std::string& page, const OctreeNode& node) {
  append_entry(page, node, node.offset, node.bytes, static_cast<std::int64_t>(node.points));
}

/// For each node, the end of the subtree that begins with it.
std::vector<std::size_t> subtree_ends(std::span<const OctreeNode> nodes) {
  std::vector<std::size_t> ends(nodes.size(), nodes.size()), open;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (; !open.empty() && nodes[open.back()].depth >= nodes[i].depth; open.pop_back()) {
      ends[open.back()] = i;
    }
    open.push_back(i);
  }
  return ends;
}

}  // namespace

CopcHierarchy write_copc_hierarchy(const Octree& octree, std::uint64_t at, std::size_t page_nodes) {
  const std::span<const OctreeNode> nodes = octree.nodes;
  const std::vector<std::size_t> ends = subtree_ends(nodes);
  // A smaller page is not worth a request.
  const std::size_t min_page_nodes =
      nodes.size() <= page_nodes ? nodes.size() + 1 : page_nodes / 16;
  const auto has_page = [&](std::size_t node) {
    const std::size_t count = ends[node] - node;
    return count >= min_page_nodes && count <= page_nodes;
  };
  CopcHierarchy hierarchy;
  for (std::size_t i = 0; i < nodes.size(); i = has_page(i) ? ends[i] : i + 1) {
    hierarchy.root_bytes += kCopcEntryBytes;
  }
  std::string pages;
  for (std::size_t i = 0; i < nodes.size();) {
    if (!has_page(i)) {
      append_entry(hierarchy.bytes, nodes[i++]);
      continue;
    }
    const std::uint64_t begin = pages.size();
    for (std::size_t j = i; j < ends[i]; ++j) append_entry(pages, nodes[j]);
    append_entry(hierarchy.bytes, nodes[i], at + hierarchy.root_bytes + begin, pages.size() - begin,
                 -1);
    i = ends[i];
  }
  hierarchy.bytes += pages;
  return hierarchy;
}

Octree read_copc_hierarchy(const ByteSource& file, std::string_view info, std::uint64_t first_chunk,
                           std::uint64_t points) {
  // The info follows the LAS 1.4 header and its own VLR header.
  constexpr std::uint64_t kInfoAt = 375 + 54;
  if (info.size() < kCopcInfoBytes) throw damaged(file, kInfoAt, "the COPC info is truncated");
  Octree octree;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    octree.centre[axis] = load_little_endian<double>(info.data() + 8 * axis);
  }
  octree.half_size = load_little_endian<double>(info.data() + 24);
  octree.spacing = load_little_endian<double>(info.data() + 32);
  const bool finite = std::all_of(octree.centre.begin(), octree.centre.end(),
                                  [](double value) { return std::isfinite(value); });
  if (!finite || !(octree.half_size > 0) || !std::isfinite(2 * octree.half_size) ||
      !(octree.spacing > 0) || !std::isfinite(octree.spacing)) {
    throw damaged(file, kInfoAt,
                  "the cube or the spacing of the COPC info is not a positive number");
  }
  const Page root{.offset = load_little_endian<std::uint64_t>(info.data() + 40),
                  .bytes = load_little_endian<std::uint64_t>(info.data() + 48)};
  // A file without points has an empty page.
  if (points > 0 || root.bytes > 0) octree.nodes = HierarchyReader(file, first_chunk).read(root);
  check_disjoint(file, octree);
  if (const std::uint64_t node_points = octree.points(); node_points != points) {
    throw damaged(file, root.offset,
                  fmt::format("the nodes of the COPC hierarchy have {}, but the header promises {}",
                              counted(node_points, "point"), points));
  }
  return octree;
}

}  // namespace terrace::stream
