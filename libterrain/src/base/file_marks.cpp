// SPDX-License-Identifier: Apache-2.0
#include "base/file_marks.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>

#include <nlohmann/json.hpp>
#include <terrace/stream/geotiff_writer.hpp>

namespace terrace::terrain {
namespace {

/// No file written by terrace has longer lines or headers.
constexpr std::size_t kLongestMarkLine = 64u << 10;
constexpr std::uint64_t kLongestHeader = 1u << 20;

using Bytes = std::string;

/// Returns the bytes from `offset` on; fewer at the end of the file.
Bytes read_at(std::ifstream& file, std::uint64_t offset, std::size_t size) {
  Bytes bytes(size, '\0');
  file.clear();
  file.seekg(static_cast<std::streamoff>(offset));
  if (!file) return {};
  file.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

/// Returns an unsigned number of up to 8 bytes; nullopt if `bytes` ends before it.
std::optional<std::uint64_t> number_at(std::string_view bytes, std::size_t at, std::size_t size,
                                       bool big_endian) {
  if (at > bytes.size() || size > bytes.size() - at) return std::nullopt;
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t byte = at + (big_endian ? i : size - 1 - i);
    number = number << 8 | static_cast<unsigned char>(bytes[byte]);
  }
  return number;
}

/// Removes the first line from `text` and returns it; nullopt if no line end follows.
std::optional<std::string_view> take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end + 1);
  return line;
}

bool is_our_ply(std::ifstream& file) {
  const Bytes bytes = read_at(file, 0, kLongestMarkLine);
  std::string_view text = bytes;
  const std::string mark = std::string("comment ") + kWriterMark;
  while (const auto line = take_line(text)) {
    if (*line == mark) return true;
    if (*line == "end_header") return false;
  }
  return false;
}

bool is_our_las(std::ifstream& file) {
  constexpr std::size_t kSoftware = 58, kBytes = 32;
  Bytes name = read_at(file, kSoftware, kBytes);
  name.resize(std::min(name.find('\0'), name.size()));
  return name == "terrace";
}

bool is_our_glb(std::ifstream& file) {
  const Bytes head = read_at(file, 0, 20);
  const auto length = number_at(head, 12, 4, false);
  if (!length || *length > kLongestHeader || head.substr(16) != "JSON") return false;
  const auto json =
      nlohmann::json::parse(read_at(file, 20, static_cast<std::size_t>(*length)), nullptr, false);
  const nlohmann::json::json_pointer generator("/asset/generator");
  return json.is_object() && json.contains(generator) && json[generator] == "terrace";
}

bool is_our_png(std::ifstream& file) {
  constexpr std::string_view kMark("Software\0terrace", 16);
  for (std::uint64_t at = 8;;) {
    const Bytes chunk = read_at(file, at, 8 + kMark.size());
    const auto length = number_at(chunk, 0, 4, true);
    if (!length || chunk.size() < 8) return false;
    const std::string_view type = std::string_view(chunk).substr(4, 4);
    if (type == "IDAT" || type == "IEND") return false;
    if (type == "tEXt" && *length == kMark.size() && chunk.substr(8) == kMark) return true;
    at += 12 + *length;
  }
}

/// Returns the bytes of a value of a TIFF type; 0 for an unknown type.
std::uint64_t bytes_of_tiff_type(std::uint64_t type) {
  constexpr std::array<std::uint8_t, 19> kBytes{0, 1, 1, 2, 4, 8, 1, 1, 2, 4,
                                                8, 4, 8, 4, 0, 0, 8, 8, 8};
  return type < kBytes.size() ? kBytes[static_cast<std::size_t>(type)] : 0;
}

