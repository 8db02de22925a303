// SPDX-License-Identifier: Apache-2.0
#include "format/sidecars.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/vrt/document.hpp"
#include "format/vrt/xml.hpp"
#include "io/line_reader.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "raster/nodata.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {
namespace {

namespace fs = std::filesystem;

/// ".tfw", ".tifw" and ".wld" for ".tif", each in lower and in upper case.
std::vector<std::string> world_endings(const std::string& ending) {
  std::vector<std::string> lower;
  if (ending.size() > 2) {
    lower.push_back(ending.substr(0, 2) + ending.back() + 'w');
    lower.push_back(ending + 'w');
  }
  lower.emplace_back(".wld");
  std::vector<std::string> endings;
  for (std::string& name : lower) {
    std::string upper = name;
    for (char& c : upper) {
      if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 32);
    }
    endings.push_back(std::move(name));
    endings.push_back(std::move(upper));
  }
  return endings;
}

/// Decimal commas are read as points.
bool read_number(std::string_view line, double& number) {
  std::string digits(line);
  std::replace(digits.begin(), digits.end(), ',', '.');
  const char* const end = digits.data() + digits.size();
  return !digits.empty() && parse_real(digits.data(), end, number) == end && std::isfinite(number);
}

WorldTransform read_world_file(const std::string& file) {
  Input input(file);
  LineReader lines(input);
  std::array<double, 6> numbers{};
  std::string_view line;
  for (double& number : numbers) {
    const bool more = lines.next(line);
    if (!more || !read_number(trim(line), number)) {
      throw Error(file, "a world file has six numbers, one on each line")
          .at_line(lines.number())
          .remedy("correct or remove it");
    }
  }
  const auto [a, d, b, e, c, f] = numbers;
  const double area = a * e - b * d;
  if (!std::isfinite(area) || area == 0) {
    throw Error(file, "does not map cells to distinct places").remedy("correct or remove it");
  }
  return {{a, b, c, d, e, f}};
}

constexpr std::string_view kPamBand = "PAMRasterBand";

