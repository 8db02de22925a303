// SPDX-License-Identifier: Apache-2.0
#include "format/ept/metadata.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "io/bounded_json.hpp"
#include "io/text.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// A dimension of EPT and the name of the attribute that LAS has for it.
struct KnownDimension {
  std::string_view ept, name;
};
// PDAL's names, which Entwine uses too, and laspy's names, which we use for LAS.
constexpr std::array<KnownDimension, 19> kKnown{{{"Intensity", "intensity"},
                                                 {"ReturnNumber", "return_number"},
                                                 {"NumberOfReturns", "number_of_returns"},
                                                 {"ScanDirectionFlag", "scan_direction_flag"},
                                                 {"EdgeOfFlightLine", "edge_of_flight_line"},
                                                 {"Classification", "classification"},
                                                 {"Synthetic", "synthetic"},
                                                 {"KeyPoint", "key_point"},
                                                 {"Withheld", "withheld"},
                                                 {"Overlap", "overlap"},
                                                 {"ScanChannel", "scanner_channel"},
                                                 {"ScanAngleRank", "scan_angle_rank"},
                                                 {"UserData", "user_data"},
                                                 {"PointSourceId", "point_source_id"},
                                                 {"GpsTime", "gps_time"},
                                                 {"Red", "red"},
                                                 {"Green", "green"},
                                                 {"Blue", "blue"},
                                                 {"Infrared", "nir"}}};

/// A dimension of the schema.
struct Dimension {
  std::string name;
  Channel channel;
};

/// Reads the members of ept.json, and throws errors that name them.
class EptMetadataReader {
 public:
  explicit EptMetadataReader(const std::string& file) : file_(file) {}

  EptMetadata read() {
    const nlohmann::json json = parse();
    if (!json.is_object()) throw fault("it does not hold an object");
    const std::string version = text(json, "version", "1.0.0");
    if (!version.starts_with("1."))
      throw fault("is " + in_quotes(version) + ", not 1").at("version");
    const std::string hierarchy = text(json, "hierarchyType", "json");
    if (hierarchy != "json")
      throw fault(in_quotes(hierarchy) + " is not known").at("hierarchyType");
    EptMetadata metadata;
    const std::string data = text(json, "dataType", {});
    if (data == "laszip") {
      metadata.data = EptData::laszip;
    } else if (data == "binary") {
      metadata.data = EptData::binary;
    } else if (data == "zstandard") {
      metadata.data = EptData::zstandard;
    } else {
      throw fault(in_quotes(data) + " is not known; laszip, binary and zstandard are")
          .at("dataType");
    }
    const nlohmann::json& points = member(json, "points");
    if (!points.is_number_unsigned()) throw fault("is not a number of points").at("points");
    metadata.points = metadata.stream.points = points.get<std::uint64_t>();
    read_cube(json, metadata.octree);
    read_schema(member(json, "schema"), metadata.stream);
    if (const auto srs = json.find("srs"); srs != json.end()) read_srs(*srs, metadata.crs);
    return metadata;
  }

 private:
  using Json = nlohmann::json;

  /// A schema takes about a hundred bytes per dimension, WKT a few kilobytes.
  static constexpr std::uint64_t kMaxBytes = 8u << 20;
  static constexpr std::size_t kMaxRecordBytes = 65535;
  static constexpr std::size_t kMaxDimensions = 4096;

  [[nodiscard]] Error fault(std::string cause) const { return ept_fault(file_, std::move(cause)); }

  [[nodiscard]] Json parse() const {
    const std::unique_ptr<ByteSource> bytes = open_file(file_);
    if (bytes->size() > kMaxBytes) throw fault("is too large for the description of a data set");
    std::string text(bytes->size(), '\0');
    bytes->read(0, std::as_writable_bytes(std::span(text)));
    try {
      return parse_bounded_json(text, {}, [this](const char* cause) { throw fault(cause); });
    } catch (const Json::parse_error& error) {
      throw fault("it is not JSON").at_byte(error.byte);
    } catch (const Json::out_of_range&) {
      throw fault("its JSON has a number too large for a double");
    }
  }

