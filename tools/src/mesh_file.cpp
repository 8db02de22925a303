// SPDX-License-Identifier: GPL-3.0-or-later
#include "mesh_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <string_view>

#include "terrace/stream/error.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::tools {
namespace {

using stream::ScalarType;

/// The bytes of the file and how far they have been read.
class Cursor {
 public:
  Cursor(std::string name, std::string_view bytes) : name_(std::move(name)), bytes_(bytes) {}

  [[noreturn]] void fail(const std::string& cause) const {
    throw stream::Error({.file = name_,
                         .where = "byte " + std::to_string(place_),
                         .cause = cause,
                         .remedy = "the file is damaged; write it anew"});
  }
  [[nodiscard]] std::size_t left() const { return bytes_.size() - place_; }
  [[nodiscard]] bool done() const { return place_ == bytes_.size(); }

  /// The rest of the line, without its end.
  std::string_view line() {
    const std::size_t end = std::min(bytes_.find('\n', place_), bytes_.size());
    std::string_view text = bytes_.substr(place_, end - place_);
    place_ = std::min(end + 1, bytes_.size());
    if (!text.empty() && text.back() == '\r') text.remove_suffix(1);
    return text;
  }
  double ascii_number() {
    constexpr std::string_view kSpace = " \t\r\n";
    place_ = std::min(bytes_.find_first_not_of(kSpace, place_), bytes_.size());
    double value = 0;
    const auto [end, error] =
        std::from_chars(bytes_.data() + place_, bytes_.data() + bytes_.size(), value);
    if (error != std::errc{}) fail(done() ? "ends too early" : "a number was expected");
    place_ = static_cast<std::size_t>(end - bytes_.data());
    return value;
  }
  double binary_number(ScalarType type, bool swap) {
    const std::size_t size = stream::size_of(type);
    if (left() < size) fail("ends too early");
    std::array<char, 8> raw{};
    std::memcpy(raw.data(), bytes_.data() + place_, size);
    if (swap) std::reverse(raw.begin(), raw.begin() + static_cast<std::ptrdiff_t>(size));
    place_ += size;
    switch (type) {
      case ScalarType::i8:
        return as<std::int8_t>(raw);
      case ScalarType::u8:
        return as<std::uint8_t>(raw);
      case ScalarType::i16:
        return as<std::int16_t>(raw);
      case ScalarType::u16:
        return as<std::uint16_t>(raw);
      case ScalarType::i32:
        return as<std::int32_t>(raw);
      case ScalarType::u32:
        return as<std::uint32_t>(raw);
      case ScalarType::i64:
        return static_cast<double>(std::bit_cast<std::int64_t>(raw));
      case ScalarType::u64:
        return static_cast<double>(std::bit_cast<std::uint64_t>(raw));
      case ScalarType::f32:
        return as<float>(raw);
      case ScalarType::f64:
        return std::bit_cast<double>(raw);
    }
    return 0;
  }

 private:
  template <class T>
  static double as(const std::array<char, 8>& raw) {
    T value{};
    std::memcpy(&value, raw.data(), sizeof value);
    return static_cast<double>(value);
  }

  std::string name_;
  std::string_view bytes_;
  std::size_t place_ = 0;
};

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

PlyHeader read_header(Cursor& in) {
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
  PlyReader(Cursor in, PlyHeader header) : in_(std::move(in)), header_(std::move(header)) {}

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

  Cursor in_;
  PlyHeader header_;
  MeshFile file_;
  std::vector<double> indices_;
};

/// The numbers after the key of an OBJ line; of "7/2/3" the first part.
void obj_numbers(std::string_view text, std::vector<double>& numbers) {
  numbers.clear();
  for (;;) {
    const std::size_t start = text.find_first_not_of(" \t");
    if (start == std::string_view::npos) return;
    const std::size_t end = std::min(text.find_first_of(" \t", start), text.size());
    double value = 0;
    const auto [rest, error] = std::from_chars(text.data() + start, text.data() + end, value);
    if (error != std::errc{}) return;
    numbers.push_back(value);
    text.remove_prefix(end);
  }
}

MeshFile read_obj(Cursor in) {
  MeshFile file;
  TriangleMesh& mesh = file.mesh;
  std::vector<double> numbers;
  while (!in.done()) {
    const std::string_view line = in.line();
    if (line.starts_with("# ")) {
      file.comments += std::string(line.substr(2)) + '\n';
    } else if (line.starts_with("v ")) {
      obj_numbers(line.substr(2), numbers);
      if (numbers.size() < 3) in.fail("a vertex without three coordinates");
      mesh.positions.push_back({numbers[0], numbers[1], numbers[2]});
    } else if (line.starts_with("f ")) {
      obj_numbers(line.substr(2), numbers);
      // Negative indices count back from the last vertex, positive ones from 1.
      for (double& v : numbers) {
        v = v < 0 ? v + static_cast<double>(mesh.positions.size()) : v - 1;
        if (!(v >= 0 && v < static_cast<double>(mesh.positions.size()))) {
          in.fail("a face names a vertex that is not there");
        }
      }
      for (std::size_t k = 2; k < numbers.size(); ++k) {
        mesh.triangles.push_back({static_cast<std::uint32_t>(numbers[0]),
                                  static_cast<std::uint32_t>(numbers[k - 1]),
                                  static_cast<std::uint32_t>(numbers[k])});
      }
    }
  }
  return file;
}

bool looks_like_obj(std::string_view bytes) {
  return bytes.find("\nf ") != std::string_view::npos &&
         (bytes.starts_with("v ") || bytes.find("\nv ") != std::string_view::npos);
}

}  // namespace

std::optional<MeshFile> read_mesh_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::array<char, 4> magic{};
  file.read(magic.data(), magic.size());
  const bool ply = std::string_view(magic.data(), 3) == "ply";
  const bool obj_name = path.size() > 4 && path.ends_with(".obj");
  if (!file || (!ply && !obj_name)) return std::nullopt;
  file.seekg(0);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  Cursor cursor(path, bytes);
  if (!ply) {
    if (!looks_like_obj(bytes)) return std::nullopt;
    return read_obj(cursor);
  }
  PlyHeader header = read_header(cursor);
  const bool faces = std::any_of(
      header.elements.begin(), header.elements.end(),
      [](const Element& e) { return (e.name == "face" || e.name == "tristrips") && e.count > 0; });
  if (!faces) return std::nullopt;
  return PlyReader(cursor, std::move(header)).read();
}

}  // namespace terrace::tools
