// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "terrace/matching/triangle_hierarchy.hpp"

/// Reads points and triangles from text or binary PLY files, as far as the benchmark's files
/// require: elements of numbers and lists. Polygons are divided into fans, and other elements are
/// skipped.

namespace terrace::matching::ply {

struct Mesh {
  std::vector<Point3> corners;
  std::vector<Triangle> triangles;
};

struct Property {
  std::string type, count_type, name;  // count_type is empty except for lists
};

struct Element {
  std::string name;
  std::size_t count;
  std::vector<Property> properties;
};

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) { read_header(); }

  Mesh read() {
    Mesh mesh;
    for (const Element& element : elements_) {
      for (std::size_t k = 0; k < element.count; ++k) read_one(element, mesh);
    }
    return mesh;
  }

 private:
  void read_header() {
    std::string line, word;
    while (next_line(line)) {
      std::istringstream words(line);
      words >> word;
      if (word == "format") {
        words >> format_;
      } else if (word == "element") {
        Element element{};
        words >> element.name >> element.count;
        elements_.push_back(element);
      } else if (word == "property") {
        Property property;
        words >> property.type;
        if (property.type == "list") words >> property.count_type >> property.type;
        words >> property.name;
        elements_.at(elements_.size() - 1).properties.push_back(property);
      } else if (word == "end_header") {
        return;
      }
    }
    throw std::runtime_error("the PLY file has no end_header");
  }

  bool next_line(std::string& line) {
    const std::size_t end = bytes_.find('\n', at_);
    if (end == std::string::npos) return false;
    line = bytes_.substr(at_, end - at_);
    at_ = end + 1;
    return true;
  }

  template <class Value, class Bits>
  double binary() {
    static_assert(sizeof(Value) == sizeof(Bits));
    if (at_ + sizeof(Bits) > bytes_.size()) throw std::runtime_error("the PLY file is truncated");
    Bits bits = 0;
    for (std::size_t k = 0; k < sizeof(Bits); ++k) {
      const std::size_t place = format_ == "binary_big_endian" ? sizeof(Bits) - 1 - k : k;
      bits = static_cast<Bits>(
          bits | static_cast<Bits>(static_cast<Bits>(static_cast<unsigned char>(bytes_[at_ + k]))
                                   << (8 * place)));
    }
    at_ += sizeof(Bits);
    return static_cast<double>(std::bit_cast<Value>(bits));
  }

  double number(const std::string& type) {
    if (format_ == "ascii") {
      char* end = nullptr;
      const double value = std::strtod(bytes_.c_str() + at_, &end);
      if (end == bytes_.c_str() + at_) throw std::runtime_error("the PLY file is truncated");
      at_ = static_cast<std::size_t>(end - bytes_.c_str());
      return value;
    }
    if (type == "char" || type == "int8") return binary<std::int8_t, std::uint8_t>();
    if (type == "uchar" || type == "uint8") return binary<std::uint8_t, std::uint8_t>();
    if (type == "short" || type == "int16") return binary<std::int16_t, std::uint16_t>();
    if (type == "ushort" || type == "uint16") return binary<std::uint16_t, std::uint16_t>();
    if (type == "int" || type == "int32") return binary<std::int32_t, std::uint32_t>();
    if (type == "uint" || type == "uint32") return binary<std::uint32_t, std::uint32_t>();
    if (type == "float" || type == "float32") return binary<float, std::uint32_t>();
    if (type == "double" || type == "float64") return binary<double, std::uint64_t>();
    throw std::runtime_error("the PLY file has numbers of unknown type " + type);
  }

  void read_one(const Element& element, Mesh& mesh) {
    if (element.name == "vertex") mesh.corners.push_back({});
    for (const Property& property : element.properties) {
      if (property.count_type.empty()) {
        const double value = number(property.type);
        if (element.name != "vertex" || property.name.size() != 1) continue;
        const auto axis = static_cast<std::size_t>(property.name[0] - 'x');
        if (axis < 3) mesh.corners.back()[axis] = value;
        continue;
      }
      const auto count = static_cast<std::size_t>(number(property.count_type));
      Triangle triangle{};
      for (std::size_t k = 0; k < count; ++k) {
        const auto corner = static_cast<std::uint32_t>(number(property.type));
        if (k > 2) triangle[1] = triangle[2];
        triangle[std::min<std::size_t>(k, 2)] = corner;
        if (k >= 2 && element.name == "face") mesh.triangles.push_back(triangle);
      }
    }
  }

  const std::string& bytes_;
  std::size_t at_ = 0;
  std::string format_;
  std::vector<Element> elements_;
};

}  // namespace terrace::matching::ply
