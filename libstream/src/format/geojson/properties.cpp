// SPDX-License-Identifier: Apache-2.0
#include "format/geojson/properties.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/core.h>

#include "io/distinct_names.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kMaxProperties = 256;

bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

PropertyColumns::PropertyColumns(std::string file, const SourceOptions& options, bool numbers_lines)
    : file_(std::move(file)),
      entities_(options.entities),
      selection_(options.selection),
      numbers_lines_(numbers_lines) {}

bool PropertyColumns::is_ignored(const std::string& name) const {
  return numbers_lines_ && name == "line";
}

void PropertyColumns::add(std::span<const GeoJsonProperty> properties) {
  for (const GeoJsonProperty& property : properties) {
    if (!is_ignored(property.name)) add(property.name);
  }
}

void PropertyColumns::add(const std::string& name) {
  if (!columns_.emplace(name, names_.size()).second) return;
  if (names_.size() == kMaxProperties) {
    throw Error(file_, fmt::format("has more than {} numeric properties", kMaxProperties))
        .remedy("remove some of them, e.g. by ogr2ogr -select");
  }
  names_.push_back(name);
}

std::vector<Channel> PropertyColumns::finish(bool complete, std::span<const Channel> shape) {
  DistinctNames distinct;
  for (const char* const axis : {"x", "y", "z"}) distinct.add(axis);
  for (const Channel& channel : shape) distinct.add(channel.name);
  std::vector<Channel> channels;
  std::vector<std::string> taken;
  for (const std::string& name : names_) {
    channels.push_back({.name = distinct.add(name.empty() ? "property" : name)});
    taken.push_back(channels.back().name);
  }
  if (complete) return channels;
  std::vector<std::string> selected = selection_.keep.value_or(std::vector<std::string>());
  selected.insert(selected.end(), selection_.drop.begin(), selection_.drop.end());
  for (const std::string& name : selected) {
    if (is_shape_column(name, entities_) || among(taken, name) || columns_.contains(name)) continue;
    add(name);
    channels.push_back({.name = distinct.add(name)});
    taken.push_back(name);
  }
  return channels;
}

std::size_t PropertyColumns::read(std::span<const GeoJsonProperty> properties, std::uint64_t offset,
                                  std::vector<double>& values) const {
  values.assign(names_.size(), std::numeric_limits<double>::quiet_NaN());
  std::vector<bool> given(names_.size(), false);
  for (const GeoJsonProperty& property : properties) {
    const auto column = columns_.find(property.name);
    if (column != columns_.end()) {
      values[column->second] = property.value;
      given[column->second] = true;
    } else if (!is_ignored(property.name) && !selection_.keep) {
      throw Error(file_, fmt::format("the number {} is not among the properties of the first "
                                     "features",
                                     in_quotes(property.name)))
          .at(fmt::format("the feature at byte {}", offset))
          .remedy(message("leave it out: {drop} {}; or list the properties to use: {keep}",
                          property.name));
    }
  }
  return static_cast<std::size_t>(std::count(given.begin(), given.end(), false));
}

}  // namespace terrace::stream
