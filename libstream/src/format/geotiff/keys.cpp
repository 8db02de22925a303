// SPDX-License-Identifier: Apache-2.0
#include "format/geotiff/keys.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include <fmt/core.h>

#include "format/geotiff/tags.hpp"
#include "io/text.hpp"

namespace terrace::stream {
namespace {

/// Units of heights and coordinates: their EPSG codes and their names in Crs.
struct UnitCode {
  std::uint16_t code;
  std::string_view name;
};
constexpr std::array<UnitCode, 17> kUnitCodes{{{9001, "metre"},
                                               {9002, "foot"},
                                               {9003, "US survey foot"},
                                               {9005, "Clarke's foot"},
                                               {9014, "fathom"},
                                               {9030, "nautical mile"},
                                               {9035, "US survey mile"},
                                               {9036, "kilometre"},
                                               {9093, "mile"},
                                               {9096, "yard"},
                                               {1025, "millimetre"},
                                               {1033, "centimetre"},
                                               {9101, "radian"},
                                               {9102, "degree"},
                                               {9103, "arc-minute"},
                                               {9104, "arc-second"},
                                               {9105, "grad"}}};

std::string unit_name(std::uint16_t code) {
  for (const UnitCode& unit : kUnitCodes) {
    if (unit.code == code) return std::string(unit.name);
  }
  return code == 0 || code == kUserDefined ? std::string() : fmt::format("EPSG:{}", code);
}

/// The EPSG code of a unit by its name in Crs, 0 if it has none.
std::uint16_t unit_code(std::string_view name) {
  for (const UnitCode& unit : kUnitCodes) {
    if (unit.name == name) return unit.code;
  }
  return 0;
}

int epsg_of(std::optional<std::uint16_t> code) {
  return code && *code != 0 && *code < kUserDefined ? *code : 0;
}

}  // namespace

GeoKeys::GeoKeys(std::span<const std::uint16_t> directory, std::span<const double> doubles,
                 const std::string& ascii) {
  if (directory.empty()) return;
  if (directory.size() < 4) {
    faults_.push_back("GeoKeyDirectory is truncated");
    return;
  }
  const std::size_t present = directory.size() / 4 - 1;
  std::size_t count = directory[3];
  if (count > present) {
    faults_.push_back(
        fmt::format("GeoKeyDirectory claims {} but has {}", counted(count, "key"), present));
    count = present;
  }
  for (std::size_t i = 1; i <= count; ++i) {
    const std::uint16_t key = directory[4 * i], location = directory[4 * i + 1],
                        length = directory[4 * i + 2], value = directory[4 * i + 3];
    if (location == 0) {
      numbers_[key] = value;
    } else if (location == kGeoKeyDirectory && value < directory.size()) {
      numbers_[key] = directory[value];
    } else if (location == kGeoAsciiParams) {
      if (value > ascii.size() || length > ascii.size() - value) {
        faults_.push_back(fmt::format("GeoKey {} points outside GeoAsciiParams", key));
        continue;
      }
      std::string text = ascii.substr(value, length);
      while (!text.empty() && (text.back() == '|' || text.back() == '\0')) text.pop_back();
      texts_[key] = text;
    } else if (location == kGeoDoubleParams) {
      if (value > doubles.size() || length > doubles.size() - value) {
        faults_.push_back(fmt::format("GeoKey {} points outside GeoDoubleParams", key));
        continue;
      }
      const auto part = doubles.subspan(value, length);
      doubles_[key].assign(part.begin(), part.end());
    }
  }
}

std::optional<std::uint16_t> GeoKeys::number(std::uint16_t key) const {
  const auto entry = numbers_.find(key);
  if (entry == numbers_.end()) return std::nullopt;
  return entry->second;
}

std::string GeoKeys::text(std::uint16_t key) const {
  const auto entry = texts_.find(key);
  return entry == texts_.end() ? std::string() : entry->second;
}

std::vector<GeoKey> GeoKeys::range(std::uint16_t first, std::uint16_t last) const {
  std::vector<GeoKey> keys;
  const auto within = [first, last](std::uint16_t key) { return first <= key && key <= last; };
  for (const auto& [key, value] : numbers_) {
    if (within(key)) keys.push_back({.key = key, .values = {static_cast<double>(value)}});
  }
  for (const auto& [key, values] : doubles_) {
    if (within(key)) keys.push_back({.key = key, .values = values});
  }
  for (const auto& [key, text] : texts_) {
    if (within(key)) keys.push_back({.key = key, .text = text});
  }
  std::stable_sort(keys.begin(), keys.end(),
                   [](const GeoKey& a, const GeoKey& b) { return a.key < b.key; });
  return keys;
}

Crs crs_of(const GeoKeys& keys) {
  Crs crs;
  const auto projected = keys.number(kProjectedCrs), geodetic = keys.number(kGeodeticCrs);
  std::uint16_t model = keys.number(kGTModelType).value_or(0);
  if (model != kModelProjected && model != kModelGeographic && model != kModelGeocentric) {
    // With a user-defined model, the name of a projected CRS may be its whole definition.
    const bool has_citation = !keys.text(kProjectedCitation).empty();
    model = projected || has_citation ? kModelProjected : geodetic ? kModelGeographic : 0;
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
  constexpr std::uint16_t kLastOfCrs = 5119;  // the last of the vertical keys
  crs.geo_keys = keys.range(kGTModelType, kGTModelType);
  for (GeoKey& key : keys.range(kGeodeticCrs, kLastOfCrs)) crs.geo_keys.push_back(std::move(key));
  return crs;
}

void GeoKeyDirectory::add(std::uint16_t key, const std::string& text) {
  const auto at = static_cast<std::uint16_t>(ascii_.size());
  constexpr std::size_t kMax = 16384;
  ascii_ += text.substr(0, kMax) + "|";
  const auto length = static_cast<std::uint16_t>(ascii_.size() - at);
  entries_.push_back({key, static_cast<std::uint16_t>(kGeoAsciiParams), length, at});
}

void GeoKeyDirectory::add(std::uint16_t key, const std::vector<double>& values) {
  const auto at = static_cast<std::uint16_t>(doubles_.size());
  doubles_.insert(doubles_.end(), values.begin(), values.end());
  entries_.push_back({key, static_cast<std::uint16_t>(kGeoDoubleParams),
                      static_cast<std::uint16_t>(values.size()), at});
}

void GeoKeyDirectory::add(const GeoKey& key) {
  const bool measures = key.key == 2053 || key.key == 2055 ||
                        (key.key >= 2057 && key.key <= 2062) ||
                        (key.key >= 3077 && key.key <= 3096);
  if (key.values.empty()) {
    add(key.key, key.text);
  } else if (measures) {
    add(key.key, key.values);
  } else {
    add(key.key, static_cast<std::uint16_t>(key.values.front()));
  }
}

std::vector<std::uint16_t> GeoKeyDirectory::shorts() const {
  std::vector<std::uint16_t> directory{1, 1, 1, static_cast<std::uint16_t>(entries_.size())};
  for (const auto& entry : entries_) directory.insert(directory.end(), entry.begin(), entry.end());
  return directory;
}

GeoKeyDirectory keys_of(const Crs& crs, std::optional<std::uint16_t> raster_type) {
  const auto code = [](int epsg) {
    return static_cast<std::uint16_t>(epsg > 0 && epsg < kUserDefined ? epsg : 0);
  };
  const std::uint16_t epsg = code(crs.epsg), unit = unit_code(crs.horizontal_unit);
  GeoKeyDirectory keys;
  const std::span<const GeoKey> crs_keys =
      epsg == 0 ? std::span(crs.geo_keys) : std::span<const GeoKey>();
  // Longitudes and latitudes whose datum is unknown.
  const bool angles = epsg == 0 && crs_keys.empty() && crs.geographic && unit != 0;
  if (epsg != 0) keys.add(kGTModelType, crs.geographic ? kModelGeographic : kModelProjected);
  if (angles) keys.add(kGTModelType, kModelGeographic);
  for (const GeoKey& key : crs_keys) {
    if (key.key == kGTModelType) keys.add(key);
  }
  if (raster_type) keys.add(kGTRasterType, *raster_type);
  if (!crs.name.empty()) keys.add(kGTCitation, crs.name);
  for (const GeoKey& key : crs_keys) {
    const bool known_unit = key.key == kLinearUnit && unit != 0 && !crs.geographic;
    if (key.key > kGTCitation && key.key < kVerticalCrs && !known_unit) keys.add(key);
  }
  if (angles) keys.add(kAngularUnit, unit);
  if (epsg == 0 && !crs.geographic && unit != 0) keys.add(kLinearUnit, unit);
  if (epsg != 0 && crs.geographic) {
    keys.add(kGeodeticCrs, epsg);
    keys.add(kAngularUnit, unit != 0 ? unit : std::uint16_t{9102});
  } else if (epsg != 0) {
    keys.add(kProjectedCrs, epsg);
    if (unit != 0) keys.add(kLinearUnit, unit);
  }
  const std::uint16_t vertical = code(crs.vertical_epsg),
                      vertical_unit = unit_code(crs.vertical_unit);
  if (vertical != 0) keys.add(kVerticalCrs, vertical);
  if (vertical_unit != 0 && (vertical != 0 || !raster_type)) keys.add(kVerticalUnit, vertical_unit);
  return keys;
}

}  // namespace terrace::stream
