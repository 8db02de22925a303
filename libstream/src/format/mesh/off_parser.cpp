// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cstddef>
#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/core.h>

#include "format/mesh/parser.hpp"
#include "io/line_reader.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr const char* kOffRemedy = "the file is damaged: export it again";

/// Parses Geomview's OFF as text: "OFF" (or "COFF", "NOFF", "CNOFF", "STOFF", which have more
/// numbers per vertex, which are ignored), the counts of vertices, faces and edges, then a line for
/// each vertex and face.
class OffParser final : public MeshParser {
 public:
  OffParser(Input& input, bool faces) : input_(&input), lines_(input), wants_faces_(faces) {
    std::string_view line;
    if (!next_line(line)) throw fault("is empty");
    const std::size_t key = line.find("OFF");
    if (key == std::string_view::npos || key > 4) throw fault("does not begin with OFF");
    line.remove_prefix(key + 3);
    line = trim(line);
    if (line.starts_with("BINARY")) {
      throw fault("is binary OFF, which is not supported").remedy("export it as text");
    }
    if (!line.empty() && (line.front() == '4' || line.front() == 'n')) {
      throw fault("is OFF of another dimension than three").remedy("export plain OFF");
    }
    if (line.empty() && !next_line(line)) throw fault("ends before its counts");
    if (!take_count(line, vertices_) || !take_count(line, faces_)) {
      throw fault("does not state how many vertices and faces it has");
    }
  }

  const char* format() const override { return "off"; }
  const Input& input() const override { return *input_; }
  std::optional<std::uint64_t> stated_vertices() const override { return vertices_; }

  Item next() override {
    std::string_view line;
    if (read_ < vertices_) {
      if (!next_line(line)) {
        throw fault(fmt::format("ends after {} of {}", read_, counted(vertices_, "vertex")));
      }
      if (!read_vertex(line, vertex_)) throw fault("a vertex needs three coordinates");
      ++read_;
      return Item::vertex;
    }
    while (wants_faces_ && faces_read_ < faces_) {
      if (!next_line(line)) {
        throw fault(fmt::format("ends after {} of {} faces", faces_read_, faces_));
      }
      read_face(line);
      ++faces_read_;
      if (face_.size() > 2) return Item::face;
    }
    lines_.release();
    return Item::end;
  }

 private:
  [[nodiscard]] Error fault(std::string cause) const {
    return Error(input_->name(), std::move(cause)).at_line(lines_.number()).remedy(kOffRemedy);
  }

  /// Reads the next line that is neither blank nor a comment.
  bool next_line(std::string_view& line) {
    while (lines_.next(line)) {
      line = trim(line.substr(0, line.find('#')));
      if (!line.empty()) return true;
    }
    return false;
  }

  static bool take_count(std::string_view& text, std::uint64_t& count) {
    text = trim_left(text);
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), count);
    if (error != std::errc{}) return false;
    text.remove_prefix(static_cast<std::size_t>(rest - text.data()));
    return text.empty() || is_blank(text.front());
  }

  /// Reads "n a b c ...", which colours may follow.
  void read_face(std::string_view text) {
    face_.clear();
    std::uint64_t corners = 0;
    if (!take_count(text, corners)) throw fault("a face lacks the number of its corners");
    for (std::uint64_t i = 0; i < corners; ++i) {
      std::uint64_t vertex = 0;
      if (!take_count(text, vertex)) throw fault("a face has fewer corners than it states");
      if (vertex >= vertices_ || vertex >= std::numeric_limits<std::uint32_t>::max()) {
        throw fault(fmt::format("a face names the vertex {}, which does not exist", vertex));
      }
      face_.push_back(static_cast<std::uint32_t>(vertex));
    }
  }

  Input* input_;
  LineReader lines_;
  bool wants_faces_;
  std::uint64_t vertices_ = 0, faces_ = 0, read_ = 0, faces_read_ = 0;
};

}  // namespace

bool recognise_off(std::span<const std::byte> bytes) {
  std::string_view head(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const std::string_view key : {"OFF", "COFF", "NOFF", "CNOFF", "STOFF"}) {
    if (!head.starts_with(key)) continue;
    head.remove_prefix(key.size());
    return head.empty() || is_blank(head.front()) || head.front() == '\n' || head.front() == '\r';
  }
  return false;
}

std::unique_ptr<MeshParser> off_parser(Input& input, bool faces) {
  return std::make_unique<OffParser>(input, faces);
}

}  // namespace terrace::stream
