// SPDX-License-Identifier: Apache-2.0
#include "format/aux_xml.hpp"

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

#include "format/geotiff/georeference.hpp"
#include "format/vrt/xml.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "raster/nodata.hpp"
#include "raster/overlay.hpp"
#include "raster/plain_world.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

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
  return read_xml(file, [](std::span<const XmlElement> open, const XmlElement& done) {
    if (open.size() == 1) {
      return done.name != kPamBand && done.name != "SRS" && done.name != "GeoTransform";
    }
    // Statistics and histograms.
    return open.size() > 2 || !done.children.empty() || done.text.size() > 100;
  });
}

class WithAuxXml final : public Raster {
 public:
  WithAuxXml(std::unique_ptr<Raster> raster, const std::string& sidecar,
             const RasterOptions& options)
      : raster_(std::move(raster)), info_(raster_->info()) {
    XmlElement root;
    try {
      root = read_pam(sidecar);
    } catch (const Error& error) {
      info_.comments.push_back(std::string("left aside: ") + error.what());
      return;
    }
    if (root.name != "PAMDataset") return;
    const XmlElement* const srs = root.child("SRS");
    if (srs != nullptr && lacks_crs(info_.crs)) info_.crs.wkt = trim(srs->text);
    if (const XmlElement* const place = root.child("GeoTransform")) read_place(place->text);
    // The samples of colours are not those that the file says something of.
    if (options.heights_of_colour != HeightsOfColour::none) return;
    for (const XmlElement& band : root.children) {
      if (band.name == kPamBand && finite_number(band.attribute("band")) == options.band) {
        read_band(band);
      }
    }
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
        const std::size_t from = r * columns, to = (row + r) * out.stride;
        for (std::size_t first = 0, end = 0; first < columns; first = end + 1) {
          // Runs of cells that the file has.
          while (first < columns && valid_[from + first] == 0) ++first;
          end = first;
          while (end < columns && valid_[from + end] != 0) ++end;
          if (end == first) continue;
          any |= overlay_row(info_.sample.type,
                             {.samples = samples_.data() + (from + first) * bytes,
                              .step = 1,
                              .cells = end - first},
                             *nodata_, out.samples + (to + first) * bytes, out.valid + to + first);
        }
      }
    }
    return any;
  }

 private:
  static constexpr std::uint64_t kStripRows = 256;

  void read_place(const std::string& text) {
    if (info_.world != kPlainWorld) return;
    const std::vector<std::string_view> words = split_fields(trim(text), ',');
    std::array<double, 6> g{};
    for (std::size_t i = 0; i < g.size(); ++i) {
      const auto number = i < words.size() ? finite_number(words[i]) : std::nullopt;
      if (!number) return;
      g[i] = *number;
    }
    const double area = g[1] * g[5] - g[2] * g[4];
    if (!std::isfinite(area) || area == 0) return;
    // From the corner of the first cell to its middle.
    info_.world.xy = {g[1], g[2], g[0] + 0.5 * (g[1] + g[2]),
                      g[4], g[5], g[3] + 0.5 * (g[4] + g[5])};
    std::erase(info_.comments, kNoGeoreferencing);
  }

  void read_band(const XmlElement& band) {
    Channel& sample = info_.sample;
    if (const XmlElement* const nodata = band.child("NoDataValue"); nodata && !info_.nodata) {
      nodata_ = NodataRule::parse(nodata->text, sample.type);
      info_.nodata = nodata_->value;
      constexpr std::uint64_t kWindowColumns = 4096;  // of most windows
      info_.held_bytes +=
          std::min(info_.columns, kWindowColumns) * kStripRows * (size_of(sample.type) + 1);
    }
    if (sample.scale == 1 && sample.offset == 0) {
      const auto number = [&](const char* name, double otherwise) {
        const XmlElement* const element = band.child(name);
        return element != nullptr ? finite_number(element->text).value_or(otherwise) : otherwise;
      };
      const double scale = number("Scale", 1);
      if (scale != 0) sample.scale = scale;
      sample.offset = number("Offset", 0);
    }
    if (const XmlElement* const unit = band.child("UnitType"); unit && sample.unit.empty()) {
      sample.unit = info_.crs.vertical_unit = canonical_unit(std::string(trim(unit->text)));
    }
  }

  std::unique_ptr<Raster> raster_;
  RasterInfo info_;
  std::optional<NodataRule> nodata_;  ///< besides that of the file
  std::vector<std::byte> samples_;
  std::vector<std::uint8_t> valid_;
};

}  // namespace

std::unique_ptr<Raster> with_aux_xml(std::unique_ptr<Raster> raster, const std::string& file,
                                     const RasterOptions& options) {
  const std::string sidecar = file + ".aux.xml";
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(sidecar, ignored)) return raster;
  return std::make_unique<WithAuxXml>(std::move(raster), sidecar, options);
}

}  // namespace terrace::stream
