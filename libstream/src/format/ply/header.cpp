// SPDX-License-Identifier: Apache-2.0
#include "format/ply/header.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "io/line_reader.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = 1u << 20;
constexpr std::size_t kMaxElements = 100;
constexpr std::size_t kMaxProperties = 1000;

/// Reads the lines of the header and throws errors that name them.
class HeaderReader {
 public:
  explicit HeaderReader(Input& input) : input_(&input), lines_(input) {}

  std::string_view next() {
    std::string_view line;
    if (input_->offset() > kMaxHeaderBytes) {
      throw fault("the header is longer than " + counted(kMaxHeaderBytes, "byte"))
          .remedy("this is not a PLY file, or its end_header is missing");
    }
    if (!lines_.next(line)) {
      if (lines_.number() == 0) {
        throw Error(input_->name(), "the file is empty");
      }
      throw fault("the file ends before end_header")
          .remedy("the file is truncated: download it again");
    }
    return line;
  }
  [[nodiscard]] Error fault(std::string cause) const {
    return Error(input_->name(), std::move(cause))
        .at_line(lines_.number())
        .remedy("correct the header");
  }
  std::uint64_t finish() {
    lines_.release();
    return lines_.number();
  }

 private:
  Input* input_;
  LineReader lines_;
};

PlyEncoding parse_format(const std::vector<std::string_view>& words, const HeaderReader& reader) {
  if (words.size() != 3 || words[2] != "1.0") {
    throw reader.fault("not a format of PLY 1.0").remedy("expected 'format ascii 1.0' or the like");
  }
  if (words[1] == "ascii") return PlyEncoding::ascii;
  if (words[1] == "binary_little_endian") return PlyEncoding::little_endian;
  if (words[1] == "binary_big_endian") return PlyEncoding::big_endian;
  throw reader.fault("unknown format " + in_quotes(words[1]))
      .remedy("known are ascii, binary_little_endian and binary_big_endian");
}

PlyElement parse_element(const std::vector<std::string_view>& words, const HeaderReader& reader) {
  PlyElement element;
  if (words.size() != 3) throw reader.fault("not 'element NAME COUNT'");
  element.name = words[1];
  const char* const end = words[2].data() + words[2].size();
  const auto [rest, error] = std::from_chars(words[2].data(), end, element.count);
  if (error != std::errc{} || rest != end) {
    throw reader.fault(in_quotes(words[2]) + " is not a number of items");
  }
  return element;
}

PlyProperty parse_property(const std::vector<std::string_view>& words, const HeaderReader& reader) {
  const auto type_of = [&](std::string_view word) {
    const std::optional<ScalarType> type = scalar_type_of(word);
    if (!type) throw reader.fault("unknown type " + in_quotes(word));
    return *type;
  };
  PlyProperty property;
  if (words.size() == 5 && words[1] == "list") {
    property.list = true;
    property.count_type = type_of(words[2]);
    if (property.count_type == ScalarType::f32 || property.count_type == ScalarType::f64) {
      throw reader.fault("the length of a list is not an integer");
    }
    property.type = type_of(words[3]);
  } else if (words.size() == 3) {
    property.type = type_of(words[1]);
  } else {
    throw reader.fault("not 'property TYPE NAME' or 'property list TYPE TYPE NAME'");
  }
  property.name = words.back();
  return property;
}

/// Throws: Error for counts that the file has too few bytes for, before anything is allocated.
void check_counts(const PlyHeader& header, const Input& input) {
  if (!input.size()) return;
  // The last number of an ASCII file needs no separator after it.
  std::uint64_t remaining = *input.size() - std::min(*input.size(), input.offset());
  if (header.encoding == PlyEncoding::ascii) ++remaining;
  for (const PlyElement& element : header.elements) {
    const std::uint64_t min_bytes = header.encoding == PlyEncoding::ascii
                                        ? 2 * element.properties.size()
                                        : element.binary_bytes();
    if (min_bytes == 0) continue;
    if (element.count > remaining / min_bytes) {
      throw Error(input.name(),
                  fmt::format("the header promises {} of {} of at least {}, but only {}{} left",
                              counted(element.count, "item"), in_quotes(element.name),
                              counted(min_bytes, "byte"), counted(remaining, "byte"),
                              remaining == 1 ? " is" : " are"))
          .at_byte(input.offset())
          .remedy("the file is truncated or its header is wrong: download it again");
    }
    remaining -= element.count * min_bytes;
  }
}

}  // namespace

