// SPDX-License-Identifier: Apache-2.0
#include "format/vrt/document.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/core.h>

#include "format/sidecars.hpp"
#include "format/vrt/xml.hpp"
#include "io/number.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/unit_words.hpp"

namespace terrace::stream {
namespace {

constexpr std::uint64_t kMaxVrtCells = 1u << 30;

/// Reads the description of a virtual raster while its XML is parsed.
class VrtReader {
 public:
  VrtReader(const std::string& file, int band) : file_(file), band_number_(band) {
    const XmlElement root =
        read_xml(file, [this](std::span<const XmlElement> open, const XmlElement& element) {
          return take(open, element);
        });
    read_dataset(root);
    read_georeference(root);
    read_band(root);
  }

  VrtDocument document() && {
    if (farthest_ > kSameCell) {
      std::ostringstream note;
      note.precision(2);
      note << file_ << ": its sources are up to " << farthest_
           << " of a cell off its cells and are moved to the nearest ones";
      info_.notes.push_back(note.str());
    }
    return {std::move(info_), std::move(sources_), nodata_};
  }

 private:
  static constexpr const char* kConvertRemedy =
      "convert it to GeoTIFF: gdal_translate FILE out.tif";

  [[nodiscard]] Error fault(std::string cause) const {
    return Error(file_, std::move(cause)).remedy("rebuild it: gdalbuildvrt");
  }

  [[nodiscard]] double number(const std::string& text, const std::string& where) const {
    const std::string_view trimmed = trim(text);
    double value = 0;
    if (trimmed.empty() ||
        parse_real(trimmed.data(), trimmed.data() + trimmed.size(), value) !=
            trimmed.data() + trimmed.size() ||
        !std::isfinite(value)) {
      throw fault(in_quotes(text) + " is not a number").at(where);
    }
    return value;
  }

  /// Reads the sources as they come, because there may be very many. Drops all elements that do not
  /// concern the samples.
  bool take(std::span<const XmlElement> open, const XmlElement& element) {
    if (open.size() == 1) {
      if (element.name == kBand) ++bands_;
      return element.name != kBand && element.name != "SRS" && element.name != "GeoTransform" &&
             element.name != "MaskBand";
    }
    if (open[1].name != kBand || bands_ + 1 != band_number_) return true;
    if (open.size() > 2) return !open[2].name.ends_with("Source");
    if (element.name == "SimpleSource" || element.name == "ComplexSource") {
      if (sources_.empty()) {
        read_dataset(open[0]);
        read_kind(open[1]);
      }
      sources_.push_back(source_of(element));
      return true;
    }
    return !element.name.ends_with("Source") && element.name != "MaskBand" &&
           element.name != "NoDataValue" && element.name != "Scale" && element.name != "Offset" &&
           element.name != "UnitType";
  }

  void read_dataset(const XmlElement& root) {
    if (root.name != "VRTDataset") throw fault("is XML, but not a VRTDataset");
    if (const std::string kind = root.attribute("subClass"); !kind.empty()) {
      throw fault("is a " + in_quotes(kind) + ", which computes its samples")
          .at("VRTDataset")
          .remedy(kConvertRemedy);
    }
    info_.columns = size_of_side(root, "rasterXSize");
    info_.rows = size_of_side(root, "rasterYSize");
  }

  [[nodiscard]] std::uint64_t size_of_side(const XmlElement& root, const char* name) const {
    const double value = number(root.attribute(name), name);
    if (!(value >= 1) || value >= static_cast<double>(kMaxVrtCells) || value != std::floor(value)) {
      throw fault("is not a number of cells from 1 to 2^30 - 1").at(name);
    }
    return static_cast<std::uint64_t>(value);
  }

