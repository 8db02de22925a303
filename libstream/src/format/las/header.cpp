// SPDX-License-Identifier: Apache-2.0
#include "format/las/header.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "format/copc/hierarchy.hpp"
#include "format/geotiff/keys.hpp"
#include "format/geotiff/tags.hpp"
#include "format/las/fields.hpp"
#include "io/bytes.hpp"
#include "io/number.hpp"
#include "io/peek.hpp"
#include "io/text.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/laz.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {
namespace {

constexpr char kBadHeader[] = "the file is damaged or its header is wrong: export it again";
/// Length of the user's name in VLRs and EVLRs.
constexpr std::size_t kUserBytes = 16;
/// The WKT of a file takes a few kilobytes, about a hundred if it includes a vertical grid.
constexpr std::uint64_t kMaxEvlrBytes = 1u << 20;
constexpr std::uint64_t kMaxEvlrs = 1u << 16;

Error header_fault(const Input& input, std::string cause) {
  return Error(input.name(), std::move(cause)).at("header").remedy(kBadHeader);
}

std::string text_of_field(const char* at, std::size_t bytes) {
  const std::string_view field(at, bytes);
  return std::string(field.substr(0, field.find('\0')));
}

/// True if a record contains something that is used here.
bool is_used(const LasVlr& record) {
  if (record.is(kCopcUser, kCopcInfo)) return true;
  if (record.is(kLasSpec, kLasExtraBytes) || record.is(laz::Vlr::kUserId, laz::Vlr::kRecordId))
    return true;
  // libLAS wrote WKT under its own name.
  if (record.is("liblas", kLasWkt)) return true;
  return record.user == kLasProjection &&
         (record.id == kLasWkt || record.id == kGeoKeyDirectory || record.id == kGeoDoubleParams ||
          record.id == kGeoAsciiParams);
}

/// Reads the records between the header and the points. Does not rely on their number, because some
/// writers miscount them.
void read_vlrs(Input& input, std::uint32_t count, LasHeader& header,
               std::vector<std::string>& comments) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint64_t remaining = header.points_offset - input.offset();
    if (remaining < kLasVlrHeaderBytes) {
      comments.push_back(fmt::format("the header counts {} VLRs, but there are {}", count, i));
      return;
    }
    const std::string_view head = input.fill(kLasVlrHeaderBytes);
    if (head.size() < kLasVlrHeaderBytes)
      throw header_fault(input, "the file ends too early").at(fmt::format("VLR {}", i));
    LasVlr record{.user = text_of_field(head.data() + 2, kUserBytes),
                  .id = load_little_endian<std::uint16_t>(head.data() + 18),
                  .data = {}};
    const std::size_t bytes = load_little_endian<std::uint16_t>(head.data() + 20);
    if (bytes > remaining - kLasVlrHeaderBytes) {
      comments.push_back(
          fmt::format("VLR {} extends into the points: it and the rest are ignored", i));
      return;
    }
    input.consume(kLasVlrHeaderBytes);
    if (!is_used(record)) {
      if (!input.skip(bytes))
        throw header_fault(input, "the file ends too early").at(fmt::format("VLR {}", i));
      continue;
    }
    const std::string_view data = input.fill(bytes);
    if (data.size() < bytes)
      throw header_fault(input, "the file ends too early").at(fmt::format("VLR {}", i));
    record.data = data.substr(0, bytes);
    input.consume(bytes);
    header.vlrs.push_back(std::move(record));
  }
}

