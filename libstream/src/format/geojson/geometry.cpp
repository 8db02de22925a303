// SPDX-License-Identifier: Apache-2.0
#include "format/geojson/geometry.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// A type of geometry that has coordinates.
struct GeometryType {
  std::string_view name;
  std::size_t depth;  ///< brackets around a position's numbers
  bool lines;
};

constexpr std::array<GeometryType, 6> kGeometryTypes{{{"Point", 1, false},
                                                      {"MultiPoint", 2, false},
                                                      {"LineString", 2, true},
                                                      {"MultiLineString", 3, true},
                                                      {"Polygon", 3, true},
                                                      {"MultiPolygon", 4, true}}};

/// Takes positions as they are parsed, so that only the geometry of a feature is held in memory.
class GeometryParser final : public nlohmann::json_sax<nlohmann::json> {
 public:
  GeometryParser(const std::string& file, std::uint64_t offset, GeoJsonGeometry& geometry)
      : file_(file), offset_(offset), geometry_(geometry) {}

  bool key(string_t& name) override {
    if (ignored_depth_ > 0) {
      if (is_property()) property_ = name;
      return true;
    }
    expected_ = name == "type"                               ? Expected::type
                : name == "coordinates"                      ? Expected::coordinates
                : name == "geometry"                         ? Expected::object
                : name == "geometries" || name == "features" ? Expected::list
                                                             : Expected::other;
    in_properties_ = objects_.size() == 1 && name == "properties";
    if (expected_ == Expected::coordinates &&
        std::exchange(objects_.back().has_coordinates, true)) {
      throw fault("a geometry has its coordinates twice");
    }
    return true;
  }

  bool start_object(std::size_t) override {
    if (is_ignored()) {
      ++ignored_depth_;
      return true;
    }
    if (depth_ > 0 || !(expects(Expected::object) || expects(Expected::item)))
      throw misplaced_error("an object");
    if (objects_.size() == kMaxObjects) throw fault("its collections are nested too deeply");
    objects_.emplace_back();
    objects_.back().first_run = runs_.size();
    return true;
  }

  bool end_object() override {
    if (ignored_depth_ > 0) {
      --ignored_depth_;
      return true;
    }
    finish(objects_.back());
    if (objects_.size() == 1 && objects_.back().type != "Feature") geometry_.properties.clear();
    runs_.resize(objects_.back().first_run);
    objects_.pop_back();
    return true;
  }

  bool start_array(std::size_t) override {
    if (is_ignored()) {
      if (ignored_depth_ == 0) in_properties_ = false;
      ++ignored_depth_;
    } else if (depth_ > 0 || expects(Expected::coordinates)) {
      open_bracket();
    } else if (expects(Expected::list)) {
      objects_.back().in_list = true;
    } else {
      throw misplaced_error("a list");
    }
    return true;
  }

  bool end_array() override {
    if (ignored_depth_ > 0) {
      --ignored_depth_;
    } else if (depth_ > 0) {
      close_bracket();
    } else {
      objects_.back().in_list = false;
    }
    return true;
  }

  bool number_integer(number_integer_t value) override {
    return number(static_cast<double>(value));
  }
  bool number_unsigned(number_unsigned_t value) override {
    return number(static_cast<double>(value));
  }
  bool number_float(number_float_t value, const string_t&) override { return number(value); }

  bool string(string_t& value) override {
    if (is_ignored()) return true;
    if (depth_ > 0 || !expects(Expected::type)) throw misplaced_error("a string");
    objects_.back().type = value;
    return true;
  }
  bool null() override {
    if (!is_ignored() && (depth_ > 0 || !expects(Expected::object))) throw misplaced_error("null");
    return true;
  }
  bool boolean(bool) override {
    if (!is_ignored()) throw misplaced_error("a truth value");
    return true;
  }
  bool binary(binary_t&) override { return true; }  // text has no binary values
  bool parse_error(std::size_t byte, const std::string&,
                   const nlohmann::detail::exception& error) override {
    offset_ += byte > 0 ? byte - 1 : 0;
    throw fault(std::string("is not JSON (") + error.what() + ')');
  }

 private:
  /// The role of the next value; other: ignored.
  enum class Expected : std::uint8_t { other, type, coordinates, object, list, item };
  static constexpr std::size_t kMaxObjects = 16, kMaxBrackets = 4;

  struct Object {
    std::string type;
    bool has_coordinates = false;
    bool in_list = false;  ///< between the brackets of its list of objects
    /// Brackets around the numbers of its positions; 0: it has no positions.
    std::size_t position_depth = 0;
    std::size_t empty_depth = 0;  ///< brackets down to the deepest empty one
    std::size_t first_run = 0;
  };
  struct Bracket {
    std::size_t numbers = 0;
    std::size_t first_position = 0;
    bool brackets = false;        ///< has brackets directly within
    std::uint8_t dimensions = 2;  ///< of positions directly within
  };

