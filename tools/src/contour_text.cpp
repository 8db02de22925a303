// SPDX-License-Identifier: GPL-3.0-or-later
#include "contour_text.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "crs_options.hpp"
#include "units.hpp"

namespace terrace::tools {
namespace {

/// Nine decimals of a degree are a tenth of a millimetre.
constexpr int kDecimals = 9;

}  // namespace

ContourText::ContourText(const stream::Store& store, double interval,
                         std::function<void(std::string_view)> write)
    : system_(system_of(store)),
      ground_(store),
      interval_(interval),
      write_(std::move(write)),
      degrees_(kDecimals),
      text_("{\"type\":\"FeatureCollection\",\"generator\":\"terrace contour\",\"features\":[") {
  const std::array<double, 6>& m = store.schema().world.xy;
  reverse_ = m[0] * m[4] - m[1] * m[3] > 0;
}

void ContourText::add(const ContourLine& line) {
  places_.clear();
  for (const Point2& p : line.points) places_.push_back(ground_.world(p));
  if (reverse_) std::reverse(places_.begin(), places_.end());
  system_.to_geographic(places_);
  text_ += outcome_.lines == 0 ? "\n" : ",\n";
  text_ += "{\"type\":\"Feature\",\"properties\":{\"elev\":" +
           number_text(static_cast<double>(line.level) * interval_) +
           "},\"geometry\":{\"type\":\"LineString\",\"coordinates\":[";
  for (std::size_t i = 0; i < places_.size(); ++i) {
    text_ += i == 0 ? "[" : ",[";
    degrees_.append(text_, places_[i][0]);
    text_ += ',';
    degrees_.append(text_, places_[i][1]);
    text_ += ']';
  }
  text_ += "]}}";
  ++outcome_.lines;
  outcome_.closed += line.closed ? 1 : 0;
  outcome_.points += line.points.size();
  if (text_.size() > (std::size_t{1} << 20)) {
    write_(text_);
    text_.clear();
  }
}

void ContourText::finish() {
  text_ += "\n]}\n";
  write_(text_);
  text_.clear();
}

}  // namespace terrace::tools
