// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>

#include <fmt/core.h>

#include "format/mesh/parser.hpp"
#include "io/bytes.hpp"
#include "io/line_reader.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr const char* kStlRemedy = "the file is damaged: export it again";

/// Common part of both forms: delivers three vertices, then their face.
class StlParser : public MeshParser {
 public:
  explicit StlParser(bool faces) : wants_faces_(faces) {}

  const char* format() const final { return "stl"; }
  bool is_soup() const final { return true; }

  Item next() final {
    if (corner_ < 3) {
      if (!read_corner()) return Item::end;
      ++corner_;
      if (corner_ == 3 && !wants_faces_) begin_face();
      return Item::vertex;
    }
    constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max() / 3;
    if (faces_ == kMax)
      throw fault("has more triangles than can be numbered").remedy("read it as points");
    const auto first = static_cast<std::uint32_t>(3 * faces_);
    face_ = {first, first + 1, first + 2};
    begin_face();
    return Item::face;
  }

 protected:
  /// Reads the next corner to vertex_; false after the last.
  virtual bool read_corner() = 0;
  [[nodiscard]] virtual Error fault(std::string cause) const = 0;

  std::uint64_t faces_ = 0;  ///< number of finished faces
  unsigned corner_ = 0;      ///< corners of the current face that have been read

 private:
  void begin_face() {
    corner_ = 0;
    ++faces_;
  }

  bool wants_faces_;
};

/// Parses text: lines "vertex x y z", three between "outer loop" and "endloop"; "endsolid" ends a
/// solid.
class StlText final : public StlParser {
 public:
  StlText(Input& input, bool faces) : StlParser(faces), input_(&input), lines_(input) {}

  const Input& input() const override { return *input_; }

 protected:
  bool read_corner() override {
    std::string_view line;
    while (lines_.next(line)) {
      line = trim_left(line);
      if (line.starts_with("vertex") || line.starts_with("VERTEX")) {
        line.remove_prefix(6);
        if (!in_loop_) throw fault("a vertex is outside a loop");
        if (!read_vertex(line, vertex_)) throw fault("a vertex needs three coordinates");
        if (corner_ == 2) in_loop_ = false;
        return true;
      }
      if (line.starts_with("outer") || line.starts_with("OUTER")) {
        if (corner_ != 0) throw fault("a loop has fewer than three vertices");
        in_loop_ = true;
      } else if (line.starts_with("endloop") || line.starts_with("ENDLOOP")) {
        if (corner_ != 0) throw fault("a loop has fewer than three vertices");
        in_loop_ = false;
      } else if (line.starts_with("endsolid") || line.starts_with("ENDSOLID")) {
        ended_ = true;
      } else if (line.starts_with("solid") || line.starts_with("SOLID")) {
        ended_ = false;
      }
    }
    if (corner_ != 0 || !ended_)
      throw fault("ends within a solid").remedy("the file is truncated: download it again");
    lines_.release();
    return false;
  }

  [[nodiscard]] Error fault(std::string cause) const override {
    return Error(input_->name(), std::move(cause)).at_line(lines_.number()).remedy(kStlRemedy);
  }

 private:
  Input* input_;
  LineReader lines_;
  bool in_loop_ = false, ended_ = false;
};

/// Parses the binary form: 80 arbitrary bytes, the number of triangles, then 50 bytes for each: a
/// normal and three corners as 32-bit floats, and two bytes that are ignored.
class StlBinary final : public StlParser {
 public:
  StlBinary(Input& input, bool faces) : StlParser(faces), input_(&input) {
    const std::string_view head = input.fill(kHeadBytes);
    if (head.size() < kHeadBytes) throw fault("is too short for STL");
    count_ = load_little_endian<std::uint32_t>(head.data() + 80);
    if (input.size() && (*input.size() - kHeadBytes) / kFaceBytes < count_) {
      throw fault(fmt::format("promises {} but has bytes for {}", counted(count_, "triangle"),
                              (*input.size() - kHeadBytes) / kFaceBytes));
    }
    input.consume(kHeadBytes);
  }

  const Input& input() const override { return *input_; }
  std::optional<std::uint64_t> stated_vertices() const override {
    return 3 * std::uint64_t{count_};
  }
  ScalarType coordinate_type() const override { return ScalarType::f32; }

 protected:
  bool read_corner() override {
    if (corner_ == 0) {
      if (faces_ == count_) return false;
      if (faces_ > 0) input_->consume(kFaceBytes);
      if (input_->fill(kFaceBytes).size() < kFaceBytes) {
        throw fault(fmt::format("ends after {} of {}", faces_, counted(count_, "triangle")));
      }
    }
    const char* at = input_->window().data() + kNormalBytes + std::size_t{12} * corner_;
    for (double& value : vertex_) {
      value = std::bit_cast<float>(load_little_endian<std::uint32_t>(at));
      if (std::isinf(value)) {
        throw fault(fmt::format("triangle {} has an infinite coordinate", faces_));
      }
      at += 4;
    }
    return true;
  }

  [[nodiscard]] Error fault(std::string cause) const override {
    return Error(input_->name(), std::move(cause)).at_byte(input_->offset()).remedy(kStlRemedy);
  }

 private:
  static constexpr std::size_t kHeadBytes = 84, kFaceBytes = 50, kNormalBytes = 12;

  Input* input_;
  std::uint32_t count_ = 0;
};

}  // namespace

bool recognise_stl(std::span<const std::byte> bytes) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!head.starts_with("solid") && !head.starts_with("SOLID")) return false;
  // Some programs write "solid" to the free bytes of the binary form, which are not followed by
  // text.
  return std::all_of(head.begin(), head.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte >= 0x20 || c == '\n' || c == '\r' || c == '\t';
  });
}

std::unique_ptr<MeshParser> stl_parser(Input& input, bool faces) {
  constexpr std::size_t kHeadBytes = 512;
  const std::string_view head = input.fill(kHeadBytes).substr(0, kHeadBytes);
  // The binary form may begin with any bytes, so only text of an STL counts as UTF-16.
  std::string narrow(head);
  std::erase(narrow, '\0');
  if (narrow.starts_with("\xFF\xFE") || narrow.starts_with("\xFE\xFF")) narrow.erase(0, 2);
  if (recognise_stl(std::as_bytes(std::span(narrow)))) refuse_utf16(input);
  if (recognise_stl(std::as_bytes(std::span(head)))) {
    return std::make_unique<StlText>(input, faces);
  }
  return std::make_unique<StlBinary>(input, faces);
}

}  // namespace terrace::stream
