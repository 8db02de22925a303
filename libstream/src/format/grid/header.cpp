// SPDX-License-Identifier: Apache-2.0
#include "format/grid/header.hpp"

#include <algorithm>
#include <cmath>

#include "format/sidecars.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {

void GridHeader::set(std::string_view key, std::string_view value) {
  values_.emplace(lower_case(std::string(key)), value);
}

std::string GridHeader::text(const std::string& key) const {
  const auto entry = values_.find(key);
  return entry == values_.end() ? std::string() : entry->second;
}

std::optional<double> GridHeader::number(const std::string& key) const {
  std::string digits = text(key);
  if (digits.empty()) return std::nullopt;
  std::replace(digits.begin(), digits.end(), ',', '.');
  double value = 0;
  const char* const end = digits.data() + digits.size();
  if (parse_real(digits.data(), end, value) != end || !std::isfinite(value)) {
    throw fault("is " + in_quotes(text(key)) + ", not a number").at(key);
  }
  return value;
}

std::uint64_t GridHeader::count(const std::string& key,
                                std::optional<std::uint64_t> default_value) const {
  const std::optional<double> value = number(key);
  if (!value && default_value) return *default_value;
  if (!value) throw fault("is missing").at(key);
  if (!(*value >= 0 && *value < 0x1p53) || *value != std::floor(*value)) {
    throw fault("is " + in_quotes(text(key)) + ", not a count").at(key);
  }
  return static_cast<std::uint64_t>(*value);
}

WorldTransform GridHeader::world(std::uint64_t rows, std::vector<std::string>& comments) const {
  const auto first_of = [&](std::initializer_list<const char*> keys) {
    std::optional<double> value;
    for (const char* key : keys) {
      if (!value) value = number(key);
    }
    return value;
  };
  const double width = first_of({"xdim", "dx", "cellsize"}).value_or(1);
  const double height = first_of({"ydim", "dy", "cellsize"}).value_or(1);
  if (!(width > 0 && height > 0)) throw fault("is not positive").at("cellsize");
  const double below = static_cast<double>(rows - 1) * height;
  std::optional<double> x = first_of({"ulxmap", "xllcenter"}), y = number("ulymap");
  if (const auto corner = number("xllcorner"); corner && !x) x = *corner + width / 2;
  if (const auto center = number("yllcenter"); center && !y) y = *center + below;
  if (const auto corner = number("yllcorner"); corner && !y) y = *corner + below + height / 2;
  if (x.has_value() != y.has_value()) {
    throw fault("is missing, but the other one is given").at(x ? "yllcorner" : "xllcorner");
  }
  if (!x) {
    comments.push_back(kNoGeoreferencing);
    return kPlainWorld;
  }
  if (!std::isfinite(*x) || !std::isfinite(*y)) throw fault("is too large").at("cellsize");
  return {{width, 0, *x, 0, -height, *y}};
}

Error GridHeader::fault(std::string cause) const {
  return Error(file_, std::move(cause)).remedy("correct the header");
}

}  // namespace terrace::stream
