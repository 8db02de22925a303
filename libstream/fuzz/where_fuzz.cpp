// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz_points.hpp"
#include "terrace/stream/where.hpp"

namespace terrace::stream {
namespace {

/// Points with an attribute of each type, two of them with a scale, made from bytes that are
/// repeated as needed.
struct Points {
  Schema schema;
  std::vector<Point3> positions;
  std::vector<std::byte> records;

  explicit Points(std::string_view bytes) {
    constexpr std::array<const char*, 10> kNames{
        "key_point",     "classification",    "scan_angle", "intensity", "user data",
        "return_number", "number_of_returns", "id",         "\"",        "gps_time"};
    for (std::size_t type = 0; type < kNames.size(); ++type) {
      schema.attributes.push_back(
          {.name = kNames[type], .type = static_cast<ScalarType>(type), .unit = {}});
    }
    schema.attributes[2].scale = 0.006;
    schema.attributes[4].offset = -7.5;
    std::size_t at = 0;
    const auto next = [&] {
      return static_cast<std::byte>(bytes.empty() ? 0 : bytes[at++ % bytes.size()]);
    };
    for (int i = 0; i < 5; ++i) {
      const auto coordinate = [&] {
        return static_cast<double>(static_cast<std::int8_t>(next())) / 4;
      };
      positions.push_back({coordinate(), coordinate(), coordinate()});
      for (std::size_t byte = 0; byte < schema.payload_size(); ++byte) records.push_back(next());
    }
  }

  [[nodiscard]] std::size_t record_bytes() const { return schema.payload_size(); }

  /// Returns the exact ranges of the attributes of some of the points.
  [[nodiscard]] std::vector<ValueRange> ranges(std::size_t begin, std::size_t end) const {
    std::vector<ValueRange> ranges;
    for (std::size_t a = 0; a < schema.attributes.size(); ++a) {
      const Channel& channel = schema.attributes[a];
      ValueRange range{.low = INFINITY, .high = -INFINITY, .nan = false};
      for (std::size_t i = begin; i < end; ++i) {
        const std::byte* const at =
            records.data() + i * record_bytes() + schema.attribute_offset(a);
        const double value = to_double(channel.type, at) * channel.scale + channel.offset;
        if (value != value) {
          range.nan = true;
        } else {
          range.low = std::min(range.low, value);
          range.high = std::max(range.high, value);
        }
      }
      ranges.push_back(range.low <= range.high ? range : ValueRange{});
    }
    return ranges;
  }
};

}  // namespace
}  // namespace terrace::stream

/// A line of any text is a condition, or is refused with the position of a character. Whether a
/// point meets a condition does not depend on the points tested with it, and if it does, possible()
/// is true for its box and ranges.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace terrace::stream;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const std::size_t end = std::min(bytes.find('\n'), size);
  const Points points(bytes.substr(std::min(end + 1, size)));
  const std::string text(bytes.substr(0, end));
  try {
    const Where where(text, points.schema);
    require(where.text() == text, "the text is kept");
    std::vector<std::uint8_t> matches(points.positions.size(), 7);
    where.test(points.positions, points.records, matches);
    Box3 box;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const std::span<const std::byte> record =
          std::span(points.records).subspan(i * points.record_bytes(), points.record_bytes());
      std::uint8_t alone = 7;
      where.test(std::span(points.positions).subspan(i, 1), record, std::span(&alone, 1));
      require(alone == matches[i] && alone <= 1, "a point's result does not depend on others");
      Box3 place;
      place.include(points.positions[i]);
      box.include(points.positions[i]);
      require(alone == 0 || where.possible(place, points.ranges(i, i + 1)),
              "a match is possible for its point");
    }
    const bool any = std::find(matches.begin(), matches.end(), 1) != matches.end();
    require(!any || where.possible(box, points.ranges(0, matches.size())),
            "a match is possible for all points");
    require(!any || where.possible(box, {}), "a match is possible without ranges");
  } catch (const Error& error) {
    require(!error.parts().cause.empty(), "errors have a cause");
  }
  return 0;
}
