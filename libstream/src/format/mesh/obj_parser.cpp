// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include "format/mesh/parser.hpp"
#include "io/line_reader.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Wavefront OBJ: lines "v x y z" and "f a b c ...", the rest left out.
class ObjParser final : public MeshParser {
 public:
  ObjParser(Input& input, bool faces) : input_(&input), lines_(input), faces_(faces) {}

  const char* format() const override { return "obj"; }
  const Input& input() const override { return *input_; }

  Item next() override {
    std::string_view line;
    while (lines_.next(line)) {
      if (line.starts_with("# ")) {
        if (comments_.size() < kMostComments) comments_.emplace_back(line.substr(2));
      } else if (line.starts_with("v ")) {
        line.remove_prefix(2);
        if (!read_vertex(line, vertex_)) fail("a vertex without three coordinates");
        ++vertices_;
        return Item::vertex;
      } else if (faces_ && line.starts_with("f ")) {
        read_face(line.substr(2));
        if (face_.size() > 2) return Item::face;
      }
    }
    lines_.release();
    return Item::end;
  }

 private:
  static constexpr std::size_t kMostComments = 64;

  [[noreturn]] void fail(std::string cause) const {
    throw Error({.file = input_->name(),
                 .where = "line " + std::to_string(lines_.number()),
                 .cause = std::move(cause),
                 .remedy = "the file is damaged; write it anew"});
  }

  /// Corners are "7", "7/2", "7/2/3" or "7//3": the first number is the vertex. Negative ones count
  /// back from the last vertex so far, positive ones from 1.
  void read_face(std::string_view text) {
    face_.clear();
    for (text = trim_left(text); !text.empty();) {
      const std::string_view word = text.substr(0, text.find_first_of(" \t"));
      std::int64_t number = 0;
      const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      const bool ends = rest == word.data() + word.size() || *rest == '/';
      const std::int64_t vertex = number < 0 ? number + vertices_ : number - 1;
      if (error != std::errc{} || !ends || vertex < 0 || vertex >= vertices_ ||
          vertex >= std::numeric_limits<std::uint32_t>::max()) {
        fail("a face names the vertex " + in_quotes(word) + ", which is not there");
      }
      face_.push_back(static_cast<std::uint32_t>(vertex));
      text = trim_left(text.substr(word.size()));
    }
  }

  Input* input_;
  LineReader lines_;
  bool faces_;
  std::int64_t vertices_ = 0;
};

}  // namespace

bool read_vertex(std::string_view& text, Point3& vertex) {
  for (double& value : vertex) {
    text = trim_left(text);
    const char* const end = text.data() + text.size();
    const char* const rest = parse_real(text.data(), end, value);
    if (rest == nullptr || std::isinf(value)) return false;
    text = {rest, static_cast<std::size_t>(end - rest)};
  }
  return true;
}

/// True if the first line that says something is one of an OBJ.
bool recognise_obj(std::span<const std::byte> bytes) {
  std::string_view head(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (!head.empty()) {
    const std::string_view line = head.substr(0, head.find('\n'));
    head.remove_prefix(std::min(line.size() + 1, head.size()));
    if (line.empty() || line == "\r" || line.starts_with('#')) continue;
    for (const std::string_view word : {"mtllib ", "usemtl ", "vn ", "vt "}) {
      if (line.starts_with(word)) return true;
    }
    if (line.starts_with("o ") || line.starts_with("g ") || line.starts_with("s ")) continue;
    Point3 place{};
    std::string_view rest = line;
    if (!line.starts_with("v ")) return false;
    rest.remove_prefix(2);
    return read_vertex(rest, place);
  }
  return false;
}

std::unique_ptr<MeshParser> obj_parser(Input& input, bool faces) {
  return std::make_unique<ObjParser>(input, faces);
}

}  // namespace terrace::stream
