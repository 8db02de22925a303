// SPDX-License-Identifier: Apache-2.0
#include "format/ept/hierarchy.hpp"

#include <array>
#include <charconv>
#include <cstddef>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "format/ept/metadata.hpp"
#include "io/text.hpp"
#include "terrace/stream/byte_source.hpp"

namespace terrace::stream {
namespace {

/// Parses "D-X-Y-Z"; nullopt unless it names a node of an octree.
std::optional<OctreeNode> node_of(std::string_view name) {
  OctreeNode node;
  const auto read = [&](std::uint32_t& value) {
    const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), value);
    if (error != std::errc()) return false;
    name.remove_prefix(static_cast<std::size_t>(end - name.data()));
    return true;
  };
  std::uint32_t depth = 0;
  if (!read(depth) || depth > kDeepestNode) return {};
  node.depth = depth;
  for (std::uint32_t& place : node.place) {
    if (!name.starts_with('-')) return {};
    name.remove_prefix(1);
    if (!read(place) || (place >> depth) != 0) return {};
  }
  if (!name.empty()) return {};
  return node;
}

/// Depth and place. A file of the hierarchy is named after its topmost node.
using NodeKey = std::array<std::uint32_t, 4>;

NodeKey key_of(const OctreeNode& node) {
  return {node.depth, node.place[0], node.place[1], node.place[2]};
}

/// The part of the hierarchy read so far.
struct EptReading {
  std::uint64_t points = 0;  ///< promised
  std::uint64_t found = 0;
  std::vector<OctreeNode> nodes{};
  std::vector<NodeKey> pending{};  ///< of files to be read
  std::set<NodeKey> seen{};        ///< of files
};

/// Takes the entries of one file as they are parsed: an object of names and numbers.
class EntryTaker final : public nlohmann::json_sax<nlohmann::json> {
 public:
  EntryTaker(const std::string& file, EptReading& reading) : file_(file), reading_(reading) {}

  bool key(string_t& name) override {
    name_ = name;
    return true;
  }
  bool number_unsigned(number_unsigned_t value) override {
    OctreeNode node = place();
    if (value == 0) return true;
    // Compared before adding, because the sum could overflow.
    if (value > reading_.points - reading_.found) {
      throw ept_fault(file_, fmt::format("the nodes have more points than ept.json promises: {}",
                                         reading_.points))
          .at("node " + name_);
    }
    node.points = value;
    reading_.found += value;
    reading_.nodes.push_back(node);
    return true;
  }
  bool number_integer(number_integer_t value) override {
    const NodeKey key = key_of(place());
    if (value != -1)
      throw ept_fault(file_, fmt::format("has {} points", value)).at("node " + name_);
    if (!reading_.seen.insert(key).second) {
      throw ept_fault(file_, "its part of the hierarchy is referred to twice").at("node " + name_);
    }
    reading_.pending.push_back(key);
    return true;
  }
  bool start_object(std::size_t) override { return depth_++ == 0 || refuse(); }
  bool end_object() override { return true; }
  bool null() override { return refuse(); }
  bool boolean(bool) override { return refuse(); }
  bool number_float(number_float_t, const string_t&) override { return refuse(); }
  bool string(string_t&) override { return refuse(); }
  bool binary(binary_t&) override { return refuse(); }
  bool start_array(std::size_t) override { return refuse(); }
  bool end_array() override { return refuse(); }
  bool parse_error(std::size_t byte, const std::string&,
                   const nlohmann::detail::exception&) override {
    throw ept_fault(file_, "it is not JSON").at_byte(byte);
  }

 private:
  [[noreturn]] bool refuse() const {
    throw ept_fault(file_, "it does not hold the point counts of nodes")
        .at(name_.empty() ? std::string() : "node " + in_quotes(name_));
  }
  [[nodiscard]] OctreeNode place() const {
    if (depth_ == 0) refuse();
    const std::optional<OctreeNode> node = node_of(name_);
    if (!node) throw ept_fault(file_, in_quotes(name_) + " is not a node of an octree");
    return *node;
  }

  const std::string& file_;
  EptReading& reading_;
  std::string name_;
  int depth_ = 0;
};

}  // namespace

std::vector<OctreeNode> read_ept_hierarchy(const std::filesystem::path& folder,
                                           std::uint64_t points) {
  const NodeKey root = key_of(OctreeNode{});
  /// Enough for some 800,000 nodes; Entwine begins another file after a few depths.
  constexpr std::uint64_t kMostBytes = 16u << 20;
  EptReading reading{.points = points};
  reading.seen.insert(root);
  reading.pending.push_back(root);
  while (!reading.pending.empty()) {
    const auto [depth, x, y, z] = reading.pending.back();
    reading.pending.pop_back();
    const std::string name = name_of({.depth = depth, .place = {x, y, z}});
    const std::string file = (folder / "ept-hierarchy" / (name + ".json")).string();
    if (open_file(file)->size() > kMostBytes) throw ept_fault(file, "is too large for a hierarchy");
    std::ifstream bytes(file, std::ios::binary);
    EntryTaker taker(file, reading);
    nlohmann::json::sax_parse(bytes, &taker);
  }
  if (reading.found != points) {
    throw ept_fault((folder / "ept-hierarchy").string(),
                    fmt::format("its nodes have {}, but ept.json promises {}",
                                counted(reading.found, "point"), points));
  }
  return std::move(reading.nodes);
}

}  // namespace terrace::stream