void read_evlrs(const ByteSource& file, std::uint64_t at, std::uint32_t count, LasHeader& header,
                std::vector<std::string>& comments) {
  std::array<char, kLasEvlrHeaderBytes> head{};
  for (std::uint32_t i = 0; i < count; ++i) {
    if (at > file.size() || file.size() - at < kLasEvlrHeaderBytes || i == kMaxEvlrs) {
      comments.push_back(fmt::format("the header counts {} EVLRs, but only {} are read", count, i));
      return;
    }
    file.read(at, std::as_writable_bytes(std::span(head)));
    at += kLasEvlrHeaderBytes;
    LasVlr record{.user = text_of_field(head.data() + 2, kUserBytes),
                  .id = load_little_endian<std::uint16_t>(head.data() + 18),
                  .data = {}};
    const auto bytes = load_little_endian<std::uint64_t>(head.data() + 20);
    if (bytes > file.size() - at) {
      comments.push_back(fmt::format("EVLR {} is truncated", i));
      return;
    }
    if (is_used(record) && bytes <= kMaxEvlrBytes) {
      record.data.resize(bytes);
      file.read(at, std::as_writable_bytes(std::span(record.data)));
      header.vlrs.push_back(std::move(record));
    }
    at += bytes;
  }
}

/// Returns a record's data as an array of numbers.
template <class T>
std::vector<T> array_of(const std::string& data) {
  std::vector<T> values(data.size() / sizeof(T));
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = load_little_endian<T>(data.data() + i * sizeof(T));
  }
  return values;
}

const LasVlr* find_record(const LasHeader& header, std::uint16_t id) {
  for (const LasVlr& record : header.vlrs) {
    if (record.id == id && (record.user == kLasProjection || record.user == "liblas")) {
      return &record;
    }
  }
  return nullptr;
}

std::string wkt_of_records(const LasHeader& header, std::vector<std::string>& comments) {
  const LasVlr* const record = find_record(header, kLasWkt);
  if (record == nullptr) return {};
  std::string wkt = record->data.substr(0, record->data.find('\0'));
  while (!wkt.empty() && static_cast<unsigned char>(wkt.back()) <= ' ') wkt.pop_back();
  if (wkt.empty() || wkt.find('[') != wkt.npos) return wkt;
  comments.emplace_back("the WKT record does not contain WKT and is ignored");
  return {};
}

Crs crs_of_key_records(const LasHeader& header, std::vector<std::string>& comments) {
  const auto data = [&](std::uint32_t id) {
    const LasVlr* const record = find_record(header, static_cast<std::uint16_t>(id));
    return record == nullptr ? std::string() : record->data;
  };
  const GeoKeys keys(array_of<std::uint16_t>(data(kGeoKeyDirectory)),
                     array_of<double>(data(kGeoDoubleParams)), data(kGeoAsciiParams));
  comments.insert(comments.end(), keys.faults().begin(), keys.faults().end());
  return crs_of(keys);
}

void read_lattice(const char* head, LasHeader& header) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    header.scale[axis] = load_little_endian<double>(head + 131 + 8 * axis);
    header.offset[axis] = load_little_endian<double>(head + 155 + 8 * axis);
    header.bounds.max[axis] = load_little_endian<double>(head + 179 + 16 * axis);
    header.bounds.min[axis] = load_little_endian<double>(head + 187 + 16 * axis);
  }
  // Some writers do not fill in the box and leave it at 0.
  const auto& [low, high] = header.bounds;
  const bool is_finite = std::isfinite(low[0] + low[1] + low[2] + high[0] + high[1] + high[2]);
  if (!is_finite || low == high) header.bounds = {};
}

bool has_lattice(const LasHeader& header) {
  // The product of two is the determinant of the transform.
  const double cell = header.scale[0] * header.scale[1];
  bool is_sound = cell > 0 && std::isfinite(cell);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    is_sound = is_sound && header.scale[axis] > 0 && std::isfinite(header.scale[axis]) &&
               std::isfinite(header.offset[axis]);
  }
  return is_sound;
}

/// True if GeoKeys name a system at all.
bool names_something(const Crs& crs) {
  return crs.epsg != 0 || crs.vertical_epsg != 0 || !crs.geo_keys.empty() || !crs.name.empty();
}

