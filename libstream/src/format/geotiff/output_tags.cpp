// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/output_tags.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <tiff.h>

#include "format/geotiff/keys.hpp"
#include "format/geotiff/tags.hpp"

namespace terrace::stream {
namespace {

/// The shortest text that reads back as the same number.
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
