// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

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

/// The names of all formats, or of those with a capability.
std::string names_of_formats(bool Format::*capability = nullptr) {
  std::string out;
  for (const Format& format : formats()) {
    if (capability != nullptr && !(format.*capability)) continue;
    if (!out.empty()) out += ", ";
    out += format.name;
  }
  return out;
}

std::string ending_of(const std::filesystem::path& file) {
  return lower_case(file.extension().string());
}

/// The format with that file ending; nullptr if there is none.
const Format* format_of_ending(const std::string& ending) {
  for (const Format& format : formats()) {
    const auto& known = format.endings;
    if (std::find(known.begin(), known.end(), ending) != known.end()) return &format;
  }
  return nullptr;
}

/// The format that unpacks files itself and has this file's double ending, such as ".hgt.zip".
const Format* packed_format_of(const std::string& file) {
  const std::string ending = ending_of(file);
  if (ending != ".zip" && ending != ".gz") return nullptr;
  return format_of_ending(ending_of(std::filesystem::path(file).stem()) + ending);
}

bool is_ept_name(const std::string& file) {
  return std::filesystem::path(file).filename() == kEptName;
}

Error unsupported(const std::string& file, const ForeignFormat& format) {
  return Error(shown_name(file), fmt::format("is {}, which cannot be read", format.name))
      .remedy(std::string(format.remedy));
}

/// Determines the format by options.format, else by content, else by ending. A file with a known
/// ending but unknown content goes to that ending's reader, which can best report what is wrong.
/// Known formats that cannot be read are refused before text, the last of formats(), is tried,
/// because some of them look like text.
const Format& format_of(const std::string& file, const SourceOptions& options) {
  if (!options.format.empty()) {
    for (const Format& format : formats()) {
      if (format.name == options.format) return format;
    }
    throw std::invalid_argument(
        fmt::format("unknown input format '{}'; known are {}", options.format, names_of_formats()));
  }
  const std::vector<char> head = peek_head(file, kHeadBytes, options.stop);
  const auto bytes = std::as_bytes(std::span(head));
  const std::span<const Format> distinctive = formats().first(formats().size() - 1);
  for (const Format& format : distinctive) {
    if (format.recognise(bytes)) return format;
  }
  if (is_ept_name(file)) return ept_format();
  if (const Format* const packed = packed_format_of(file)) return *packed;
  if (const auto* foreign = foreign_format_of_content({head.data(), head.size()})) {
    throw unsupported(file, *foreign);
  }
  if (formats().back().recognise(bytes)) return formats().back();
  if (const Format* const format = format_of_name(file)) return *format;
  const ForeignFormat* const foreign = foreign_format_of_ending(ending_of(file));
  if (foreign != nullptr && !head.empty()) throw unsupported(file, *foreign);
  throw Error(shown_name(file),
              head.empty() ? "the file is empty" : "neither content nor name shows its format")
      .remedy(head.empty() ? "download or export the file again"
                           : "convert a raster (gdal_translate FILE out.tif), or name the "
                             "format: " +
                                 names_of_formats());
}

/// Releases pipes that were peeked at but not opened.
struct HeadScope {
  HeadScope() = default;
  ~HeadScope() { drop_heads(); }
  HeadScope(const HeadScope&) = delete;
  HeadScope& operator=(const HeadScope&) = delete;
};

/// An option that only formats with a capability support.
struct Requirement {
  bool Format::*capability;
  bool (*is_set)(const SourceOptions& options);
  std::string_view option;   ///< in the terms of SourceOptions
  std::string_view lack;     ///< follows the name of a format without the capability
  std::string_view example;  ///< of what has the capability
};

