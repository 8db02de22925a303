// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "format/ept/metadata.hpp"
#include "format/foreign_format.hpp"
#include "format/formats.hpp"
#include "format/grid/binary_grid.hpp"
#include "format/input_files.hpp"
#include "format/selection.hpp"
#include "format/spooled_source.hpp"
#include "io/peek.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kHeadBytes = 4096;
/// In the order of Entities.
constexpr std::array<std::string_view, 4> kEntityNames{"points", "triangles", "segments",
                                                       "polylines"};

std::string known_formats() {
  std::string out;
  for (const Format& format : formats()) {
    if (!out.empty()) out += ", ";
    out += format.name;
  }
  return out;
}

std::string ending_of(const std::filesystem::path& file) {
  return lower_case(file.extension().string());
}

/// The format that an ending tells; nullptr if none.
const Format* format_of_ending(const std::string& ending) {
  for (const Format& format : formats()) {
    const auto& known = format.endings;
    if (std::find(known.begin(), known.end(), ending) != known.end()) return &format;
  }
  return nullptr;
}

/// The format that reads packed files itself and whose name this has: ".hgt.zip".
const Format* packed_format_of(const std::string& file) {
  const std::string ending = ending_of(file);
  if (ending != ".zip" && ending != ".gz") return nullptr;
  return format_of_ending(ending_of(std::filesystem::path(file).stem()) + ending);
}

bool is_ept_name(const std::string& file) {
  return std::filesystem::path(file).filename() == kEptName;
}

[[noreturn]] void refuse(const std::string& file, const ForeignFormat& format) {
  throw Error({.file = shown_name(file),
               .where = {},
               .cause = "is " + std::string(format.name) + ", which cannot be read",
               .remedy = std::string(format.remedy)});
}

/// By name, else by content, else by ending. A file whose ending is known but whose content is not
/// goes to the ending's reader, which can say best what is wrong with it. Formats that are known
/// and not read are refused before the last of formats(), text, is asked, as some look like it.
const Format& format_of(const std::string& file, const SourceOptions& options) {
  if (!options.format.empty()) {
    for (const Format& format : formats()) {
      if (format.name == options.format) return format;
    }
    throw std::invalid_argument("unknown input format '" + options.format + "'; known are " +
                                known_formats());
  }
  const std::vector<char> head = peek_head(file, kHeadBytes, options.stop);
  const auto bytes = std::as_bytes(std::span(head));
  const std::span<const Format> telling = formats().first(formats().size() - 1);
  for (const Format& format : telling) {
    if (format.recognise(bytes)) return format;
  }
  if (is_ept_name(file)) return ept_format();
  if (const Format* const packed = packed_format_of(file)) return *packed;
  if (const auto* foreign = foreign_format_of_content({head.data(), head.size()})) {
    refuse(file, *foreign);
  }
  if (formats().back().recognise(bytes)) return formats().back();
  if (const Format* const format = format_of_name(file)) return *format;
  const ForeignFormat* const foreign = foreign_format_of_ending(ending_of(file));
  if (foreign != nullptr && !head.empty()) refuse(file, *foreign);
  throw Error(
      {.file = shown_name(file),
       .where = {},
       .cause = head.empty() ? "the file is empty" : "neither content nor name tell its format",
       .remedy = head.empty() ? "fetch or write the file again"
                              : "convert a raster (gdal_translate FILE out.tif), or name the "
                                "format: " +
                                    known_formats()});
}

/// Lets go of pipes that were looked at but not opened.
struct HeadScope {
  HeadScope() = default;
  ~HeadScope() { drop_heads(); }
  HeadScope(const HeadScope&) = delete;
  HeadScope& operator=(const HeadScope&) = delete;
};

