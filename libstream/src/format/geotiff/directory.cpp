// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/directory.hpp"

#include <array>
#include <bit>
#include <cassert>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <tiff.h>

#include "format/geotiff/keys.hpp"
#include "format/geotiff/tags.hpp"

namespace terrace::stream {
namespace {

template <class T>
void append_native(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

/// An offset or a number of values.
void append_size(std::string& out, bool big, std::uint64_t value) {
  if (big) {
    append_native(out, value);
  } else {
    assert(value <= std::numeric_limits<std::uint32_t>::max());
    append_native(out, static_cast<std::uint32_t>(value));
  }
}

/// Returns the shortest text that reads back as the same number.
std::string shortest(double value) {
  if (std::isnan(value)) return "nan";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string metadata_of(const Channel& sample) {
  if (sample.scale == 1 && sample.offset == 0 && sample.unit.empty()) return {};
  std::string xml = "<GDALMetadata>\n";
  const auto item = [&](const char* item_name, const char* role, const std::string& value) {
    xml.append("  <Item name=\"").append(item_name).append("\" sample=\"0\" role=\"");
    xml.append(role).append("\">").append(value).append("</Item>\n");
  };
  if (sample.offset != 0) item("OFFSET", "offset", shortest(sample.offset));
  if (sample.scale != 1) item("SCALE", "scale", shortest(sample.scale));
  if (!sample.unit.empty()) item("UNITTYPE", "unittype", escaped(sample.unit));
  return xml + "</GDALMetadata>\n";
}

void add_georeference(TiffDirectory& directory, const GeoTiffOptions& options) {
  auto m = options.world.xy;
  if (!options.pixel_is_point) {  // to the corner of the cell
    m[2] -= 0.5 * (m[0] + m[1]);
    m[5] -= 0.5 * (m[3] + m[4]);
  }
  if (m[1] == 0 && m[3] == 0 && m[0] > 0 && m[4] < 0) {
    directory.add(kModelPixelScale, std::vector<double>{m[0], -m[4], 0});
    directory.add(kModelTiepoint, std::vector<double>{0, 0, 0, m[2], m[5], 0});
  } else {
    directory.add(kModelTransformation, std::vector<double>{m[0], m[1], 0, m[2], m[3], m[4], 0,
                                                            m[5], 0, 0, 0, 0, 0, 0, 0, 1});
  }
  const GeoKeyDirectory keys =
      keys_of(options.crs, options.pixel_is_point ? kPixelIsPoint : kPixelIsArea);
  directory.add(kGeoKeyDirectory, keys.shorts());
  if (!keys.doubles().empty()) directory.add(kGeoDoubleParams, keys.doubles());
  if (!keys.ascii().empty()) directory.add(kGeoAsciiParams, keys.ascii());
}

/// Adds a length with the shortest type that fits, as libtiff does.
void add_length(TiffDirectory& directory, std::uint32_t tag, std::uint32_t length) {
  if (length <= 0xFFFF) {
    directory.add(tag, std::vector<std::uint16_t>{static_cast<std::uint16_t>(length)});
  } else {
    directory.add(tag, std::vector<std::uint32_t>{length});
  }
}

std::uint16_t format_of(ScalarType type) {
  switch (type) {
    case ScalarType::f32:
    case ScalarType::f64:
      return SAMPLEFORMAT_IEEEFP;
    case ScalarType::i8:
    case ScalarType::i16:
    case ScalarType::i32:
    case ScalarType::i64:
      return SAMPLEFORMAT_INT;
    case ScalarType::u8:
    case ScalarType::u16:
    case ScalarType::u32:
    case ScalarType::u64:
      break;
  }
  return SAMPLEFORMAT_UINT;
}

std::uint16_t code_of(GeoTiffCompression compression) {
  switch (compression) {
    case GeoTiffCompression::none:
      return COMPRESSION_NONE;
    case GeoTiffCompression::deflate:
      return COMPRESSION_ADOBE_DEFLATE;
    case GeoTiffCompression::zstd:
      break;
  }
  return COMPRESSION_ZSTD;
}

}  // namespace

template <class T>
void TiffDirectory::add(std::uint32_t tag, std::uint16_t type, const std::vector<T>& values) {
  assert(!values.empty());
  Entry& entry = entries_[static_cast<std::uint16_t>(tag)];
  entry = {.type = type, .count = values.size(), .values = {}};
  entry.values.assign(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

void TiffDirectory::add(std::uint32_t tag, const std::vector<std::uint16_t>& values) {
  add(tag, TIFF_SHORT, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::vector<std::uint32_t>& values) {
  add(tag, TIFF_LONG, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::vector<std::uint64_t>& values) {
  add(tag, TIFF_LONG8, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::vector<double>& values) {
  add(tag, TIFF_DOUBLE, values);
}
void TiffDirectory::add(std::uint32_t tag, const std::string& text) {
  add(tag, TIFF_ASCII, std::vector<char>(text.c_str(), text.c_str() + text.size() + 1));
}

std::string TiffDirectory::bytes(bool big, std::uint64_t at, std::uint64_t next) const {
  assert(at % 2 == 0);
  const std::size_t offset_bytes = big ? 8 : 4, count_bytes = big ? 8 : 2;
  const std::size_t entry_bytes = 4 + 2 * offset_bytes;
  std::string head, values;
  const std::uint64_t values_at = at + count_bytes + entries_.size() * entry_bytes + offset_bytes;
  if (big) {
    append_native(head, std::uint64_t{entries_.size()});
  } else {
    append_native(head, static_cast<std::uint16_t>(entries_.size()));
  }
  for (const auto& [tag, entry] : entries_) {
    append_native(head, tag);
    append_native(head, entry.type);
    append_size(head, big, entry.count);
    if (entry.values.size() <= offset_bytes) {
      head += entry.values;
      head.append(offset_bytes - entry.values.size(), '\0');
    } else {
      append_size(head, big, values_at + values.size());
      values += entry.values;
      values.append(values.size() % 2, '\0');
    }
  }
  append_size(head, big, next);
  return head + values;
}

std::string tiff_head(bool big, std::uint64_t first) {
  std::string head = std::endian::native == std::endian::little ? "II" : "MM";
  append_native(head, static_cast<std::uint16_t>(big ? 43 : 42));
  if (big) {
    append_native(head, std::uint16_t{8});
    append_native(head, std::uint16_t{0});
  }
  append_size(head, big, first);
  return head;
}

TiffDirectory tags_of(const GeoTiffOptions& options, unsigned level, std::uint32_t columns,
                      std::uint32_t rows) {
  using Shorts = std::vector<std::uint16_t>;
  const std::uint16_t format = format_of(options.sample.type);
  TiffDirectory directory;
  if (level > 0)
    directory.add(TIFFTAG_SUBFILETYPE, std::vector<std::uint32_t>{FILETYPE_REDUCEDIMAGE});
  add_length(directory, TIFFTAG_IMAGEWIDTH, columns);
  add_length(directory, TIFFTAG_IMAGELENGTH, rows);
  const auto bits = static_cast<std::uint16_t>(8 * size_of(options.sample.type));
  directory.add(TIFFTAG_BITSPERSAMPLE, Shorts{bits});
  directory.add(TIFFTAG_COMPRESSION, Shorts{code_of(options.compression)});
  directory.add(TIFFTAG_PHOTOMETRIC, Shorts{PHOTOMETRIC_MINISBLACK});
  directory.add(TIFFTAG_SAMPLESPERPIXEL, Shorts{1});
  directory.add(TIFFTAG_PLANARCONFIG, Shorts{PLANARCONFIG_CONTIG});
  directory.add(TIFFTAG_SOFTWARE, "terrace");
  if (options.compression != GeoTiffCompression::none && options.predictor) {
    const bool floats = format == SAMPLEFORMAT_IEEEFP;
    directory.add(TIFFTAG_PREDICTOR, Shorts{static_cast<std::uint16_t>(
                                         floats ? PREDICTOR_FLOATINGPOINT : PREDICTOR_HORIZONTAL)});
  }
  add_length(directory, TIFFTAG_TILEWIDTH, options.tile);
  add_length(directory, TIFFTAG_TILELENGTH, options.tile);
  directory.add(TIFFTAG_SAMPLEFORMAT, Shorts{format});
  if (level == 0) {
    add_georeference(directory, options);
    const std::string metadata = metadata_of(options.sample);
    if (!metadata.empty()) directory.add(kGdalMetadata, metadata);
  }
  if (options.nodata) directory.add(kGdalNodata, shortest(*options.nodata));
  return directory;
}

}  // namespace terrace::stream
