// SPDX-License-Identifier: GPL-3.0-or-later
#include "cloud_colours.hpp"

#include <algorithm>

namespace terrace::viewer {

std::uint8_t CloudColours::Column::shown(std::span<const std::byte> record) const {
  const double v = (value(record) - low) * scale;
  if (!(v > 0)) return 0;  // NaN too
  return static_cast<std::uint8_t>(std::min(v, 255.0));
}

std::optional<CloudColours::Column> CloudColours::find(const stream::Schema& schema,
                                                       const char* name) {
  for (std::size_t i = 0; i < schema.attributes.size(); ++i) {
    if (schema.attributes[i].name != name) continue;
    return Column{.type = schema.attributes[i].type, .offset = schema.attribute_offset(i)};
  }
  return {};
}

CloudColours::CloudColours(const stream::Schema& schema, std::span<const std::byte> records)
    : rgb_{find(schema, "red"), find(schema, "green"), find(schema, "blue")},
      group_(find(schema, "classification")),
      intensity_(find(schema, "intensity")) {
  if (!group_) group_ = find(schema, "class");
  const std::size_t bytes = schema.payload_size(), count = bytes > 0 ? records.size() / bytes : 0;
  const auto for_each_record = [&](const auto& visit) {
    for (std::size_t i = 0; i < count; ++i) visit(records.subspan(i * bytes, bytes));
  };
  if (has_rgb()) {
    double most = 0;
    for_each_record([&](auto record) {
      for (const auto& channel : rgb_) most = std::max(most, channel->value(record));
    });
    // Formats with colour fields are often written without colours.
    if (most == 0) rgb_ = {};
    for (auto& channel : rgb_) {
      if (channel) channel->scale = most > 255 ? 1.0 / 257 : 1;
    }
  }
  if (intensity_ && count > 0) {
    std::vector<double> values;
    for_each_record([&](auto record) { values.push_back(intensity_->value(record)); });
    std::sort(values.begin(), values.end());
    const double low = values[count / 50], high = values[count - 1 - count / 50];
    intensity_->low = low;
    intensity_->scale = high > low ? 255 / (high - low) : 0;
  }
  if (group_) {
    for_each_record([&](auto record) { groups_.push_back(group_->shown(record)); });
    std::sort(groups_.begin(), groups_.end());
    groups_.erase(std::unique(groups_.begin(), groups_.end()), groups_.end());
  }
}

CloudColour CloudColours::operator()(std::span<const std::byte> record) const {
  CloudColour colour;
  if (record.empty()) return colour;
  if (has_rgb()) {
    for (std::size_t i = 0; i < 3; ++i) colour.rgb[i] = rgb_[i]->shown(record);
  }
  if (group_) colour.group = group_->shown(record);
  if (intensity_) colour.intensity = intensity_->shown(record);
  return colour;
}

}  // namespace terrace::viewer
