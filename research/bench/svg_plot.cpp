// SPDX-License-Identifier: GPL-3.0-or-later
#include "svg_plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

namespace terrace::research {
namespace {

constexpr double kWidth = 760, kHeight = 480;
constexpr double kLeft = 78, kRight = 24, kTop = 46, kBottom = 58;

// Okabe and Ito's colours, which colour-blind readers can also distinguish.
constexpr std::array kPalette{"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};

std::string format(const char* pattern, double value) {
  char text[64];
  std::snprintf(text, sizeof text, pattern, value);
  return text;
}
std::string pixels(double value) { return format("%.2f", value); }

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

std::string text_at(double x, double y, const char* attributes, const std::string& text) {
  return "<text x='" + pixels(x) + "' y='" + pixels(y) + "' " + attributes + ">" + escaped(text) +
         "</text>\n";
}

std::string line_at(double x0, double y0, double x1, double y1, const std::string& attributes) {
  return "<line x1='" + pixels(x0) + "' y1='" + pixels(y0) + "' x2='" + pixels(x1) + "' y2='" +
         pixels(y1) + "' " + attributes + "/>\n";
}

/// Maps data to pixels along one axis.
struct Scale {
  bool log = false;
  double low = 0, high = 1;   ///< logarithms on a logarithmic axis
  double start = 0, end = 1;  ///< pixels

  [[nodiscard]] bool shows(double v) const { return std::isfinite(v) && (!log || v > 0.0); }
  [[nodiscard]] double value(double v) const { return log ? std::log10(v) : v; }
  [[nodiscard]] double operator()(double v) const {
    return start + (value(v) - low) / (high - low) * (end - start);
  }
};

Scale scale_of(const Axis& axis, const std::vector<Series>& all, bool is_x) {
  Scale scale{.log = axis.log};
  scale.low = std::numeric_limits<double>::infinity();
  scale.high = -scale.low;
  const auto include = [&](double v) {
    if (!scale.shows(v)) return;
    scale.low = std::min(scale.low, scale.value(v));
    scale.high = std::max(scale.high, scale.value(v));
  };
  for (const Series& series : all) {
    for (const double v : is_x ? series.x : series.y) include(v);
  }
  if (!(scale.low <= scale.high)) scale.low = 0.0, scale.high = 1.0;
  if (!is_x && !axis.log) scale.high += 0.04 * (scale.high - scale.low);
  if (!is_x && axis.log) scale.high += 0.05 * (scale.high - scale.low);
  if (axis.low) scale.low = scale.value(*axis.low);
  if (axis.high) scale.high = scale.value(*axis.high);
  if (!(scale.low < scale.high)) scale.low -= 0.5, scale.high += 0.5;
  return scale;
}

struct Tick {
  double value;
  std::string label;  ///< empty: a minor tick
};

std::vector<Tick> ticks_of(const Scale& scale) {
  std::vector<Tick> ticks;
  const double slack = 1e-9 * (scale.high - scale.low);
  if (scale.log) {
    for (double power = std::floor(scale.low); power <= scale.high + slack; power += 1.0) {
      for (int digit = 1; digit < 10; ++digit) {
        const double at = power + std::log10(digit);
        if (at < scale.low - slack || at > scale.high + slack) continue;
        std::string label = digit == 1 ? format("%g", std::pow(10.0, power)) : "";
        if (digit == 1 && power > 5) label = "1e" + format("%g", power);
        // Labels more ticks if there are fewer than two decades.
        if (scale.high - scale.low < 2.0 && (digit == 2 || digit == 5))
          label = format("%g", digit * std::pow(10.0, power));
        ticks.push_back({std::pow(10.0, at), label});
      }
    }
    return ticks;
  }
  const double rough = (scale.high - scale.low) / 6;
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  const double step = power * (rough < 1.5 * power   ? 1
                               : rough < 3.5 * power ? 2
                               : rough < 7.5 * power ? 5
                                                     : 10);
  for (double k = std::ceil((scale.low - slack) / step); k * step <= scale.high + slack; k += 1.0) {
    ticks.push_back({k * step, format("%g", k * step + 0.0)});  // avoids "-0"
  }
  return ticks;
}

std::string axes(const Plot& plot, const Scale& x, const Scale& y) {
  std::string out;
  for (const auto& [value, label] : ticks_of(x)) {
    const double at = x(value);
    out += line_at(at, y.end, at, y.start, label.empty() ? "class='minor'" : "class='grid'");
    if (label.empty()) continue;
    out += line_at(at, y.start, at, y.start + 5, "class='axis'");
    out += text_at(at, y.start + 20, "text-anchor='middle'", label);
  }
  for (const auto& [value, label] : ticks_of(y)) {
    const double at = y(value);
    out += line_at(x.start, at, x.end, at, label.empty() ? "class='minor'" : "class='grid'");
    if (label.empty()) continue;
    out += line_at(x.start - 5, at, x.start, at, "class='axis'");
    out += text_at(x.start - 9, at + 4.5, "text-anchor='end'", label);
  }
  out += "<rect x='" + pixels(x.start) + "' y='" + pixels(y.end) + "' width='" +
         pixels(x.end - x.start) + "' height='" + pixels(y.start - y.end) + "' class='frame'/>\n";
  out += text_at((x.start + x.end) / 2, y.start + 44, "text-anchor='middle'", plot.x.label);
  const double middle = (y.start + y.end) / 2;
  const std::string turn = "text-anchor='middle' transform='rotate(-90 18 " + pixels(middle) + ")'";
  out += text_at(18, middle, turn.c_str(), plot.y.label);
  out += text_at(x.start, 26, "class='title'", plot.title);
  return out;
}

std::string series_svg(const Series& series, const std::string& colour, const Scale& x,
                       const Scale& y) {
  std::string out;
  if (series.mark == Series::Mark::dots) {
    out += "<g fill='" + colour + "'>\n";
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      if (!x.shows(series.x[i]) || !y.shows(series.y[i])) continue;
      out += "<circle cx='" + pixels(x(series.x[i])) + "' cy='" + pixels(y(series.y[i])) + "' r='" +
             pixels(series.size) + "'/>\n";
    }
    return out + "</g>\n";
  }
  out += "<path fill='none' stroke='" + colour + "' stroke-width='" + pixels(series.size) +
         "' stroke-linejoin='round'" +
         (series.mark == Series::Mark::dashes ? " stroke-dasharray='6 4'" : "") + " d='";
  bool pen_down = false;
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (!x.shows(series.x[i]) || !y.shows(series.y[i])) {
      pen_down = false;
      continue;
    }
    out += pen_down ? 'L' : 'M';
    out += pixels(x(series.x[i])) + ' ' + pixels(y(series.y[i])) + ' ';
    pen_down = true;
  }
  return out + "'/>\n";
}

/// Draws the legend in an upper corner, on a background that partly hides the curves.
std::string legend(const Plot& plot, const std::vector<std::string>& colours, const Scale& x,
                   const Scale& y) {
  const std::vector<Series>& all = plot.series;
  std::size_t entries = 0;
  std::size_t longest = 0;
  for (const Series& series : all) {
    entries += !series.name.empty();
    longest = std::max(longest, series.name.size());
  }
  if (entries == 0) return "";
  const double width = 52 + 6.6 * static_cast<double>(longest);
  const double left = plot.legend_left ? x.start + 10 : x.end - width - 10;
  double row = y.end + 10;
  std::string out = "<rect x='" + pixels(left) + "' y='" + pixels(row) + "' width='" +
                    pixels(width) + "' height='" + pixels(10 + 19 * static_cast<double>(entries)) +
                    "' class='legend'/>\n";
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].name.empty()) continue;
    row += 19;
    const std::string paint = std::string(1, '\'') + colours[i] + '\'';
    if (all[i].mark == Series::Mark::dots) {
      out += "<circle cx='" + pixels(left + 24) + "' cy='" + pixels(row - 4) +
             "' r='4' fill=" + paint + "/>\n";
    } else {
      out += line_at(left + 10, row - 4, left + 38, row - 4,
                     "stroke-width='2.5' stroke=" + paint +
                         (all[i].mark == Series::Mark::dashes ? " stroke-dasharray='6 4'" : ""));
    }
    out += text_at(left + 45, row, "", all[i].name);
  }
  return out;
}

}  // namespace