  void read_georeference(const XmlElement& root) {
    info_.format = "vrt";
    info_.files = {file_};
    if (const XmlElement* const srs = root.child("SRS")) info_.crs = crs_of_srs(srs->text);
    const XmlElement* const transform = root.child("GeoTransform");
    if (transform == nullptr) {
      info_.world = kPlainWorld;
      info_.comments.push_back(kNoGeoreferencing);
      return;
    }
    const std::vector<std::string_view> words = split_fields(trim(transform->text), ',');
    if (words.size() != 6) throw fault("does not have six numbers").at("GeoTransform");
    std::array<double, 6> g{};
    for (std::size_t i = 0; i < 6; ++i) g[i] = number(std::string(words[i]), "GeoTransform");
    // From the corner of the first cell to its middle.
    info_.world.xy = {g[1], g[2], g[0] + 0.5 * (g[1] + g[2]),
                      g[4], g[5], g[3] + 0.5 * (g[4] + g[5])};
    const double area = g[1] * g[5] - g[2] * g[4];
    if (!std::isfinite(area) || area == 0) {
      throw fault("does not map cells to distinct places").at("GeoTransform");
    }
  }

  void read_band(const XmlElement& root) {
    if (root.child("MaskBand") != nullptr)
      throw fault("is not supported").at("MaskBand").remedy(kConvertRemedy);
    if (band_number_ > bands_) {
      throw fault(fmt::format("has no band {}, only {}", band_number_, bands_))
          .remedy("choose another band, or rebuild it: gdalbuildvrt");
    }
    int number_of_band = 0;
    for (const XmlElement& element : root.children) {
      if (element.name != kBand || ++number_of_band != band_number_) continue;
      read_kind(element);
      for (const XmlElement& part : element.children) read_part(part);
    }
    info_.nodata = nodata_.value;
  }

  void read_kind(const XmlElement& band) {
    if (const std::string kind = band.attribute("subClass"); !kind.empty()) {
      throw fault("is a " + in_quotes(kind) + ", which computes its samples")
          .at("VRTRasterBand")
          .remedy(kConvertRemedy);
    }
    info_.sample.name = "height";
    info_.sample.type = type_of(band.attribute("dataType"));
  }

  [[nodiscard]] ScalarType type_of(const std::string& name) const {
    constexpr std::array<std::pair<std::string_view, ScalarType>, 10> kTypes{
        {{"Byte", ScalarType::u8},
         {"Int8", ScalarType::i8},
         {"UInt16", ScalarType::u16},
         {"Int16", ScalarType::i16},
         {"UInt32", ScalarType::u32},
         {"Int32", ScalarType::i32},
         {"UInt64", ScalarType::u64},
         {"Int64", ScalarType::i64},
         {"Float32", ScalarType::f32},
         {"Float64", ScalarType::f64}}};
    for (const auto& [known, type] : kTypes) {
      if (name == known) return type;
    }
    if (name.empty()) return ScalarType::u8;  // GDAL's default
    throw fault(in_quotes(name) + " is not a type of heights")
        .at("dataType")
        .remedy(kConvertRemedy);
  }

  void read_part(const XmlElement& part) {
    if (part.name.ends_with("Source") || part.name == "MaskBand") {
      throw fault("is not supported").at(part.name).remedy(kConvertRemedy);
    } else if (part.name == "NoDataValue") {
      nodata_ = NodataRule::parse(std::string(trim(part.text)), info_.sample.type);
    } else if (part.name == "Scale") {
      info_.sample.scale = number(part.text, "Scale");
      if (info_.sample.scale == 0) throw fault("is zero").at("Scale");
    } else if (part.name == "Offset") {
      info_.sample.offset = number(part.text, "Offset");
    } else if (part.name == "UnitType") {
      info_.sample.unit = info_.crs.vertical_unit = canonical_unit(part.text);
    }
  }

  VrtSource source_of(const XmlElement& element) {
    VrtSource source;
    for (const XmlElement& part : element.children) {
      if (part.name == "SourceFilename") {
        source.file = trim(part.text);
        if (part.attribute("relativeToVRT") == "1") {
          source.file = (std::filesystem::path(file_).parent_path() / source.file).string();
        }
      } else if (part.name == "SourceBand") {
        const double band = number(part.text, "SourceBand");
        if (!(band >= 1 && band < 65536)) throw fault("is not a band number").at("SourceBand");
        source.band = static_cast<int>(band);
      } else if (part.name == "NODATA") {
        source.nodata = std::string(trim(part.text));
      } else if ((part.name == "ScaleRatio" && number(part.text, part.name) == 1) ||
                 (part.name == "ScaleOffset" && number(part.text, part.name) == 0)) {
        continue;
      } else if (part.name != "SrcRect" && part.name != "DstRect" &&
                 part.name != "SourceProperties") {
        throw fault(in_quotes(part.name) + " is not supported")
            .at(element.name)
            .remedy(kConvertRemedy);
      }
    }
    if (source.file.empty()) throw fault("names no file").at(element.name);
    read_rectangles(element, source);
    return source;
  }