std::optional<double> finite_number(std::string_view text) {
  text = trim(text);
  double value = 0;
  const char* const end = text.data() + text.size();
  if (text.empty() || parse_real(text.data(), end, value) != end || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

bool lacks_crs(const Crs& crs) {
  constexpr std::uint16_t kFirst = 2048, kVertical = 4096;
  return crs.epsg == 0 && crs.wkt.empty() &&
         std::none_of(crs.geo_keys.begin(), crs.geo_keys.end(),
                      [](const GeoKey& key) { return key.key >= kFirst && key.key < kVertical; });
}

XmlElement read_pam(const std::string& file) {
  return read_xml(file, [](std::span<const XmlElement> open, const XmlElement& element) {
    if (open.size() == 1) {
      return element.name != kPamBand && element.name != "SRS" && element.name != "GeoTransform";
    }
    // Statistics and histograms.
    return open.size() > 2 || !element.children.empty() || element.text.size() > 100;
  });
}

/// Returns a sidecar's element for the band; nullptr if it has none.
const XmlElement* band_of(const XmlElement& root, const RasterOptions& options) {
  // The sidecar describes the colours, not the heights that are decoded from them.
  if (options.heights_of_colour != HeightsOfColour::none) return nullptr;
  const auto band_element =
      std::find_if(root.children.begin(), root.children.end(), [&](const XmlElement& band) {
        return band.name == kPamBand && finite_number(band.attribute("band")) == options.band;
      });
  return band_element == root.children.end() ? nullptr : &*band_element;
}

/// As in GDAL, the sidecar of a GeoTIFF overrides the file's georeferencing, CRS, nodata value and
/// unit. Sidecars of other formats only add what their files lack.
bool is_overridden(const RasterInfo& info) { return info.format == "geotiff"; }

/// A raster to which the values of its sidecar have been applied.
class WithAuxXml final : public Raster {
 public:
  /// file_nodata: the file's own value, even if `raster` was opened with the sidecar's. band: the
  /// element in `root`, or null.
  WithAuxXml(std::unique_ptr<Raster> raster, std::string sidecar, const XmlElement& root,
             std::optional<double> file_nodata, const XmlElement* band)
      : raster_(std::move(raster)),
        info_(raster_->info()),
        sidecar_(std::move(sidecar)),
        overrides_file_(is_overridden(info_)) {
    if (const XmlElement* const srs = root.child("SRS")) read_crs(crs_of_srs(srs->text));
    if (const XmlElement* const transform = root.child("GeoTransform")) {
      read_transform(transform->text);
    }
    if (band != nullptr) read_band(*band, file_nodata);
  }
  /// Applies nothing and adds a comment.
  WithAuxXml(std::unique_ptr<Raster> raster, std::string sidecar, std::string comment)
      : raster_(std::move(raster)), info_(raster_->info()), sidecar_(std::move(sidecar)) {
    info_.comments.push_back(std::move(comment));
  }

  [[nodiscard]] const RasterInfo& info() const override { return info_; }
  void set_open_bytes(std::uint64_t bytes) override { raster_->set_open_bytes(bytes); }

  bool read_over(const CellWindow& window, const CellBuffer& out) override {
    if (!nodata_) return raster_->read_over(window, out);
    const std::size_t bytes = size_of(info_.sample.type);
    const auto columns = static_cast<std::size_t>(window.columns);
    bool any = false;
    for (std::uint64_t row = 0; row < window.rows; row += kStripRows) {
      const std::uint64_t rows = std::min(kStripRows, window.rows - row);
      samples_.resize(columns * rows * bytes);
      valid_.assign(columns * rows, 0);
      raster_->read_over({window.column, window.row + row, window.columns, rows},
                         {samples_.data(), valid_.data(), columns});
      for (std::size_t r = 0; r < rows; ++r) {
        const std::size_t source_row = r * columns, target_row = (row + r) * out.stride;
        for (std::size_t first = 0, end = 0; first < columns; first = end + 1) {
          // One run of cells with data at a time.
          while (first < columns && valid_[source_row + first] == 0) ++first;
          end = first;
          while (end < columns && valid_[source_row + end] != 0) ++end;
          if (end == first) continue;
          any |= overlay_row(info_.sample.type,
                             {.samples = samples_.data() + (source_row + first) * bytes,
                              .step = 1,
                              .cells = end - first},
                             *nodata_, out.samples + (target_row + first) * bytes,
                             out.valid + target_row + first);
        }
      }
    }
    return any;
  }

 private:
  static constexpr std::uint64_t kStripRows = 256;

  /// Returns whether to use the sidecar's value of something that the file may state as well. Adds
  /// a note about the choice if the two differ.
  bool is_applicable(bool is_in_file, bool differs, bool overrides, const std::string& what) {
    if (!is_in_file) return true;
    if (differs) {
      info_.notes.push_back(fmt::format("{}: its {}{}", sidecar_, what,
                                        overrides
                                            ? " overrides that of the file, as in GDAL"
                                            : " is ignored, as in GDAL: the file has its own"));
    }
    return overrides;
  }

  void read_crs(Crs crs) {
    if (crs.epsg == 0 && crs.wkt.empty()) return;
    const Crs& file_crs = info_.crs;
    const bool has_file_crs = !lacks_crs(file_crs);
    if (has_file_crs && file_crs.epsg == crs.epsg && file_crs.wkt == crs.wkt) return;
    if (!is_applicable(has_file_crs, crs.epsg == 0 || crs.epsg != file_crs.epsg, overrides_file_,
                       "CRS"))
      return;
    // The sidecar may not say anything about heights.
    if (crs.vertical_epsg == 0 && crs.wkt.find("VERT") == std::string::npos) {
      crs.vertical_epsg = file_crs.vertical_epsg;
    }
    crs.vertical_unit = file_crs.vertical_unit;
    info_.crs = std::move(crs);
  }

  void read_transform(const std::string& text) {
    const std::vector<std::string_view> words = split_fields(trim(text), ',');
    std::array<double, 6> g{};
    for (std::size_t i = 0; i < g.size(); ++i) {
      const auto number = i < words.size() ? finite_number(words[i]) : std::nullopt;
      if (!number) return;
      g[i] = *number;
    }
    const double area = g[1] * g[5] - g[2] * g[4];
    if (!std::isfinite(area) || area == 0) return;
    constexpr std::array<double, 6> kNone{0, 1, 0, 0, 0, 1};  // GDAL's for "not georeferenced"
    if (g == kNone) return;
    // From the corner of the first cell to its middle.
    const WorldTransform world{
        {g[1], g[2], g[0] + 0.5 * (g[1] + g[2]), g[4], g[5], g[3] + 0.5 * (g[4] + g[5])}};
    if (!is_applicable(info_.world != kPlainWorld, !is_near(world), overrides_file_,
                       "georeferencing"))
      return;
    info_.world = world;
    std::erase(info_.comments, kNoGeoreferencing);
  }

  /// True if `world` equals the file's within rounding.
  [[nodiscard]] bool is_near(const WorldTransform& world) const {
    const auto &a = info_.world.xy, &b = world.xy;
    const double cell = std::max({std::abs(a[0]), std::abs(a[1]), std::abs(a[3]), std::abs(a[4])});
    const auto columns = static_cast<double>(info_.columns), rows = static_cast<double>(info_.rows);
    return std::abs(a[0] - b[0]) * columns + std::abs(a[1] - b[1]) * rows +
               std::abs(a[3] - b[3]) * columns + std::abs(a[4] - b[4]) * rows +
               std::abs(a[2] - b[2]) + std::abs(a[5] - b[5]) <=
           kSameCell * cell;
  }

  void read_band(const XmlElement& band, std::optional<double> file_nodata) {
    Channel& sample = info_.sample;
    if (const XmlElement* const nodata = band.child("NoDataValue")) {
      read_nodata(nodata->text, file_nodata);
    }
    const auto number = [&](const char* name, double otherwise) {
      const XmlElement* const element = band.child(name);
      return element != nullptr ? finite_number(element->text).value_or(otherwise) : otherwise;
    };
    const double scale = number("Scale", 1), offset = number("Offset", 0);
    if (scale != 0 && (scale != 1 || offset != 0) &&
        is_applicable(sample.scale != 1 || sample.offset != 0,
                      scale != sample.scale || offset != sample.offset, false, "scale")) {
      sample.scale = scale;
      sample.offset = offset;
    }
    if (const XmlElement* const element = band.child("UnitType")) {
      const std::string unit = canonical_unit(element->text);
      if (!unit.empty() && is_applicable(!sample.unit.empty(), unit != sample.unit, overrides_file_,
                                         "unit of heights")) {
        sample.unit = info_.crs.vertical_unit = unit;
      }
    }
  }

  void read_nodata(const std::string& text, std::optional<double> file_value) {
    const NodataRule rule = NodataRule::parse(text, info_.sample.type);
    if (!rule.value) return;
    const bool same = file_value == rule.value ||
                      (file_value && std::isnan(*file_value) && std::isnan(*rule.value));
    const bool is_applied =
        is_applicable(file_value.has_value(), !same, overrides_file_, "nodata value");
    // A value that overrides the file's was already applied when the file was opened.
    if (!is_applied || overrides_file_) return;
    nodata_ = rule;
    info_.nodata = nodata_->value;
    constexpr std::uint64_t kWindowColumns = 4096;  // most windows are not wider
    info_.held_bytes +=
        std::min(info_.columns, kWindowColumns) * kStripRows * (size_of(info_.sample.type) + 1);
  }

  std::unique_ptr<Raster> raster_;
  RasterInfo info_;
  std::string sidecar_;
  bool overrides_file_ = false;       ///< see is_overridden()
  std::optional<NodataRule> nodata_;  ///< the sidecar's, applied to the file's samples
  std::vector<std::byte> samples_;
  std::vector<std::uint8_t> valid_;
};

}  // namespace

std::optional<WorldFile> world_file_of(const std::string& file) {
  if (file == kStandardStream) return std::nullopt;
  const std::string ending = lower_case(fs::path(file).extension().string());
  for (const std::string& world_ending : world_endings(ending)) {
    const fs::path path = fs::path(file).replace_extension(world_ending);
    std::error_code ignored;
    if (!fs::is_regular_file(path, ignored)) continue;
    return WorldFile{.name = path.string(), .world = read_world_file(path.string())};
  }
  return std::nullopt;
}

void place_by_world_file(const std::string& file, RasterInfo& info) {
  const auto comment = std::find(info.comments.begin(), info.comments.end(), kNoGeoreferencing);
  if (comment == info.comments.end()) return;
  const std::optional<WorldFile> world_file = world_file_of(file);
  if (!world_file) return;
  info.world = world_file->world;
  info.comments.erase(comment);
}

std::unique_ptr<Raster> open_with_aux_xml(const OpenRaster& open, const std::string& file,
                                          const RasterOptions& options) {
  const std::string sidecar = file + ".aux.xml";
  std::error_code ignored;
  std::unique_ptr<Raster> raster = open(file, options);
  // GDAL ignores sidecars of virtual rasters.
  if (raster->info().format == "vrt" || !std::filesystem::is_regular_file(sidecar, ignored)) {
    return raster;
  }
  XmlElement root;
  try {
    root = read_pam(sidecar);
  } catch (const Error& error) {
    return std::make_unique<WithAuxXml>(std::move(raster), sidecar,
                                        std::string("ignored: ") + error.what());
  }
  if (root.name != "PAMDataset") return raster;
  const std::optional<double> file_value = raster->info().nodata;
  const XmlElement* const band = band_of(root, options);
  const XmlElement* const nodata = band != nullptr ? band->child("NoDataValue") : nullptr;
  if (nodata != nullptr && is_overridden(raster->info()) &&
      NodataRule::parse(nodata->text, raster->info().sample.type).value) {
    RasterOptions overridden = options;
    overridden.nodata = nodata->text;
    raster = open(file, overridden);
  }
  return std::make_unique<WithAuxXml>(std::move(raster), sidecar, root, file_value, band);
}

}  // namespace terrace::stream