std::string svg(const Plot& plot) {
  Scale x = scale_of(plot.x, plot.series, true);
  Scale y = scale_of(plot.y, plot.series, false);
  double height = kHeight;
  if (plot.equal_scales) {
    height = kTop + kBottom + (kWidth - kLeft - kRight) * (y.high - y.low) / (x.high - x.low);
  }
  x.start = kLeft, x.end = kWidth - kRight;
  y.start = height - kBottom, y.end = kTop;

  std::vector<std::string> colours;
  std::size_t next = 0;
  for (const Series& series : plot.series) {
    colours.push_back(series.colour.empty() ? kPalette[next++ % kPalette.size()] : series.colour);
  }
  const std::string size = "width='" + pixels(kWidth) + "' height='" + pixels(height) + "'";
  std::string out = "<svg xmlns='http://www.w3.org/2000/svg' " + size + " viewBox='0 0 " +
                    pixels(kWidth) + " " + pixels(height) +
                    "' font-family='Helvetica, Arial, sans-serif' font-size='13' fill='#222'>\n"
                    "<style>.grid{stroke:#d8d8d8}.minor{stroke:#f0f0f0}.axis{stroke:#444}"
                    ".frame{fill:none;stroke:#444}.legend{fill:#fff;fill-opacity:.85;stroke:#ccc}"
                    ".title{font-size:15px;font-weight:bold}</style>\n"
                    "<rect width='100%' height='100%' fill='#fff'/>\n"
                    "<clipPath id='inside'><rect x='" +
                    pixels(x.start) + "' y='" + pixels(y.end) + "' width='" +
                    pixels(x.end - x.start) + "' height='" + pixels(y.start - y.end) +
                    "'/></clipPath>\n";
  out += axes(plot, x, y);
  out += "<g clip-path='url(#inside)'>\n";
  for (std::size_t i = 0; i < plot.series.size(); ++i)
    out += series_svg(plot.series[i], colours[i], x, y);
  out += "</g>\n" + legend(plot, colours, x, y) + "</svg>\n";
  return out;
}

}  // namespace terrace::research
