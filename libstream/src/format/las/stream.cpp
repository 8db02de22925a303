// SPDX-License-Identifier: Apache-2.0
#include "format/las/stream.hpp"

#include <array>
#include <cstddef>
#include <utility>

#include "format/las/fields.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// More than this means a corrupt header.
constexpr std::size_t kMostExtraBytes = 2048;

}  // namespace

RecordStream las_stream(const LasHeader& header, const std::string& name,
                        std::vector<std::string> comments) {
  const std::size_t standard = las_record_bytes(header.point_format);
  if (header.record_bytes - standard > kMostExtraBytes) {
    throw Error({.file = name,
                 .where = "header",
                 .cause = "its records have " + std::to_string(header.record_bytes - standard) +
                          " extra bytes; up to " + std::to_string(kMostExtraBytes) + " are read",
                 .remedy = "the file is damaged or its header is wrong"});
  }
  RecordStream stream{.record_bytes = header.record_bytes, .points = header.points};
  SourceInfo& info = stream.info;
  info.comments = std::move(comments);
  constexpr std::array kNames{"x", "y", "z"};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    info.coordinates[axis] = {.name = kNames[axis], .type = ScalarType::i32};
  }
  info.world.xy = {header.scale[0], 0, header.offset[0], 0, header.scale[1], header.offset[1]};
  info.coordinates[2].scale = header.scale[2];
  info.coordinates[2].offset = header.offset[2];

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
