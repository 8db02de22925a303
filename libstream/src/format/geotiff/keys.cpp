// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/keys.hpp"

#include <algorithm>
#include <utility>

#include "format/geotiff/tags.hpp"
#include "io/text.hpp"

namespace terrace::stream {
namespace {

/// Codes of units (EPSG 9001 ...) that heights and coordinates come in.
std::string unit_name(std::uint16_t code) {
  switch (code) {
    case 9001:
      return "metre";
    case 9002:
      return "foot";
    case 9003:
      return "US survey foot";
    case 9036:
      return "kilometre";
    case 9101:
      return "radian";
    case 9102:
      return "degree";
    case 9103:
      return "arc-minute";
    case 9104:
      return "arc-second";
    case 9105:
      return "grad";
    default:
      return code == 0 || code == kUserDefined ? std::string() : "EPSG:" + std::to_string(code);
  }
}

int epsg_of(std::optional<std::uint16_t> code) {
  return code && *code != 0 && *code < kUserDefined ? *code : 0;
}

}  // namespace

GeoKeys::GeoKeys(std::span<const std::uint16_t> directory, std::span<const double> doubles,
                 const std::string& ascii) {
  if (directory.empty()) return;
  if (directory.size() < 4) {
    faults_.push_back("GeoKeyDirectory is cut short");
    return;
  }
  const std::size_t there = directory.size() / 4 - 1;
  std::size_t count = directory[3];
  if (count > there) {
    faults_.push_back("GeoKeyDirectory claims " + counted(count, "key") + " and has " +
                      std::to_string(there));
    count = there;
  }
  for (std::size_t i = 1; i <= count; ++i) {
    const std::uint16_t key = directory[4 * i], place = directory[4 * i + 1],
                        length = directory[4 * i + 2], value = directory[4 * i + 3];
    if (place == 0) {
      numbers_[key] = value;
    } else if (place == kGeoKeyDirectory && value < directory.size()) {
      numbers_[key] = directory[value];
    } else if (place == kGeoAsciiParams) {
      if (value > ascii.size() || length > ascii.size() - value) {
        faults_.push_back("GeoKey " + std::to_string(key) + " points outside GeoAsciiParams");
        continue;
      }
      std::string text = ascii.substr(value, length);
      while (!text.empty() && (text.back() == '|' || text.back() == '\0')) text.pop_back();
      texts_[key] = text;
    } else if (place == kGeoDoubleParams) {
      if (value > doubles.size() || length > doubles.size() - value) {
        faults_.push_back("GeoKey " + std::to_string(key) + " points outside GeoDoubleParams");
        continue;
      }
      const auto part = doubles.subspan(value, length);
      doubles_[key].assign(part.begin(), part.end());
    }
  }
}

std::optional<std::uint16_t> GeoKeys::number(std::uint16_t key) const {
  const auto found = numbers_.find(key);
  if (found == numbers_.end()) return std::nullopt;
  return found->second;
}

std::string GeoKeys::text(std::uint16_t key) const {
  const auto found = texts_.find(key);
  return found == texts_.end() ? std::string() : found->second;
}

std::vector<GeoKey> GeoKeys::range(std::uint16_t first, std::uint16_t last) const {
  std::vector<GeoKey> found;
  const auto within = [first, last](std::uint16_t key) { return first <= key && key <= last; };
  for (const auto& [key, value] : numbers_) {
    if (within(key)) found.push_back({.key = key, .values = {static_cast<double>(value)}});
  }
  for (const auto& [key, values] : doubles_) {
    if (within(key)) found.push_back({.key = key, .values = values});
  }
  for (const auto& [key, text] : texts_) {
    if (within(key)) found.push_back({.key = key, .text = text});
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const GeoKey& a, const GeoKey& b) { return a.key < b.key; });
  return found;
}

Crs crs_of(const GeoKeys& keys) {
  Crs crs;
  const auto projected = keys.number(kProjectedCrs), geodetic = keys.number(kGeodeticCrs);
  std::uint16_t model = keys.number(kGTModelType).value_or(0);
  if (model != kModelProjected && model != kModelGeographic && model != kModelGeocentric) {
    // Under a user-defined model, the name of a projected CRS may be its whole definition.
    const bool named = !keys.text(kProjectedCitation).empty();
    model = projected || named ? kModelProjected : geodetic ? kModelGeographic : 0;
  }
  crs.geographic = model == kModelGeographic;
  crs.epsg = epsg_of(model == kModelProjected ? projected : geodetic);
  if (model == 0) crs.epsg = 0;
  crs.vertical_epsg = epsg_of(keys.number(kVerticalCrs));
  const std::uint16_t of_model = crs.geographic ? kGeodeticCitation : kProjectedCitation;
  for (const std::uint16_t key : {of_model, kGTCitation, kGeodeticCitation}) {
    if (crs.name.empty()) crs.name = keys.text(key);
  }
  if (crs.geographic) {
    crs.horizontal_unit = unit_name(keys.number(kAngularUnit).value_or(9102));
  } else {
    crs.horizontal_unit = unit_name(keys.number(kLinearUnit).value_or(0));
  }
  crs.vertical_unit = unit_name(keys.number(kVerticalUnit).value_or(0));
  constexpr std::uint16_t kLastOfCrs = 5119;  // of the vertical keys
  crs.geo_keys = keys.range(kGTModelType, kGTModelType);
  for (GeoKey& key : keys.range(kGeodeticCrs, kLastOfCrs)) crs.geo_keys.push_back(std::move(key));
  return crs;
}

}  // namespace terrace::stream