  /// Reads which cells of a source are which cells of the mosaic. They must be whole cells, and as
  /// many of the source as of the mosaic.
  void read_rectangles(const XmlElement& element, VrtSource& source) {
    using Rect = std::array<double, 4>;  // offset and size, as in the file
    const auto rect = [&](const char* name) -> std::optional<Rect> {
      const XmlElement* const child = element.child(name);
      if (child == nullptr) return std::nullopt;
      Rect r{};
      constexpr std::array kNames{"xOff", "yOff", "xSize", "ySize"};
      for (std::size_t i = 0; i < 4; ++i) {
        const double value = number(child->attribute(kNames[i]), name);
        r[i] = std::round(value);
        const double distance = std::abs(value - r[i]);
        if (distance > kNearestCell) {
          throw fault("is not on whole cells, so its source would be resampled")
              .at(name)
              .remedy("align the files: gdalbuildvrt -tap -tr, or make a GeoTIFF: gdal_translate");
        }
        farthest_ = std::max(farthest_, distance);
        if (!(r[i] >= (i < 2 ? 0 : 1)) || r[i] >= static_cast<double>(kMaxVrtCells)) {
          throw fault("is outside the raster").at(name).remedy(kConvertRemedy);
        }
      }
      return r;
    };
    const auto columns = static_cast<double>(info_.columns), rows = static_cast<double>(info_.rows);
    const Rect all_cells{0, 0, columns, rows};
    const Rect source_rect = rect("SrcRect").value_or(all_cells),
               target_rect = rect("DstRect").value_or(all_cells);
    if (source_rect[2] != target_rect[2] || source_rect[3] != target_rect[3]) {
      throw fault("is not as large as its SrcRect, so its source would be resampled")
          .at("DstRect")
          .remedy("align the files: gdalbuildvrt -tap -tr, or make a GeoTIFF: gdal_translate");
    }
    if (target_rect[0] + target_rect[2] > columns || target_rect[1] + target_rect[3] > rows) {
      throw fault("is outside the raster").at("DstRect").remedy(kConvertRemedy);
    }
    const auto cells = [](double value) { return static_cast<std::uint64_t>(value); };
    source.source_column = cells(source_rect[0]);
    source.source_row = cells(source_rect[1]);
    source.column = cells(target_rect[0]);
    source.row = cells(target_rect[1]);
    source.columns = cells(target_rect[2]);
    source.rows = cells(target_rect[3]);
  }

  static constexpr std::string_view kBand = "VRTRasterBand";

  const std::string& file_;
  int band_number_;
  int bands_ = 0;  ///< number of bands read to their end
  RasterInfo info_;
  NodataRule nodata_;
  double farthest_ = 0;  ///< largest distance of a source from the mosaic's cells, in cells
  std::vector<VrtSource> sources_;
};

}  // namespace

Crs crs_of_srs(std::string_view text) {
  while (!text.empty() && is_white_space(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_white_space(text.back())) text.remove_suffix(1);
  Crs crs;
  constexpr std::string_view kEpsg = "epsg:";
  if (lower_case(std::string(text.substr(0, kEpsg.size()))) == kEpsg) {
    int horizontal = 0, vertical = 0;
    const char *at = text.data() + kEpsg.size(), *const end = text.data() + text.size();
    const auto code = [&](int& value) {
      const auto [rest, error] = std::from_chars(at, end, value);
      at = rest;
      return error == std::errc{} && value > 0;
    };
    const bool read = code(horizontal) && (at == end || (*at++ == '+' && code(vertical)));
    if (read && at == end) {
      crs.epsg = horizontal;
      crs.vertical_epsg = vertical;
      return crs;
    }
  }
  crs.wkt = text;
  return crs;
}

VrtDocument read_vrt(const std::string& file, int band) { return VrtReader(file, band).document(); }

}  // namespace terrace::stream
