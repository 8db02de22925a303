// SPDX-License-Identifier: Apache-2.0
#include "format/geojson/items.hpp"

#include <algorithm>
#include <charconv>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "io/bounded_json.hpp"
#include "io/line_reader.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

Crs longitude_and_latitude() {
  return {.epsg = 4326,
          .vertical_epsg = 0,
          .name = "WGS 84",
          .wkt = {},
          .geographic = true,
          .horizontal_unit = "degree",
          .vertical_unit = {},
          .geo_keys = {}};
}

/// The CRS of names such as "EPSG:2056", "urn:ogc:def:crs:EPSG::2056" and
/// "urn:ogc:def:crs:OGC:1.3:CRS84"; nullopt for other names.
std::optional<Crs> crs_named(std::string_view name) {
  if (name.ends_with("CRS84")) return longitude_and_latitude();
  if (name.find("EPSG") == std::string_view::npos) return std::nullopt;
  const std::string_view digits = name.substr(name.rfind(':') + 1);
  int code = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), code);
  if (error != std::errc() || end != digits.data() + digits.size() || code <= 0) {
    return std::nullopt;
  }
  if (code == 4326) return longitude_and_latitude();
  Crs crs;
  crs.epsg = code;
  return crs;
}

}  // namespace

GeoJsonItems::GeoJsonItems(Input& input, std::size_t max_bytes, bool wants_crs)
    : input_(&input), max_bytes_(max_bytes), wants_crs_(wants_crs) {
  if (wants_crs_) crs_ = longitude_and_latitude();
  refuse_utf16(*input_);
  if (at(0) == '\xEF' && at(1) == '\xBB' && at(2) == '\xBF') input_->consume(3);
  advance();
}

Error GeoJsonItems::fault(std::string cause, std::size_t ahead) const {
  return Error(input_->name(), std::move(cause))
      .at_byte(input_->offset() + ahead)
      .remedy("the file is damaged or not GeoJSON: export it again, e.g. by ogr2ogr");
}

/// Returns the byte at a position of the window, which grows as needed; 0 at the end of the input.
char GeoJsonItems::at(std::size_t index) {
  window_ = input_->window();
  if (index < window_.size()) return window_[index];
  if (index >= max_bytes_) {
    throw Error(input_->name(), fmt::format("a feature has more than {} MiB", max_bytes_ >> 20))
        .at_byte(input_->offset())
        .remedy(message("raise {memory_bytes}, or split the feature's lines"));
  }
  window_ = input_->fill(std::min(max_bytes_, std::max(index + 1, 2 * window_.size())));
  return index < window_.size() ? window_[index] : '\0';
}

void GeoJsonItems::skip_white_space() {
  for (char c = at(0); is_white_space(c); c = at(0)) {
    const auto end = std::find_if_not(window_.begin(), window_.end(), is_white_space);
    input_->consume(static_cast<std::size_t>(end - window_.begin()));
  }
}

GeoJsonItems::Stop GeoJsonItems::scan_object(std::size_t depth, bool stop_at_list) {
  std::size_t name_begin = 0, name_end = 0;  // of the last string at depth 1: perhaps a key
  const bool after_list = depth > 0;
  for (std::size_t i = 0;; ++i) {
    switch (at(i)) {
      case '"': {
        std::size_t end = i + 1;
        for (char c = at(end); c != '"'; c = at(++end)) {
          if (c == '\0') throw fault("the file ends within a string", i);
          if (c == '\\') ++end;
        }
        if (depth == 1) {
          name_begin = i + 1;
          name_end = end;
        }
        i = end;
        break;
      }
      case '[': {
        const std::string_view name = window_.substr(name_begin, name_end - name_begin);
        if (stop_at_list && depth == 1 && (name == "features" || name == "geometries")) {
          if (after_list) throw fault("has a second list of features", i);
          return {.at = i + 1, .in_list = true};
        }
        ++depth;
        break;
      }
      case '{':
        ++depth;
        break;
      case ']':
      case '}':
        if (--depth == 0) return {.at = i + 1, .in_list = false};
        break;
      case '\0':
        throw fault("the file ends within an object", i);
      default:
        break;
    }
  }
}

void GeoJsonItems::take_members(std::string_view text, bool before) {
  using nlohmann::json;
  json members;
  try {
    members =
        parse_bounded_json(text, {.depth = 64}, [this](const char* cause) { throw fault(cause); });
  } catch (const json::exception&) {
    throw fault("is not JSON");
  }
  const auto type = members.find("type");
  if (before && type != members.end() && *type != "FeatureCollection" &&
      *type != "GeometryCollection") {
    throw fault("has features but is not a FeatureCollection");
  }
  const auto generator = members.find("generator");
  if (before && generator != members.end()) numbers_lines_ = *generator == "terrace";
  const auto crs = members.find("crs");
  if (!wants_crs_ || crs == members.end()) return;
  const json::json_pointer name("/properties/name");
  std::optional<Crs> named;
  if (crs->is_null()) {
    named.emplace();
  } else if (crs->is_object() && crs->contains(name) && crs->at(name).is_string()) {
    named = crs_named(crs->at(name).get_ref<const std::string&>());
  }
  if (before) {
    // Keep an unknown name for messages, so that the user can tell which CRS it is.
    crs_ = named ? *named : Crs{};
    if (!named) crs_.name = in_quotes(crs->dump());
  } else if (!named || *named != crs_) {
    throw fault("its crs follows its features, which is too late: move it before \"features\"");
  }
}

void GeoJsonItems::leave_list() {
  input_->consume(1);
  in_list_ = false;
  const Stop stop = scan_object(1, true);
  std::string_view rest = window_.substr(0, stop.at);
  rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n,"), rest.size()));
  take_members(std::string("{").append(rest), false);
  input_->consume(stop.at);
}

void GeoJsonItems::advance() {
  input_->consume(found_);
  found_ = 0;
  for (;;) {
    skip_white_space();
    if (in_list_) {
      if (at(0) == ']') {
        leave_list();
        continue;
      }
      if (!first_of_list_) {
        if (at(0) != ',') throw fault("a comma is missing between features");
        input_->consume(1);
        skip_white_space();
      }
      first_of_list_ = false;
      if (at(0) != '{') throw fault("a feature is expected here");
      found_ = scan_object(0, false).at;
      return;
    }
    if (at(0) == '\x1E') {  // the separator of text sequences
      input_->consume(1);
      continue;
    }
    if (window_.empty()) return;
    if (at(0) != '{') throw fault("is not GeoJSON: an object is expected here");
    const Stop stop = scan_object(0, true);
    if (!stop.in_list) {
      found_ = stop.at;
      return;
    }
    take_members(std::string(window_.substr(0, stop.at)) + "]}", true);
    input_->consume(stop.at);
    in_list_ = first_of_list_ = true;
  }
}

std::optional<std::string_view> GeoJsonItems::next() {
  if (started_) advance();
  started_ = true;
  if (found_ == 0) return std::nullopt;
  return window_.substr(0, found_);
}

}  // namespace terrace::stream