/// Searches the first directory of a classic TIFF or a BigTIFF. The Software tag is not enough,
/// because GDAL copies it and keeps it when it edits a file. So the directory must also be where
/// terrace writes it, with its values in the order of the tags, and name version 1.1 of GeoTIFF:
/// GDAL orders them differently, if there is a choice, and writes version 1.0.
bool is_our_tiff(std::ifstream& file, bool big_endian, bool big_tiff) {
  constexpr std::string_view kMark("terrace\0", 8), kStructure("GDAL_STRUCTURAL_METADATA_SIZE=");
  constexpr std::uint64_t kSoftware = 305, kTileWidth = 322, kGeoKeys = 34735, kAscii = 2;
  const std::size_t word = big_tiff ? 8 : 4, entry_bytes = big_tiff ? 20 : 12;
  const std::size_t count_bytes = big_tiff ? 8 : 2, head_bytes = big_tiff ? 16 : 8;
  const auto directory = number_at(read_at(file, big_tiff ? 8 : 4, word), 0, word, big_endian);
  if (!directory) return false;
  const auto entries =
      number_at(read_at(file, *directory, count_bytes), 0, count_bytes, big_endian);
  if (!entries || *entries > kLongestHeader / entry_bytes) return false;
  const Bytes bytes =
      read_at(file, *directory + count_bytes, static_cast<std::size_t>(*entries) * entry_bytes);
  file.clear();
  file.seekg(0, std::ios::end);
  const auto size = static_cast<std::uint64_t>(file.tellg());
  // Offset of the first value that is too long for its entry.
  std::uint64_t next = *directory + count_bytes + *entries * entry_bytes + word;
  bool marked = false, tiled = false, current = false;
  for (std::size_t at = 0; at + entry_bytes <= bytes.size(); at += entry_bytes) {
    const auto tag = number_at(bytes, at, 2, big_endian);
    const auto type = number_at(bytes, at + 2, 2, big_endian);
    const auto count = number_at(bytes, at + 4, word, big_endian);
    if (!tag || !type || !count || *count > size) return false;
    const std::size_t value = at + 4 + word;
    const std::uint64_t length = *count * bytes_of_tiff_type(*type);
    Bytes head = bytes.substr(value, word);
    if (length > word) {
      if (number_at(bytes, value, word, big_endian) != next) return false;
      head = read_at(file, next, kMark.size());
      next += length + length % 2;
    }
    current |= tag == kGeoKeys && number_at(head, 2, 2, big_endian) == 1 &&
               number_at(head, 4, 2, big_endian) == 1;
    tiled |= tag == kTileWidth;
    marked |= tag == kSoftware && type == kAscii && length == kMark.size() && head == kMark;
  }
  const bool structured = read_at(file, head_bytes, kStructure.size()) == kStructure;
  return marked && tiled && current &&
         (structured ? *directory == head_bytes + stream::kGeoTiffLayoutBytes : next == size);
}

}  // namespace

std::optional<bool> marked_by_terrace(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return false;
  const Bytes head = read_at(file, 0, kGeoJsonMark.size());
  if (head.empty()) return true;
  const std::string comment = std::string("# ") + kWriterMark + '\n';
  const std::string vtk = std::string("# vtk DataFile Version 3.0\n") + kWriterMark + '\n';
  for (const std::string_view mark : {std::string_view(comment), std::string_view(vtk),
                                      std::string_view("terrace overlay\n"), kGeoJsonMark}) {
    if (head.starts_with(mark)) return true;
  }
  if (head.starts_with("ply\n")) return is_our_ply(file);
  if (head.starts_with("LASF")) return is_our_las(file);
  if (head.starts_with("glTF")) return is_our_glb(file);
  if (head.starts_with("\x89PNG\r\n\x1a\n")) return is_our_png(file);
  const bool big_endian = head.starts_with("MM");
  const auto version = number_at(head, 2, 2, big_endian);
  if ((big_endian || head.starts_with("II")) && (version == 42 || version == 43)) {
    return is_our_tiff(file, big_endian, version == 43);
  }
  return std::nullopt;
}

}  // namespace terrace::terrain