bool PlyElement::has_lists() const {
  return std::any_of(properties.begin(), properties.end(),
                     [](const PlyProperty& property) { return property.list; });
}

std::size_t PlyElement::binary_bytes() const {
  std::size_t bytes = 0;
  for (const PlyProperty& p : properties) bytes += size_of(p.list ? p.count_type : p.type);
  return bytes;
}

PlyHeader read_ply_header(Input& input) {
  PlyHeader header;
  HeaderReader reader(input);
  if (trim(reader.next()) != "ply")
    throw reader.fault("does not begin with 'ply'").remedy("this is not a PLY file");
  bool format_seen = false;
  for (;;) {
    const std::string_view line = reader.next();
    const std::vector<std::string_view> words = split_fields(line, ' ');
    if (words.empty()) continue;
    if (words[0] == "comment" || words[0] == "obj_info") {
      std::string_view text = trim_left(line);
      if (words[0] == "comment") text = trim_left(text.substr(words[0].size()));
      header.comments.emplace_back(text);
    } else if (words[0] == "format") {
      if (format_seen) throw reader.fault("a second format line");
      header.encoding = parse_format(words, reader);
      format_seen = true;
    } else if (words[0] == "element") {
      PlyElement element = parse_element(words, reader);
      for (const PlyElement& other : header.elements) {
        if (other.name == element.name) {
          throw reader.fault("a second element " + in_quotes(element.name));
        }
      }
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property") {
      if (header.elements.empty()) {
        throw reader.fault("a property before the first element");
      }
      auto& properties = header.elements.back().properties;
      PlyProperty property = parse_property(words, reader);
      for (const PlyProperty& other : properties) {
        if (other.name == property.name) {
          throw reader.fault("a second property " + in_quotes(property.name));
        }
      }
      properties.push_back(std::move(property));
      if (properties.size() > kMaxProperties) {
        throw reader.fault(fmt::format("more than {} properties", kMaxProperties))
            .remedy("this is not a file of points");
      }
    } else if (words[0] == "end_header") {
      break;
    } else {
      throw reader.fault("unknown keyword " + in_quotes(words[0]))
          .remedy("this is not a PLY 1.0 header");
    }
    if (header.elements.size() > kMaxElements) {
      throw reader.fault(fmt::format("more than {} elements", kMaxElements))
          .remedy("this is not a file of points");
    }
  }
  if (!format_seen) throw reader.fault("the header has no format line");
  header.lines = reader.finish();
  check_counts(header, input);
  return header;
}

std::string ply_type_name(ScalarType type) {
  switch (type) {
    case ScalarType::i8:
      return "char";
    case ScalarType::u8:
      return "uchar";
    case ScalarType::i16:
      return "short";
    case ScalarType::u16:
      return "ushort";
    case ScalarType::i32:
      return "int";
    case ScalarType::u32:
      return "uint";
    case ScalarType::f32:
      return "float";
    case ScalarType::f64:
      return "double";
    case ScalarType::i64:
    case ScalarType::u64:
      break;
  }
  return std::string(name_of(type));
}

std::string ply_preamble(bool ascii, std::span<const std::string> comments) {
  std::string text = "ply\nformat ";
  text += ascii ? "ascii 1.0\n" : "binary_little_endian 1.0\n";
  for (const std::string& comment : comments) {
    text += "comment ";
    for (const char c : comment) text += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    text += '\n';
  }
  return text;
}

}  // namespace terrace::stream