  [[nodiscard]] const Json& member(const Json& json, const char* name) const {
    const auto entry = json.find(name);
    if (entry == json.end()) throw fault("is missing").at(name);
    return *entry;
  }

  [[nodiscard]] std::string text(const Json& json, const char* name,
                                 const std::optional<std::string>& fallback) const {
    if (fallback && !json.contains(name)) return *fallback;
    const Json& value = member(json, name);
    if (!value.is_string()) throw fault("is not text").at(name);
    return value.get<std::string>();
  }

  [[nodiscard]] double number(const Json& json, const char* name, double fallback) const {
    const auto entry = json.find(name);
    if (entry == json.end()) return fallback;
    if (!entry->is_number() || !std::isfinite(entry->get<double>()))
      throw fault("is not a number").at(name);
    return entry->get<double>();
  }

  void read_cube(const Json& json, Octree& octree) const {
    const Json& bounds = member(json, "bounds");
    if (!bounds.is_array() || bounds.size() != 6) throw fault("are not six numbers").at("bounds");
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!bounds[axis].is_number() || !bounds[axis + 3].is_number()) {
        throw fault("are not six numbers").at("bounds");
      }
      const double low = bounds[axis].get<double>(), high = bounds[axis + 3].get<double>();
      const double half = 0.5 * high - 0.5 * low;
      octree.centre[axis] = 0.5 * high + 0.5 * low;
      if (!std::isfinite(octree.centre[axis]) || !(half > 0) || !std::isfinite(2 * half)) {
        throw fault("do not enclose a cube").at("bounds");
      }
      // Sides of a cube far from zero may differ by rounding.
      const double rounding = 0x1p-40 * (std::abs(low) + std::abs(high));
      if (axis == 0) octree.half_size = half;
      if (std::abs(half - octree.half_size) > rounding)
        throw fault("do not enclose a cube").at("bounds");
    }
    const Json& span = member(json, "span");
    if (!span.is_number_unsigned() || span.get<std::uint64_t>() == 0 ||
        span.get<std::uint64_t>() > (1u << kMaxDepth)) {
      throw fault("is not a number of cells").at("span");
    }
    octree.spacing = 2 * octree.half_size / static_cast<double>(span.get<std::uint64_t>());
    if (!(octree.spacing > 0)) throw fault("is not a number of cells").at("span");
  }

  [[nodiscard]] ScalarType type_of(const Json& json, const std::string& where) const {
    const std::string type = text(json, "type", {});
    const Json& size = member(json, "size");
    const std::uint64_t bytes = size.is_number_unsigned() ? size.get<std::uint64_t>() : 0;
    const bool is_float = type == "float" || type == "floating";
    constexpr std::array kSigned{ScalarType::i8, ScalarType::i16, ScalarType::i32, ScalarType::i64};
    constexpr std::array kUnsigned{ScalarType::u8, ScalarType::u16, ScalarType::u32,
                                   ScalarType::u64};
    for (std::size_t i = 0; i < kSigned.size(); ++i) {
      if (bytes != std::uint64_t{1} << i) continue;
      if (type == "signed") return kSigned[i];
      if (type == "unsigned") return kUnsigned[i];
      if (is_float && bytes >= 4) return bytes == 4 ? ScalarType::f32 : ScalarType::f64;
    }
    throw fault(fmt::format("{} of {} bytes is not a type", in_quotes(type), size.dump()))
        .at(where);
  }

  [[nodiscard]] Dimension dimension(const Json& json, const std::string& where) const {
    if (!json.is_object()) throw fault("is not an object").at(where);
    Dimension dimension{.name = text(json, "name", {}), .channel = {}};
    Channel& channel = dimension.channel;
    channel.name = dimension.name;
    for (char& c : channel.name) {
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '_';
    }
    channel.type = type_of(json, where);
    channel.scale = number(json, "scale", 1.0);
    channel.offset = number(json, "offset", 0.0);
    if (channel.scale == 0) throw fault("has the scale 0").at(where);
    for (const KnownDimension& known : kKnown) {
      if (dimension.name == known.ept) channel.name = known.name;
    }
    if (channel.name == "scan_angle_rank") {
      channel.unit = "degree";
      // Ranks are whole degrees; angles of LAS 1.4 are not.
      if (channel.type != ScalarType::i8) channel.name = "scan_angle_degrees";
    }
    return dimension;
  }

  void read_schema(const Json& schema, RecordStream& stream) const {
    if (!schema.is_array()) throw fault("is not a list of dimensions").at("schema");
    SourceInfo& info = stream.info;
    std::array<bool, 3> found{};
    std::set<std::string> names;
    if (schema.size() > kMaxDimensions) throw fault("has too many dimensions").at("schema");
    for (std::size_t i = 0; i < schema.size(); ++i) {
      const std::string where = fmt::format("dimension {} of the schema", i);
      const auto [name, channel] = dimension(schema[i], where);
      const std::size_t offset = stream.record_bytes;
      stream.record_bytes += size_of(channel.type);
      if (stream.record_bytes > kMaxRecordBytes)
        throw fault("has too many dimensions").at("schema");
      if (name.size() == 1 && name[0] >= 'X' && name[0] <= 'Z') {
        const auto axis = static_cast<std::size_t>(name[0] - 'X');
        if (found[axis]) throw fault("repeats " + name).at(where);
        found[axis] = true;
        stream.coordinate_offsets[axis] = offset;
        place(channel, axis, info);
        continue;
      }
      if (!names.insert(channel.name).second) throw fault("repeats " + name).at(where);
      if (channel.name.empty()) throw fault("has no name").at(where);
      stream.fields.push_back({.channel = channel, .offset = offset});
      info.attributes.push_back(channel);
    }
    if (!found[0] || !found[1] || !found[2]) throw fault("lacks X, Y or Z").at("schema");
    if (info.world.xy[0] * info.world.xy[4] == 0 ||
        !std::isfinite(info.world.xy[0] * info.world.xy[4])) {
      throw fault("the scales of X and Y are too small or too large").at("schema");
    }
  }

  static void place(const Channel& channel, std::size_t axis, SourceInfo& info) {
    info.coordinates[axis] = {.name = std::string(1, static_cast<char>('x' + axis)),
                              .type = channel.type};
    if (axis == 2) {
      info.coordinates[2].scale = channel.scale;
      info.coordinates[2].offset = channel.offset;
    } else {
      info.world.xy[axis == 0 ? 0 : 4] = channel.scale;
      info.world.xy[axis == 0 ? 2 : 5] = channel.offset;
    }
  }

  void read_srs(const Json& srs, Crs& crs) const {
    if (!srs.is_object()) throw fault("is not an object").at("srs");
    crs.wkt = text(srs, "wkt", "");
    const auto code = [&](const char* name) {
      const std::string digits = text(srs, name, "");
      int value = 0;
      const auto [end, error] =
          std::from_chars(digits.data(), digits.data() + digits.size(), value);
      if (!digits.empty() &&
          (error != std::errc() || end != digits.data() + digits.size() || value <= 0)) {
        throw fault(in_quotes(digits) + " is not the code of a reference system").at("srs");
      }
      return value;
    };
    if (text(srs, "authority", "") != "EPSG") return;
    if (crs.wkt.empty()) crs.epsg = code("horizontal");
    crs.vertical_epsg = code("vertical");
  }

  const std::string& file_;
};

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
  if (!read(depth) || depth > kMaxDepth) return {};
  node.depth = depth;
  for (std::uint32_t& position : node.position) {
    if (!name.starts_with('-')) return {};
    name.remove_prefix(1);
    if (!read(position) || (position >> depth) != 0) return {};
  }
  if (!name.empty()) return {};
  return node;
}

