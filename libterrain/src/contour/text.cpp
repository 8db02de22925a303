// SPDX-License-Identifier: Apache-2.0
#include "contour/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <utility>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/file_marks.hpp"
#include "base/geojson_crs.hpp"
#include "base/parallel.hpp"
#include "base/units.hpp"
#include "earth/whole_turns.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::terrain {
namespace {

/// Nine decimals of a degree are a tenth of a millimetre.
constexpr int kDecimals = 9, kOwnDecimals = 6;
/// Number of points converted to text at a time.
constexpr std::size_t kContourPoints = std::size_t{1} << 17;

/// Cuts a line with longitudes beyond 180 degrees into parts from -180 to 180 (RFC 7946, 3.1.9).
std::vector<std::vector<Point2>> cut_at_antimeridian(std::span<const Point2> line) {
  std::vector<std::vector<Point2>> parts;
  double turn = 0;
  const auto add = [&](const Point2& a, const Point2& b) {
    const double turns = (0.5 * a[0] + 0.5 * b[0]) / 360;
    const double now = 360 * (turns == 0.5 ? 0 : std::round(turns));  // 180 stays on its side
    if (parts.empty() || now != turn) parts.push_back({{a[0] - now, a[1]}});
    turn = now;
    parts.back().push_back({b[0] - now, b[1]});
  };
  for (std::size_t i = 1; i < line.size(); ++i) {
    const Point2 &a = line[i - 1], &b = line[i];
    const auto [lower, upper] = std::minmax(a[0], b[0]);
    const double cut = 360 * std::floor((lower + 180) / 360) + 180;
    if (lower < cut && cut < upper) {
      const Point2 between{cut, a[1] + (b[1] - a[1]) * ((cut - a[0]) / (b[0] - a[0]))};
      add(a, between);
      add(between, b);
    } else {
      add(a, b);
    }
  }
  return parts;
}

void append_positions(std::string& text, std::span<const Point2> places, const FixedText& number) {
  for (std::size_t i = 0; i < places.size(); ++i) {
    std::array<char, 2 * FixedText::kLongest + 4> pair;
    char* at = pair.data();
    if (i > 0) *at++ = ',';
    *at++ = '[';
    at = number.write(at, places[i][0]);
    *at++ = ',';
    at = number.write(at, places[i][1]);
    *at++ = ']';
    text.append(pair.data(), at);
  }
}

}  // namespace

ContourText::ContourText(const stream::Store& store, const ContourRequest& request,
                         unsigned threads, std::function<void(std::string_view)> write)
    : file_(store.path().string()),
      ground_(store),
      levels_(request.interval),
      threads_(std::max(1U, threads)),
      write_(std::move(write)),
      number_(request.own_crs ? kOwnDecimals : kDecimals) {
  head_ = std::string(kContourHead) +
          (request.own_crs ? geojson_crs_member(store.schema().crs) : std::string()) +
          "\"features\":[";
  if (!request.own_crs) {
    const stream::Box3 box = world_box(store.schema(), store.bounds());
    geography_.emplace(system_of(store, stream::message(", or ask for {own_crs}")), box);
    Point2 middle{0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1])};
    (*geography_)({&middle, 1});
    middle_ = middle[0];
  }
  const std::array<double, 6>& m = store.schema().world.xy;
  reverse_ = m[0] * m[4] - m[1] * m[3] > 0;
}

void ContourText::add(ContourLine&& line) {
  ++outcome_.lines;
  outcome_.closed += line.closed ? 1 : 0;
  outcome_.points += line.points.size();
  points_ += line.points.size();
  lines_.push_back(std::move(line));
  if (points_ >= kContourPoints) flush();
}

void ContourText::append(std::string& text, const ContourLine& line,
                         std::vector<Point2>& places) const {
  places.clear();
  for (const Point2& p : line.points) places.push_back(ground_.world(p));
  if (reverse_) std::reverse(places.begin(), places.end());
  if (geography_) {
    (*geography_)(places);
    // Longitudes continue across the antimeridian, and all lines begin on the same side of it.
    double near = middle_;
    for (Point2& p : places) {
      p = WholeTurns(near, 360)(p);
      near = p[0];
    }
  }
  for (std::size_t i = 0; geography_ && i < places.size(); ++i) {
    if (std::isfinite(places[i][0]) && std::isfinite(places[i][1])) continue;
    const Point2 at = ground_.world(line.points[reverse_ ? places.size() - 1 - i : i]);
    throw stream::Error(
        file_, fmt::format("{},{} has no longitude and latitude in {}", plain_number(at[0]),
                           plain_number(at[1]), geography_->system().title()))
        .remedy(stream::message("build the store with the right {crs}, or leave the "
                                "place out with {region}"));
  }
  text +=
      "{\"type\":\"Feature\",\"properties\":{\"elev\":" + number_text(levels_.height(line.level)) +
      "},\"geometry\":{\"type\":";
  const bool beyond = geography_ && std::any_of(places.begin(), places.end(), [](const Point2& p) {
                        return std::abs(p[0]) > 180;
                      });
  std::vector<std::vector<Point2>> parts;
  if (beyond) parts = cut_at_antimeridian(places);
  if (parts.size() > 1) {
    text += "\"MultiLineString\",\"coordinates\":[";
    for (const std::vector<Point2>& part : parts) {
      text += &part == parts.data() ? "[" : ",[";
      append_positions(text, part, number_);
      text += ']';
    }
  } else {
    text += "\"LineString\",\"coordinates\":[";
    append_positions(text, beyond ? parts.front() : places, number_);
  }
  text += "]}}";
}

void ContourText::flush() {
  // Pieces with about the same number of points.
  const std::size_t pieces = 4 * std::size_t{threads_};
  std::vector<std::size_t> begin{0};
  std::size_t points = 0;
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    points += lines_[i].points.size();
    if (points * pieces >= points_ * begin.size()) begin.push_back(i + 1);
  }
  texts_.resize(std::max(texts_.size(), begin.size() - 1));
  parallel_for(begin.size() - 1, threads_, [&](std::size_t piece) {
    std::vector<Point2> places;
    std::string& text = texts_[piece];
    text.clear();
    for (std::size_t i = begin[piece]; i < begin[piece + 1]; ++i) {
      text += i == 0 && first_ ? "\n" : ",\n";
      append(text, lines_[i], places);
    }
  });
  if (first_) write_(head_);
  for (std::size_t piece = 0; piece + 1 < begin.size(); ++piece) write_(texts_[piece]);
  first_ = false;
  lines_.clear();
  points_ = 0;
}

void ContourText::finish() {
  flush();
  write_("\n]}\n");
}

}  // namespace terrace::terrain
