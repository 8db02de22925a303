// SPDX-License-Identifier: GPL-3.0-or-later
#include "crs_option.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include "error.hpp"

namespace terrace::tools {
namespace {

struct CodeRange {
  int first, last;
};

// Geographic 2D systems are 4001 to 4999 in EPSG's registry, but for these projected ones.
constexpr std::array<CodeRange, 7> kProjectedBelow5000{{{4026, 4026},
                                                        {4037, 4038},
                                                        {4048, 4051},
                                                        {4056, 4063},
                                                        {4071, 4087},
                                                        {4390, 4599},
                                                        {4647, 4647}}};
// Geographic 2D systems above: ETRS89 and WGS 84 realisations, national ones of newer date.
constexpr std::array<int, 8> kGeographicAbove5000{5324, 5451, 5527, 6318, 6668, 7844, 8972, 9000};
// NAD83 and NAD83(HARN), (2011) state planes in US survey feet.
constexpr std::array<CodeRange, 4> kSurveyFeet{
    {{2225, 2289}, {2868, 2968}, {3417, 3438}, {6405, 6627}}};

template <std::size_t N>
bool within(const std::array<CodeRange, N>& ranges, int code) {
  return std::any_of(ranges.begin(), ranges.end(), [code](const CodeRange& range) {
    return range.first <= code && code <= range.last;
  });
}

}  // namespace

stream::Crs parse_crs(const std::string& text) {
  std::string prefix = text.substr(0, 5);
  std::transform(prefix.begin(), prefix.end(), prefix.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; });
  stream::Crs crs;
  const char* const first = text.data() + std::min<std::size_t>(5, text.size());
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(first, last, crs.epsg);
  if (prefix != "EPSG:" || error != std::errc{} || end != last || crs.epsg < 1024 ||
      crs.epsg > 32767) {
    throw UsageError("'" + text + "' is not a CRS; write EPSG:n, like EPSG:32632");
  }
  const bool below = crs.epsg >= 4001 && crs.epsg <= 4999 && !within(kProjectedBelow5000, crs.epsg);
  crs.geographic = below || std::find(kGeographicAbove5000.begin(), kGeographicAbove5000.end(),
                                      crs.epsg) != kGeographicAbove5000.end();
  crs.horizontal_unit = crs.geographic                  ? "degree"
                        : within(kSurveyFeet, crs.epsg) ? "US survey foot"
                                                        : "metre";
  return crs;
}

}  // namespace terrace::tools
