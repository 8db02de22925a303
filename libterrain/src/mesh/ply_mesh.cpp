// SPDX-License-Identifier: Apache-2.0
#include "mesh/ply_mesh.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace terrace::terrain {
namespace {

using stream::ScalarType;

struct Property {
  std::string name;
  bool list = false;
  ScalarType count_type = ScalarType::u8;
  ScalarType type = ScalarType::f64;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct PlyHeader {
  bool ascii = true;
  bool swap = false;  ///< the file's bytes are in the other order than ours
  std::vector<Element> elements;
  std::string comments;
};

PlyHeader read_header(MeshCursor& in) {
  PlyHeader header;
  in.line();  // "ply"
  const auto type_named = [&](const std::string& name) {
    const auto type = stream::scalar_type_of(name);
    if (!type) in.fail("unknown type '" + name + "'");
    return *type;
  };
  for (;;) {
    if (in.done()) in.fail("the header has no end");
    const std::string line(in.line());
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "end_header") return header;
    if (word == "comment" || word == "obj_info") {
      header.comments += line.substr(std::min(line.size(), word.size() + 1)) + '\n';
    } else if (word == "format") {
      words >> word;
      header.ascii = word == "ascii";
      const bool big = word == "binary_big_endian";
      if (!header.ascii && !big && word != "binary_little_endian") in.fail("unknown format");
      header.swap = big != (std::endian::native == std::endian::big);
    } else if (word == "element") {
      Element element;
      if (!(words >> element.name >> element.count)) in.fail("a bad element line");
      header.elements.push_back(element);
    } else if (word == "property") {
      if (header.elements.empty()) in.fail("a property before any element");
      Property property;
      words >> word;
      property.list = word == "list";
      if (property.list) {
        words >> word;
        property.count_type = type_named(word);
        words >> word;
      }
      property.type = type_named(word);
      words >> property.name;
      header.elements.back().properties.push_back(property);
    }
  }
}

/// Where a vertex property goes; nullptr for those that are not kept.
struct VertexRow {
  std::array<double, 3> position{}, colour{}, normal{0, 0, 1};
  double level = 0, group = 0;

  double* slot(const std::string& name) {
    static constexpr std::array<const char*, 9> kNames{"x",    "y",  "z",  "red", "green",
                                                       "blue", "nx", "ny", "nz"};
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      if (name == kNames[i]) return i < 3 ? &position[i] : i < 6 ? &colour[i - 3] : &normal[i - 6];
    }
    if (name == "level") return &level;
    if (name == "class" || name == "classification" || name == "cluster") return &group;
    return nullptr;
  }
};

bool has_property(const Element& element, std::initializer_list<const char*> names) {
  return std::any_of(element.properties.begin(), element.properties.end(), [&](const Property& p) {
    return std::any_of(names.begin(), names.end(), [&](const char* n) { return p.name == n; });
  });
}

template <class T>
T clamped(double value) {
  const double low = std::numeric_limits<T>::lowest(), high = std::numeric_limits<T>::max();
  return static_cast<T>(std::isnan(value) ? 0 : std::clamp(value, low, high));
}

class PlyReader {
 public:
  PlyReader(MeshCursor in, PlyHeader header) : in_(std::move(in)), header_(std::move(header)) {}

  MeshFile read() {
    for (const Element& element : header_.elements) {
      // Every number takes a byte and a separator at least: no count may promise more than is
      // there.
      const std::uint64_t least = header_.ascii ? 1 : element.properties.empty() ? 0 : 1;
      if (element.count > in_.left() / std::max<std::uint64_t>(least, 1) + 1) {
        in_.fail("element '" + element.name + "' counts " + std::to_string(element.count) +
                 ", more than the file can hold");
      }
      if (element.name == "vertex") {
        // Else the vertices of one would have properties that those of the other lack.
        if (!file_.mesh.positions.empty()) in_.fail("a second element 'vertex'");
        read_vertices(element);
      } else {
        const bool strips = element.name == "tristrips";
        for (std::uint64_t i = 0; i < element.count; ++i) read_other(element, strips);
      }
    }
    for (const auto& t : file_.mesh.triangles) {
      for (const std::uint32_t v : t) {
        if (v >= file_.mesh.positions.size()) in_.fail("a face names a vertex that is not there");
      }
    }
    file_.comments = header_.comments;
    return std::move(file_);
  }