/// Depth and position. A file of the hierarchy is named after its topmost node.
using NodeNumbers = std::array<std::uint32_t, 4>;

NodeNumbers numbers_of(const OctreeNode& node) {
  return {node.depth, node.position[0], node.position[1], node.position[2]};
}

/// The part of the hierarchy read so far.
struct HierarchyState {
  std::uint64_t points = 0;  ///< promised
  std::uint64_t found = 0;
  std::vector<OctreeNode> nodes{};
  std::vector<NodeNumbers> pending{};  ///< of files to be read
  std::set<NodeNumbers> files{};       ///< of all files that are referred to
};

/// Takes the entries of one file as they are parsed: an object of names and numbers.
class EntryParser final : public nlohmann::json_sax<nlohmann::json> {
 public:
  EntryParser(const std::string& file, HierarchyState& state) : file_(file), state_(state) {}

  bool key(string_t& name) override {
    name_ = name;
    return true;
  }
  bool number_unsigned(number_unsigned_t value) override {
    OctreeNode node = parsed_node();
    if (value == 0) return true;
    // Compared before adding, because the sum could overflow.
    if (value > state_.points - state_.found) {
      throw ept_fault(file_, fmt::format("the nodes have more points than ept.json promises: {}",
                                         state_.points))
          .at("node " + name_);
    }
    node.points = value;
    state_.found += value;
    state_.nodes.push_back(node);
    return true;
  }
  bool number_integer(number_integer_t value) override {
    const NodeNumbers numbers = numbers_of(parsed_node());
    if (value != -1)
      throw ept_fault(file_, fmt::format("has {} points", value)).at("node " + name_);
    if (!state_.files.insert(numbers).second) {
      throw ept_fault(file_, "its part of the hierarchy is referred to twice").at("node " + name_);
    }
    state_.pending.push_back(numbers);
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
  [[nodiscard]] OctreeNode parsed_node() const {
    if (depth_ == 0) refuse();
    const std::optional<OctreeNode> node = node_of(name_);
    if (!node) throw ept_fault(file_, in_quotes(name_) + " is not a node of an octree");
    return *node;
  }

  const std::string& file_;
  HierarchyState& state_;
  std::string name_;
  int depth_ = 0;
};

}  // namespace