constexpr std::array<Requirement, 6> kRequirements{{
    {&Format::height_colours,
     [](const SourceOptions& o) { return o.heights_of_colour != HeightsOfColour::none; },
     "heights_of_colour", "does not encode heights as colours", "an image"},
    {&Format::octree, [](const SourceOptions& o) { return o.selection.resolution > 0; },
     "resolution", "has no octree", "a COPC file or EPT"},
    {&Format::triangles, [](const SourceOptions& o) { return o.entities == Entities::triangles; },
     "entities", "has no triangles", "a mesh"},
    {&Format::lines,
     [](const SourceOptions& o) {
       return o.entities == Entities::segments || o.entities == Entities::polylines;
     },
     "entities", "has no lines", "a file of lines"},
    {&Format::raster, [](const SourceOptions& o) { return o.cell > 0; }, "cell",
     "is not a raster format", "a raster"},
    {&Format::raster, [](const SourceOptions& o) { return o.band != 1; }, "band", "has no bands",
     "a raster"},
}};

/// Throws: Error if an option needs a capability that the format lacks.
void check_capabilities(const Format& format, const std::string& file,
                        const SourceOptions& options) {
  for (const Requirement& requirement : kRequirements) {
    if (format.*requirement.capability || !requirement.is_set(options)) continue;
    throw Error(shown_name(file), fmt::format("{} {}", format.name, requirement.lack))
        .remedy(fmt::format("name {} ({}), or leave `{}` out", requirement.example,
                            names_of_formats(requirement.capability), requirement.option));
  }
}

/// Determines the format that all files have. Throws: Error if they differ.
const Format& common_format(std::span<const std::string> files, const SourceOptions& options) {
  const Format& format = format_of(files.front(), options);
  for (const std::string& file : files.subspan(1)) {
    const Format& other = format_of(file, options);
    if (&other == &format) continue;
    throw Error(shown_name(file), fmt::format("is {}, but {} is {}", other.name,
                                              shown_name(files.front()), format.name))
        .remedy("name files of one format, or select files of a folder by `format`");
  }
  return format;
}

/// Whether files from pipes or gzip must be copied before the format can read them. Throws: Error
/// if copies would not help.
bool needs_copies(const Format& format, std::span<const std::string> files) {
  if (std::count(files.begin(), files.end(), kStandardStream) > 1) {
    throw Error("standard input", "is named twice")
        .remedy("name it once: it can be read only once");
  }
  if (format.streams) return false;
  bool copies = false;
  for (const std::string& file : files) {
    if (is_seekable(file) || packed_format_of(file) == &format) continue;
    if (!format.self_contained) {
      throw Error(shown_name(file), format.name + " cannot be read from a pipe or from gzip")
          .remedy("name an unpacked file");
    }
    copies = true;
  }
  return copies;
}

/// open_source() without reading ahead.
std::unique_ptr<PointSource> open_here(std::span<const std::string> files,
                                       const SourceOptions& options) {
  const HeadScope scope;
  const Format& format = common_format(files, options);
  const bool copies = needs_copies(format, files);
  check_capabilities(format, files.front(), options);
  return selection_of(copies ? open_spooled(format, files, options) : format.open(files, options),
                      options);
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
  // The most distinctive content first. Text comes last: anything like a table of numbers counts.
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
  // GTOPO30 and SRTM30 also end in .dem; unlike USGS DEMs, they have a header file next to them.
  if (ending == ".dem" && !binary_header_of(file).empty()) return &binary_grid_format();
  return format_of_ending(ending == ".gz" ? ending_of(std::filesystem::path(file).stem()) : ending);
}

std::unique_ptr<PointSource> open_source(std::span<const std::string> names,
                                         const SourceOptions& options) {
  if (names.empty()) throw std::invalid_argument("there is no file to open");
  if (options.block_points == 0) throw std::invalid_argument("block_points must be positive");
  const std::vector<std::string> files = input_files(names, options.format);
  if (options.blocks_ahead == 0) return open_here(files, options);
  // Reading ends when the source is destroyed, not only when the caller requests a stop.
  std::stop_source reading;
  SourceOptions inner = options;
  inner.stop = reading.get_token();
  const std::stop_callback on_stop(options.stop, [&reading] { reading.request_stop(); });
  return read_ahead(open_here(files, inner), options.blocks_ahead, reading, options.stop);
}

}  // namespace terrace::stream