 private:
  double number(ScalarType type) {
    return header_.ascii ? in_.ascii_number() : in_.binary_number(type, header_.swap);
  }

  void read_vertices(const Element& element) {
    TriangleMesh& mesh = file_.mesh;
    const bool levels = has_property(element, {"level"});
    const bool groups = has_property(element, {"class", "classification", "cluster"});
    const bool colours = has_property(element, {"red"});
    const bool normals = has_property(element, {"nx"});
    VertexRow row;
    std::vector<double*> slots;
    for (const Property& p : element.properties) {
      if (p.list) in_.fail("vertices with lists are not understood");
      slots.push_back(row.slot(p.name));
    }
    for (std::uint64_t i = 0; i < element.count; ++i) {
      for (std::size_t k = 0; k < slots.size(); ++k) {
        const double value = number(element.properties[k].type);
        if (slots[k] != nullptr) *slots[k] = value;
      }
      mesh.positions.push_back(row.position);
      if (levels) mesh.levels.push_back(clamped<std::uint8_t>(row.level));
      if (groups) mesh.classes.push_back(clamped<std::int32_t>(row.group));
      if (colours) {
        mesh.colours.push_back({clamped<std::uint8_t>(row.colour[0]),
                                clamped<std::uint8_t>(row.colour[1]),
                                clamped<std::uint8_t>(row.colour[2])});
      }
      if (normals) {
        mesh.normals.push_back({static_cast<float>(row.normal[0]),
                                static_cast<float>(row.normal[1]),
                                static_cast<float>(row.normal[2])});
      }
    }
  }

  void read_other(const Element& element, bool strips) {
    for (const Property& p : element.properties) {
      if (!p.list) {
        number(p.type);
        continue;
      }
      const double count = number(p.count_type);
      if (!(count >= 0) || count > static_cast<double>(in_.left())) in_.fail("a bad list");
      indices_.clear();
      for (double k = 0; k < count; ++k) indices_.push_back(number(p.type));
      if (strips) {
        add_strip();
      } else if (p.name == "vertex_indices" || p.name == "vertex_index") {
        for (std::size_t k = 2; k < indices_.size(); ++k) {
          add_triangle(indices_[0], indices_[k - 1], indices_[k]);
        }
      }
    }
  }

  void add_strip() {
    std::size_t start = 0;
    for (std::size_t k = 0; k < indices_.size(); ++k) {
      if (indices_[k] < 0) {
        start = k + 1;  // -1 begins a new strip
      } else if (k >= start + 2) {
        const std::size_t odd = (k - start) % 2;
        add_triangle(indices_[k - 2 + odd], indices_[k - 1 - odd], indices_[k]);
      }
    }
  }

  void add_triangle(double a, double b, double c) {
    const auto index = [&](double v) {
      if (!(v >= 0 && v < 4294967295.0)) in_.fail("a face names a vertex that is not there");
      return static_cast<std::uint32_t>(v);
    };
    file_.mesh.triangles.push_back({index(a), index(b), index(c)});
  }

  MeshCursor in_;
  PlyHeader header_;
  MeshFile file_;
  std::vector<double> indices_;
};

}  // namespace

std::optional<MeshFile> read_ply_mesh(MeshCursor in) {
  PlyHeader header = read_header(in);
  const bool faces = std::any_of(
      header.elements.begin(), header.elements.end(),
      [](const Element& e) { return (e.name == "face" || e.name == "tristrips") && e.count > 0; });
  if (!faces) return std::nullopt;
  return PlyReader(std::move(in), std::move(header)).read();
}

}  // namespace terrace::terrain
