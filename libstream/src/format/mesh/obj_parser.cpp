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

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// Takes the word at the beginning of a line without leading blanks, and the blanks after it.
std::string_view take_word(std::string_view& line) {
  const std::string_view word = line.substr(0, line.find_first_of(" \t"));
  line = trim_left(line.substr(word.size()));
  return word;
}

/// Parses Wavefront OBJ: statements "v x y z" and "f a b c ..."; others are ignored. A backslash at
/// the end of a line continues it on the next one.
class ObjParser final : public MeshParser {
 public:
  ObjParser(Input& input, bool faces) : input_(&input), lines_(input), faces_(faces) {
    if (input.fill(kByteOrderMark.size()).starts_with(kByteOrderMark)) {
      input.consume(kByteOrderMark.size());
    }
  }

  const char* format() const override { return "obj"; }
  const Input& input() const override { return *input_; }

  Item next() override {
    std::string_view line;
    while (next_statement(line)) {
      if (line.starts_with("# ")) {
        if (comments_.size() < kMaxComments) comments_.emplace_back(line.substr(2));
        continue;
      }
      const std::string_view word = take_word(line);
      if (word == "v") {
        if (!read_vertex(line, vertex_)) throw fault("a vertex needs three coordinates");
        ++vertices_;
        return Item::vertex;
      }
      if (faces_ && word == "f") {
        read_face(line.substr(0, line.find('#')));
        if (face_.size() > 2) return Item::face;
      }
    }
    lines_.release();
    return Item::end;
  }

 private:
  static constexpr std::size_t kMaxComments = 64;

  [[nodiscard]] Error fault(std::string cause) const {
    return Error(input_->name(), std::move(cause))
        .at_line(lines_.number())
        .remedy("the file is damaged: export it again");
  }

  /// Reads the next line, with its continuation lines and without surrounding blanks. Comments are
  /// not continued, because paths in them may end in a backslash.
  bool next_statement(std::string_view& line) {
    if (!lines_.next(line)) return false;
    line = trim(line);
    if (!line.ends_with('\\') || line.starts_with('#')) return true;
    joined_.clear();
    for (bool more = true; more;) {
      const bool continued = line.ends_with('\\');
      joined_.append(line.substr(0, line.size() - (continued ? 1 : 0))).append(" ");
      if (joined_.size() > LineReader::kMaxLine) {
        throw fault("a line and its continuations are longer than " +
                    counted(LineReader::kMaxLine, "byte"));
      }
      more = continued && lines_.next(line);
      if (more) line = trim(line);
    }
    line = trim(joined_);
    return true;
  }

  /// Corners are "7", "7/2", "7/2/3" or "7//3": the first number is the vertex. Positive numbers
  /// count from 1, negative ones back from the last vertex so far.
  void read_face(std::string_view text) {
    face_.clear();
    while (!text.empty()) {
      const std::string_view word = take_word(text);
      std::int64_t number = 0;
      const auto [rest, error] = std::from_chars(word.data(), word.data() + word.size(), number);
      const bool ends = rest == word.data() + word.size() || *rest == '/';
      const std::int64_t vertex = number < 0 ? number + vertices_ : number - 1;
      if (error != std::errc{} || !ends || vertex < 0 || vertex >= vertices_ ||
          vertex >= std::numeric_limits<std::uint32_t>::max()) {
        throw fault("a face names the vertex " + in_quotes(word) + ", which does not exist");
      }
      face_.push_back(static_cast<std::uint32_t>(vertex));
    }
  }

  Input* input_;
  LineReader lines_;
  bool faces_;
  std::int64_t vertices_ = 0;
  std::string joined_;  ///< a statement of several lines
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

/// True if the first line that is not a comment or a group is a statement of OBJ.
bool recognise_obj(std::span<const std::byte> bytes) {
  std::string_view head(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (head.starts_with(kByteOrderMark)) head.remove_prefix(kByteOrderMark.size());
  while (!head.empty()) {
    std::string_view line = head.substr(0, head.find_first_of("\r\n"));
    head.remove_prefix(std::min(line.size() + 1, head.size()));
    line = trim(line);
    if (line.empty() || line.starts_with('#')) continue;
    const bool continued = line.ends_with('\\');
    const std::string_view word = take_word(line);
    if (word == "o" || word == "g" || word == "s") continue;
    if (line.empty()) return false;
    if (word == "mtllib" || word == "usemtl" || word == "vn" || word == "vt") return true;
    Point3 place{};
    return word == "v" && (continued || read_vertex(line, place));
  }
  return false;
}

std::unique_ptr<MeshParser> obj_parser(Input& input, bool faces) {
  return std::make_unique<ObjParser>(input, faces);
}

}  // namespace terrace::stream