/// Returns the unit of the vertical CRS in WKT 1 or 2, or of a third axis that points up; empty if
/// there is none, or its unit is not known.
std::string height_unit_of_wkt(std::string_view wkt) {
  constexpr std::array<std::string_view, 5> kBegins{"VERT_CS[", "VERTCS[", "VERTCRS[",
                                                    "VERTICALCRS[", "\",up,"};
  std::size_t at = wkt.npos;
  for (std::size_t i = 0; i < kBegins.size() && at == wkt.npos; ++i) at = wkt.find(kBegins[i]);
  constexpr std::string_view kUnit = "UNIT[\"";
  at = at == wkt.npos ? at : wkt.find(kUnit, at);
  if (at == wkt.npos) return {};
  const std::string_view rest = wkt.substr(at + kUnit.size());
  const std::size_t quote = rest.find('"');
  if (quote >= rest.size()) return {};
  // Its length says more than its name, which ESRI and others spell in their own ways.
  double metres = 0;
  const std::size_t comma = rest.find(',', quote);
  if (comma != rest.npos) {
    std::string_view number = rest.substr(comma + 1);
    number.remove_prefix(std::min(number.find_first_not_of(' '), number.size()));
    parse_real(number.data(), number.data() + number.size(), metres);
  }
  constexpr std::array<std::pair<double, const char*>, 3> kLengths{
      {{1, "metre"}, {0.3048, "foot"}, {1200.0 / 3937.0, "US survey foot"}}};
  for (const auto& [length, name] : kLengths) {
    if (std::abs(metres / length - 1) < 1e-9) return name;
  }
  std::string name = canonical_unit(rest.substr(0, quote));
  return is_length_unit(name) ? name : std::string();
}

/// The CRS named by the records that were read.
Crs recorded_crs(const LasHeader& header, std::vector<std::string>& comments) {
  Crs by_wkt;
  by_wkt.wkt = wkt_of_records(header, comments);
  if (header.wkt && !by_wkt.wkt.empty()) return by_wkt;
  Crs by_keys = crs_of_key_records(header, comments);
  return names_something(by_keys) ? by_keys : by_wkt;
}

/// Returns the header's bytes, after checks of signature, version and size; sets the version.
std::string_view read_bytes(Input& input, LasHeader& header) {
  const std::string_view first = input.fill(kLasFirstBytes);
  if (!first.starts_with("LASF")) {
    throw header_fault(input, "does not begin with 'LASF'").remedy("this is not a LAS file");
  }
  if (first.size() < kLasFirstBytes) throw header_fault(input, "the file ends in its header");
  const auto major = static_cast<unsigned char>(first[24]);
  header.minor = static_cast<unsigned char>(first[25]);
  if (major != 1 || header.minor > 4) {
    throw header_fault(
        input, fmt::format("is LAS {}.{}; versions 1.0 to 1.4 are read", major, header.minor))
        .remedy("convert it, e.g. 'pdal translate FILE out.las'");
  }
  const std::size_t bytes = load_little_endian<std::uint16_t>(first.data() + 94);
  const std::size_t min_bytes = header.minor == 4   ? kLas14HeaderBytes
                                : header.minor == 3 ? std::size_t{235}
                                                    : kLasFirstBytes;
  if (bytes < min_bytes) {
    throw header_fault(input, fmt::format("says that it has {}; LAS 1.{} has {}",
                                          counted(bytes, "byte"), header.minor, min_bytes));
  }
  const std::string_view bytes_read = input.fill(bytes);
  if (bytes_read.size() < bytes) throw header_fault(input, "the file ends in its header");
  return bytes_read.substr(0, bytes);
}

/// Fields of the header that only the reading of the header needs.
struct RecordFields {
  std::uint32_t vlrs = 0, evlrs = 0;
  std::uint64_t evlr_offset = 0;
  bool waveforms = false;  ///< their packets may follow the points
};

