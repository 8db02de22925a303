// SPDX-License-Identifier: Apache-2.0
#include "format/las/stream.hpp"

#include <array>
#include <cstddef>
#include <utility>

#include <fmt/core.h>

#include "format/las/fields.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// More than this means a corrupt header.
constexpr std::size_t kMostExtraBytes = 2048;

}  // namespace

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
  if (header.record_bytes - standard > kMostExtraBytes) {
    throw Error(name, fmt::format("its records have {} extra bytes; up to {} are read",
                                  header.record_bytes - standard, kMostExtraBytes))
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
