// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <terrace/stream/schema.hpp>

namespace terrace::viewer {

/// How a point is drawn, apart from its position.
struct CloudColour {
  std::array<std::uint8_t, 3> rgb{};
  std::uint8_t group = 0;      ///< its class
  std::uint8_t intensity = 0;  ///< stretched over the store's range
};

/// Colours, classes and intensities from the attributes of a cloud, in 8 bits each.
class CloudColours {
 public:
  CloudColours() = default;
  /// `records` are those of points from the whole store, such as its root's; they determine the
  /// range of the values. 16-bit colours that never exceed 255 are taken for 8-bit colours, as in
  /// many files. Intensities are stretched between the 2nd and the 98th percentile.
  CloudColours(const stream::Schema& schema, std::span<const std::byte> records);

  [[nodiscard]] bool has_rgb() const { return rgb_[0] && rgb_[1] && rgb_[2]; }
  [[nodiscard]] bool has_group() const { return group_.has_value(); }
  [[nodiscard]] bool has_intensity() const { return intensity_.has_value(); }
  /// Returns the classes of `records`, ascending.
  [[nodiscard]] const std::vector<std::uint8_t>& groups() const { return groups_; }

  [[nodiscard]] CloudColour operator()(std::span<const std::byte> record) const;

 private:
  /// A column of the records, with its mapping to 0 ... 255.
  struct Column {
    stream::ScalarType type{};
    std::size_t offset = 0;
    double low = 0, scale = 1;

    [[nodiscard]] double value(std::span<const std::byte> record) const {
      return stream::to_double(type, record.data() + offset);
    }
    [[nodiscard]] std::uint8_t shown(std::span<const std::byte> record) const;
  };

  static std::optional<Column> find(const stream::Schema& schema, const char* name);

  std::array<std::optional<Column>, 3> rgb_;
  std::optional<Column> group_, intensity_;
  std::vector<std::uint8_t> groups_;
};

}  // namespace terrace::viewer