  [[nodiscard]] bool expects(Expected what) const {
    if (objects_.empty()) return what == Expected::object;
    return (objects_.back().in_list ? Expected::item : expected_) == what;
  }
  [[nodiscard]] bool is_ignored() const {
    return ignored_depth_ > 0 || (depth_ == 0 && expects(Expected::other));
  }

  /// Whether the next value is that of a property.
  [[nodiscard]] bool is_property() const { return in_properties_ && ignored_depth_ == 1; }

  bool number(double value) {
    if (is_property()) geometry_.properties.push_back({property_, value});
    if (is_ignored()) return true;
    if (depth_ == 0) throw misplaced_error("a number");
    Bracket& bracket = brackets_[depth_ - 1];
    if (bracket.brackets) throw fault("a position has a list among its numbers");
    if (bracket.numbers < 3) position_[bracket.numbers] = value;
    ++bracket.numbers;
    return true;
  }

  void open_bracket() {
    if (depth_ == kMaxBrackets) throw fault("its coordinates are nested too deeply");
    if (depth_ > 0) {
      if (brackets_[depth_ - 1].numbers > 0) throw fault("a position has a list among its numbers");
      brackets_[depth_ - 1].brackets = true;
    }
    brackets_[depth_++] = {.first_position = geometry_.positions.size()};
  }

  void close_bracket() {
    const Bracket& bracket = brackets_[depth_ - 1];
    Object& object = objects_.back();
    if (bracket.numbers > 0) {
      if (bracket.numbers == 1) throw fault("a position has only one number");
      if (object.position_depth != 0 && object.position_depth != depth_) {
        throw fault("its positions are nested unevenly");
      }
      object.position_depth = depth_;
      if (bracket.numbers == 2) position_[2] = 0;
      geometry_.positions.push_back(position_);
      if (depth_ > 1 && bracket.numbers > 2) brackets_[depth_ - 2].dimensions = 3;
    } else if (!bracket.brackets) {
      object.empty_depth = std::max(object.empty_depth, depth_);
    } else if (object.position_depth == depth_ + 1) {
      runs_.push_back({.begin = bracket.first_position,
                       .end = geometry_.positions.size(),
                       .dimensions = bracket.dimensions});
    }
    --depth_;
  }

  void finish(const Object& object) {
    const auto* const type =
        std::find_if(kGeometryTypes.begin(), kGeometryTypes.end(),
                     [&](const GeometryType& known) { return known.name == object.type; });
    if (type == kGeometryTypes.end()) {
      if (object.type != "Feature" && object.type != "FeatureCollection" &&
          object.type != "GeometryCollection") {
        throw fault(object.type.empty() ? "an object has no type"
                                        : "has an object of the type " + in_quotes(object.type));
      }
      if (object.has_coordinates) throw fault("a " + object.type + " has coordinates");
      return;
    }
    if (!object.has_coordinates) throw fault("a " + object.type + " has no coordinates");
    const bool has_empty_position = type->depth > 1 && object.empty_depth >= type->depth;
    if ((object.position_depth != 0 && object.position_depth != type->depth) ||
        has_empty_position) {
      throw fault("the coordinates are not those of a " + object.type);
    }
    if (!type->lines) return;
    for (std::size_t i = object.first_run; i < runs_.size(); ++i) {
      if (runs_[i].end - runs_[i].begin < 2)
        throw fault("a line of a " + object.type + " has only one position");
      geometry_.lines.push_back(runs_[i]);
    }
  }

  [[nodiscard]] Error misplaced_error(const std::string& what) const {
    return fault(what + " is not allowed here");
  }
  [[nodiscard]] Error fault(std::string cause) const {
    return Error(file_, std::move(cause))
        .at(fmt::format("the feature at byte {}", offset_))
        .remedy("the file is damaged or not GeoJSON: export it again, e.g. by ogr2ogr");
  }

  const std::string& file_;
  std::uint64_t offset_;
  GeoJsonGeometry& geometry_;
  std::vector<Object> objects_;
  Expected expected_ = Expected::other;
  bool in_properties_ = false;  ///< the last name of the outermost object is "properties"
  std::string property_;
  std::size_t ignored_depth_ = 0;  ///< open brackets and braces of an ignored value
  std::size_t depth_ = 0;          ///< open brackets of coordinates
  std::array<Bracket, kMaxBrackets> brackets_{};
  Point3 position_{};
  std::vector<GeoJsonGeometry::Line> runs_;
};

}  // namespace

void append_geometry(std::string_view item, const std::string& file, std::uint64_t offset,
                     GeoJsonGeometry& geometry) {
  GeometryParser parser(file, offset, geometry);
  nlohmann::json::sax_parse(item, &parser);
}

}  // namespace terrace::stream