RecordFields read_fields(const char* at, LasHeader& header, std::vector<std::string>& comments) {
  RecordFields fields;
  const unsigned encoding = load_little_endian<std::uint16_t>(at + 6);
  header.adjusted_time = (encoding & 1U) != 0;
  header.wkt = (encoding & 16U) != 0;
  fields.waveforms = header.minor == 3 || (encoding & 2U) != 0;
  header.points_offset = load_little_endian<std::uint32_t>(at + 96);
  fields.vlrs = load_little_endian<std::uint32_t>(at + 100);
  const auto type = static_cast<unsigned char>(at[104]);
  header.compressed = (type & 0xC0U) != 0;
  header.point_format = type & 0x3FU;
  header.record_bytes = load_little_endian<std::uint16_t>(at + 105);
  header.points = load_little_endian<std::uint32_t>(at + 107);
  read_lattice(at, header);
  if (header.minor < 4) return fields;
  fields.evlr_offset = load_little_endian<std::uint64_t>(at + 235);
  fields.evlrs = load_little_endian<std::uint32_t>(at + 243);
  const auto points = load_little_endian<std::uint64_t>(at + 247);
  if (header.points != 0 && points != 0 && points != header.points) {
    comments.push_back(
        fmt::format("the header counts {} and, for old readers, {}: the former is used",
                    counted(points, "point"), header.points));
  }
  if (points != 0) header.points = points;
  return fields;
}

void check_fields(const Input& input, const LasHeader& header, std::size_t header_bytes) {
  if (header.point_format > kLastLasPointFormat) {
    throw header_fault(
        input, fmt::format("point format {} is not known; 0 to 10 are", header.point_format));
  }
  const std::size_t record = las_record_bytes(header.point_format);
  if (header.record_bytes < record) {
    throw header_fault(
        input, fmt::format("records of point format {} take {}, not {}", header.point_format,
                           counted(record, "byte"), header.record_bytes));
  }
  if (header.points_offset < header_bytes) {
    throw header_fault(input, "the points begin inside the header");
  }
  if (!has_lattice(header)) {
    throw header_fault(input, "the scale is not positive, or scale or offset are not finite");
  }
}

/// Compares the number of points with the size of an uncompressed file.
void count_records(const Input& input, std::uint64_t file_bytes, const RecordFields& fields,
                   LasHeader& header) {
  const std::uint64_t remaining = file_bytes - std::min(file_bytes, header.points_offset);
  if (header.points > remaining / header.record_bytes) {
    throw header_fault(
        input, fmt::format("the header promises {} of {}, but only {}{} left",
                           counted(header.points, "point"), counted(header.record_bytes, "byte"),
                           counted(remaining, "byte"), remaining == 1 ? " is" : " are"))
        .at_byte(header.points_offset)
        .remedy("the file is truncated or its header is wrong: download it again");
  }
  const std::uint64_t end = fields.evlrs > 0 ? fields.evlr_offset : file_bytes;
  if (!fields.waveforms && end <= file_bytes && end > header.points_offset) {
    const std::uint64_t complete_records = (end - header.points_offset) / header.record_bytes;
    header.uncounted_records = complete_records - std::min(complete_records, header.points);
  }
}

/// More than this means a corrupt header.
constexpr std::size_t kMaxExtraBytes = 2048;

}  // namespace

LasHeader read_las_header(Input& input, const std::string& file, std::vector<std::string>& comments,
                          const OnDamage& on_damage) {
  LasHeader header;
  const std::string_view bytes = read_bytes(input, header);
  const std::size_t header_bytes = bytes.size();
  const RecordFields fields = read_fields(bytes.data(), header, comments);
  input.consume(header_bytes);
  check_fields(input, header, header_bytes);
  if (header.scale[0] != header.scale[1]) {
    comments.emplace_back(
        "x and y have steps of different sizes; triangulations are Delaunay in units of steps");
  }
  if (const auto size = input.size(); size && !header.compressed && !on_damage) {
    count_records(input, *size, fields, header);
  }
  read_vlrs(input, fields.vlrs, header, comments);
  if (fields.evlrs > 0 && is_seekable(file)) {
    try {
      read_evlrs(*open_file(file), fields.evlr_offset, fields.evlrs, header, comments);
    } catch (const Error& damage) {
      if (!on_damage) throw;
      on_damage(damage, 0);
    }
  } else {
    header.has_unread_evlrs = fields.evlrs > 0;
  }
  if (!input.skip(header.points_offset - input.offset())) {
    throw header_fault(input, "the file ends before its points").at_byte(input.offset());
  }
  return header;
}