Error ept_fault(std::string file, std::string cause) {
  return Error(std::move(file), std::move(cause))
      .remedy("the data set is damaged or not EPT 1.0: download it again");
}

EptMetadata read_ept_metadata(const std::string& file) { return EptMetadataReader(file).read(); }

std::vector<OctreeNode> read_ept_hierarchy(const std::filesystem::path& folder,
                                           std::uint64_t points) {
  const NodeNumbers root = numbers_of(OctreeNode{});
  /// Enough for some 800,000 nodes; Entwine begins another file after a few depths.
  constexpr std::uint64_t kMaxBytes = 16u << 20;
  HierarchyState state{.points = points};
  state.files.insert(root);
  state.pending.push_back(root);
  while (!state.pending.empty()) {
    const auto [depth, x, y, z] = state.pending.back();
    state.pending.pop_back();
    const std::string name = key_of({.depth = depth, .position = {x, y, z}});
    const std::string file = (folder / "ept-hierarchy" / (name + ".json")).string();
    if (open_file(file)->size() > kMaxBytes) throw ept_fault(file, "is too large for a hierarchy");
    std::ifstream bytes(file, std::ios::binary);
    EntryParser parser(file, state);
    nlohmann::json::sax_parse(bytes, &parser);
  }
  if (state.found != points) {
    throw ept_fault((folder / "ept-hierarchy").string(),
                    fmt::format("its nodes have {}, but ept.json promises {}",
                                counted(state.found, "point"), points));
  }
  return std::move(state.nodes);
}

}  // namespace terrace::stream
