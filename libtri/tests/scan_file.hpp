// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "terrace/tri/shape.hpp"

/// Reads scans for tests and benchmarks: PLY (ASCII and binary, points first, then faces with one
/// list as their first property) and OBJ. Polygons become fans of triangles.

namespace terrace::tri {

namespace scan_file {

inline std::size_t size_of(const std::string& type) {
  if (type == "char" || type == "uchar" || type == "int8" || type == "uint8") return 1;
  if (type == "short" || type == "ushort" || type == "int16" || type == "uint16") return 2;
  if (type == "double" || type == "float64") return 8;
  return 4;
}

enum class Format { ascii, little_endian, big_endian };

/// One number, from text or bytes.
inline double read_number(std::istream& in, const std::string& type, Format format) {
  double value = std::numeric_limits<double>::quiet_NaN();
  if (format == Format::ascii) {
    in >> value;
    return value;
  }
  static_assert(std::endian::native == std::endian::little);
  char bytes[8] = {};
  in.read(bytes, static_cast<std::streamsize>(size_of(type)));
  if (format == Format::big_endian) std::reverse(bytes, bytes + size_of(type));
  const auto as = [&](auto number) {
    std::memcpy(&number, bytes, sizeof number);
    return static_cast<double>(number);
  };
  if (type == "float" || type == "float32") return as(0.0f);
  if (type == "double" || type == "float64") return as(0.0);
  if (type == "uchar" || type == "uint8") return as(std::uint8_t{});
  if (type == "char" || type == "int8") return as(std::int8_t{});
  if (type == "ushort" || type == "uint16") return as(std::uint16_t{});
  if (type == "short" || type == "int16") return as(std::int16_t{});
  if (type == "uint" || type == "uint32") return as(std::uint32_t{});
  return as(std::int32_t{});
}

}  // namespace scan_file

inline Surface read_ply(std::istream& in) {
  using scan_file::read_number;
  struct Element {
    std::string name;
    std::size_t count;
    std::vector<std::vector<std::string>> properties;  // the words after "property"
  };
  std::vector<Element> elements;
  auto format = scan_file::Format::ascii;
  std::string line;
  while (std::getline(in, line) && line.rfind("end_header", 0) != 0) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "format") {
      words >> word;
      if (word == "binary_little_endian") format = scan_file::Format::little_endian;
      if (word == "binary_big_endian") format = scan_file::Format::big_endian;
    } else if (word == "element") {
      elements.emplace_back();
      words >> elements.back().name >> elements.back().count;
    } else if (word == "property") {
      elements.back().properties.emplace_back();
      while (words >> word) elements.back().properties.back().push_back(word);
    }
  }
  Surface surface;
  for (const Element& element : elements) {
    for (std::size_t k = 0; k < element.count && in; ++k) {
      std::array<double, 3> point{};
      for (const auto& property : element.properties) {
        if (property[0] != "list") {
          const double value = read_number(in, property[0], format);
          const std::size_t axis = std::string("xyz").find(property[1]);
          if (property[1].size() == 1 && axis < 3) point[axis] = value;
          continue;
        }
        std::vector<std::uint32_t> corners(
            static_cast<std::size_t>(read_number(in, property[1], format)));
        for (auto& corner : corners)
          // Other elements, such as strips, may have negative numbers, which are ignored.
          corner = static_cast<std::uint32_t>(std::max(0.0, read_number(in, property[2], format)));
        if (element.name != "face") continue;
        for (std::size_t i = 2; i < corners.size(); ++i)
          surface.faces.push_back({corners[0], corners[i - 1], corners[i]});
      }
      if (element.name == "vertex") surface.points.push_back(point);
    }
  }
  if (!in || surface.points.empty()) throw std::runtime_error("not a complete PLY file");
  return surface;
}

inline Surface read_obj(std::istream& in) {
  Surface surface;
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    std::string kind;
    words >> kind;
    if (kind == "v") {
      std::array<double, 3> point{};
      words >> point[0] >> point[1] >> point[2];
      surface.points.push_back(point);
    } else if (kind == "f") {
      std::vector<std::uint32_t> corners;
      for (std::string word; words >> word;)
        corners.push_back(static_cast<std::uint32_t>(std::stoul(word) - 1));
      for (std::size_t i = 2; i < corners.size(); ++i)
        surface.faces.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }
  if (surface.points.empty()) throw std::runtime_error("not an OBJ file");
  return surface;
}

/// Chooses the format by the extension: .obj, .ply, .ply.gz (by gzip).
inline Surface read_scan(const std::filesystem::path& path) {
  if (path.extension() == ".gz") {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> pipe(
        popen(("gzip -dc '" + path.string() + "'").c_str(), "r"), pclose);
    std::string text;
    std::vector<char> block(1 << 16);
    for (std::size_t n; pipe && (n = std::fread(block.data(), 1, block.size(), pipe.get())) > 0;)
      text.append(block.data(), n);
    std::istringstream in(text);
    return read_ply(in);
  }
  std::ifstream in(path, std::ios::binary);
  return path.extension() == ".obj" ? read_obj(in) : read_ply(in);
}

/// Closes each opening (a connected set of edges in one face) with a fan to its centre, so that the
/// enclosed volume is defined.
inline Surface with_openings_closed(Surface surface) {
  using Edge = std::pair<std::uint32_t, std::uint32_t>;
  std::set<Edge> edges;
  for (const auto& f : surface.faces)
    for (std::size_t i = 0; i < 3; ++i) edges.insert({f[i], f[(i + 1) % 3]});
  std::map<std::uint32_t, std::vector<std::uint32_t>> next;
  for (const auto& [from, to] : edges)
    if (!edges.contains({to, from})) {
      next[from].push_back(to);
      next[to];
    }
  while (!next.empty()) {
    std::set<std::uint32_t> opening{next.begin()->first};
    for (bool grown = true; grown;) {
      grown = false;
      for (const auto& [from, tos] : next)
        for (const std::uint32_t to : tos)
          if (opening.contains(from) != opening.contains(to)) {
            opening.insert({from, to});
            grown = true;
          }
    }
    std::array<double, 3> centre{};
    for (const std::uint32_t v : opening)
      for (std::size_t k = 0; k < 3; ++k)
        centre[k] += surface.points[v][k] / static_cast<double>(opening.size());
    const auto middle = static_cast<std::uint32_t>(surface.points.size());
    surface.points.push_back(centre);
    for (const std::uint32_t from : opening) {
      for (const std::uint32_t to : next[from]) surface.faces.push_back({to, from, middle});
      next.erase(from);
    }
  }
  return surface;
}

/// Maps the bounding box to 0 .. 2^24 - 1 on its longest side.
inline std::vector<std::array<std::int32_t, 3>> quantised(
    const std::vector<std::array<double, 3>>& points, double& step) {
  std::array<double, 3> low = points.at(0), high = low;
  for (const auto& p : points) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  const double extent = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  step = extent / ((1 << 24) - 1);
  std::vector<std::array<std::int32_t, 3>> result;
  for (const auto& p : points) {
    std::array<std::int32_t, 3> q{};
    for (std::size_t k = 0; k < 3; ++k)
      q[k] = static_cast<std::int32_t>((p[k] - low[k]) / step + 0.5);
    result.push_back(q);
  }
  return result;
}

}  // namespace terrace::tri