std::optional<LasHeader> peek_las_header(std::string_view head) {
  if (head.size() < kLasFirstBytes || !head.starts_with("LASF")) return std::nullopt;
  LasHeader header;
  read_lattice(head.data(), header);
  return has_lattice(header) ? std::optional(header) : std::nullopt;
}

Crs las_crs(const LasHeader& header, const std::string& name, std::vector<std::string>& comments) {
  std::vector<std::string> ignored;
  if (header.wkt && header.has_unread_evlrs && wkt_of_records(header, ignored).empty()) {
    throw Error(name,
                "the record of its coordinate reference system (an EVLR) follows the points, so it "
                "cannot be read from a pipe")
        .remedy(message("name the file, or the system: {crs} EPSG:n"));
  }
  return recorded_crs(header, comments);
}

Crs with_own_height_unit(Crs crs, const Crs& file_crs) {
  if (crs.vertical_epsg == 0 && crs.vertical_unit.empty()) {
    crs.vertical_unit =
        file_crs.vertical_unit.empty() ? height_unit_of_wkt(file_crs.wkt) : file_crs.vertical_unit;
  }
  return crs;
}

Crs las_crs_overridden(const LasHeader& header, const Crs& crs) {
  std::vector<std::string> ignored;
  Crs file_crs = recorded_crs(header, ignored);
  // GeoKeys may name a unit and nothing else.
  if (file_crs.wkt.empty())
    file_crs.vertical_unit = crs_of_key_records(header, ignored).vertical_unit;
  return with_own_height_unit(crs, file_crs);
}

Placement las_placement(const LasHeader& header) {
  const Point3 &scale = header.scale, &offset = header.offset;
  return {.world = {.xy = {scale[0], 0, offset[0], 0, scale[1], offset[1]}},
          .coordinates =
              {Channel{.name = "x", .type = ScalarType::i32},
               {.name = "y", .type = ScalarType::i32},
               {.name = "z", .type = ScalarType::i32, .scale = scale[2], .offset = offset[2]}},
          .crs = {}};
}

RecordStream las_stream(const LasHeader& header, const std::string& name,
                        std::vector<std::string> comments) {
  const std::size_t standard = las_record_bytes(header.point_format);
  if (header.record_bytes - standard > kMaxExtraBytes) {
    throw Error(name, fmt::format("its records have {} extra bytes; up to {} are read",
                                  header.record_bytes - standard, kMaxExtraBytes))
        .at("header")
        .remedy("the file is damaged or its header is wrong: export it again");
  }
  RecordStream stream{.record_bytes = header.record_bytes, .points = header.points};
  SourceInfo& info = stream.info;
  info.comments = std::move(comments);
  static_cast<Placement&>(info) = las_placement(header);

  stream.fields = las_fields(header.point_format, header.adjusted_time);
  std::string descriptions;
  for (const LasVlr& record : header.vlrs) {
    if (record.is(kLasSpec, kLasExtraBytes)) descriptions += record.data;
  }
  const std::vector<LasField> extra =
      las_extra_fields(descriptions, standard, header.record_bytes, stream.fields, info.comments);
  stream.fields.insert(stream.fields.end(), extra.begin(), extra.end());
  for (const LasField& field : stream.fields) info.attributes.push_back(field.channel);
  return stream;
}

}  // namespace terrace::stream