/// What open_source() does but for reading ahead.
std::unique_ptr<PointSource> open_here(std::span<const std::string> files,
                                       const SourceOptions& options) {
  const HeadScope scope;
  const Format& format = format_of(files.front(), options);
  bool spooled = false;
  for (const std::string& file : files) {
    const Format& other = format_of(file, options);
    if (&other != &format) {
      throw Error({.file = shown_name(file),
                   .where = {},
                   .cause = "is " + other.name + ", but " + shown_name(files.front()) + " is " +
                            format.name,
                   .remedy = "name files of one format, or select those of a folder by `format`"});
    }
    if (is_seekable(file) || packed_format_of(file) == &format) continue;
    if (!format.streams && !format.self_contained) {
      throw Error({.file = shown_name(file),
                   .where = {},
                   .cause = format.name + " cannot be read from a pipe or out of gzip",
                   .remedy = "name a file, unpacked"});
    }
    spooled = spooled || !format.streams;
  }
  if (std::count(files.begin(), files.end(), kStandardStream) > 1) {
    throw Error({.file = "standard input",
                 .where = {},
                 .cause = "is named twice",
                 .remedy = "it can be read only once"});
  }
  if (options.heights_of_colour != HeightsOfColour::none && format.name != png_format().name) {
    throw Error({.file = shown_name(files.front()),
                 .where = {},
                 .cause = "is " + format.name + ", whose heights are no colours",
                 .remedy = "leave `heights_of_colour` out"});
  }
  if (options.selection.resolution > 0 && format.name != las_format().name &&
      format.name != ept_format().name) {
    throw Error({.file = shown_name(files.front()),
                 .where = {},
                 .cause = "is " + format.name + ", which has no octree to read to a resolution",
                 .remedy = "name a COPC file or EPT, or leave `resolution` out"});
  }
  const bool triangles = options.entities == Entities::triangles;
  if (options.entities != Entities::points && !(triangles ? format.triangles : format.lines)) {
    throw Error(
        {.file = shown_name(files.front()),
         .where = {},
         .cause = "is " + format.name + ", which has no " + (triangles ? "triangles" : "lines"),
         .remedy =
             std::string(triangles ? "name a mesh (GLB, OBJ, OFF, PLY, STL)" : "name GeoJSON") +
             ", or leave `entities` out"});
  }
  auto source = spooled ? open_spooled(format, files, options) : format.open(files, options);
  if (options.cell > 0 && !source->info().grid) {
    throw Error({.file = shown_name(files.front()),
                 .where = {},
                 .cause = "is " + format.name + ", whose points are no cells",
                 .remedy = "leave `cell` out"});
  }
  if (options.band != 1 && !source->info().grid) {
    throw Error({.file = shown_name(files.front()),
                 .where = {},
                 .cause = "is " + format.name + ", whose points have no bands",
                 .remedy = "leave `band` out"});
  }
  return selection_of(std::move(source), options);
}

}  // namespace

std::string_view name_of(Entities entities) {
  return kEntityNames[static_cast<std::size_t>(entities)];
}

std::optional<Entities> entities_named(std::string_view name) {
  const auto found = std::find(kEntityNames.begin(), kEntityNames.end(), name);
  if (found == kEntityNames.end()) return std::nullopt;
  return static_cast<Entities>(found - kEntityNames.begin());
}

std::span<const Format> formats() {
  // The most telling content first: text is whatever looks like a table of numbers.
  static const std::array<Format, 16> all{
      geotiff_format(),  vrt_format(), las_format(),         ept_format(),
      ply_format(),      glb_format(), hgt_format(),         ascii_grid_format(),
      usgs_dem_format(), png_format(), binary_grid_format(), obj_format(),
      off_format(),      stl_format(), geojson_format(),     xyz_format()};
  return all;
}

const Format* format_of_name(const std::string& file) {
  if (is_ept_name(file)) return &ept_format();
  if (const Format* const packed = packed_format_of(file)) return packed;
  const std::string ending = ending_of(file);
  // Of GTOPO30 and SRTM30; those of the USGS have no header beside them.
  if (ending == ".dem" && !binary_header_of(file).empty()) return &binary_grid_format();
  return format_of_ending(ending == ".gz" ? ending_of(std::filesystem::path(file).stem()) : ending);
}

std::unique_ptr<PointSource> open_source(std::span<const std::string> names,
                                         const SourceOptions& options) {
  if (names.empty()) throw std::invalid_argument("there is no file to open");
  if (options.block_points == 0) throw std::invalid_argument("block_points must be above 0");
  const std::vector<std::string> files = input_files(names, options.format);
  if (options.blocks_ahead == 0) return open_here(files, options);
  // The reading ends with the source too, not by the caller's stop alone.
  std::stop_source reading;
  SourceOptions inner = options;
  inner.stop = reading.get_token();
  const std::stop_callback on_stop(options.stop, [&reading] { reading.request_stop(); });
  return read_ahead(open_here(files, inner), options.blocks_ahead, reading, options.stop);
}

}  // namespace terrace::stream
