// SPDX-License-Identifier: Apache-2.0
#include "format/registry.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/core.h>

#include "format/ept/metadata.hpp"
#include "format/grid/binary.hpp"
#include "io/peek.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

using std::string_view_literals::operator""sv;

/// A format that is not supported but common for points, rasters and meshes.
struct ForeignFormat {
  std::string_view name;    ///< with a description, to follow "is"
  std::string_view remedy;  ///< how to convert such a file into a readable one
};

/// Bytes near the beginning of a file that identify a format.
struct Mark {
  std::size_t at = 0;
  std::string_view bytes;
  bool any_case = false;
};

/// How to recognise a foreign format.
struct ForeignRow {
  ForeignFormat format;
  std::string_view endings;  ///< ".a .b"
  Mark first, second{};      ///< both must match, if there are two; `first` may be indented text
};

constexpr std::string_view kRaster = "convert it, e.g. 'gdal_translate FILE out.tif'";
constexpr std::string_view kVector =
    "convert its points to text, e.g. 'ogr2ogr -f CSV -lco GEOMETRY=AS_XYZ out.csv FILE'";

// More specific rows come first.
constexpr ForeignRow kForeignFormats[] = {
    // Points.
    {{"E57", "convert it to PLY, e.g. with CloudCompare or 'pdal translate FILE out.ply'"},
     ".e57",
     {0, "ASTM-E57"}},
    {{"PCD (a cloud of the Point Cloud Library)",
      "convert it, e.g. 'pcl_pcd2ply FILE out.ply' or 'pdal translate FILE out.ply'"},
     ".pcd",
     {0, "# .PCD"}},
    // Rasters.
    {{"an ESRI binary grid", kRaster}, ".adf", {0, "HDR1.2\0\0"sv}},
    {{"the header of a binary grid", "name the .bil or .flt file next to it"}, ".hdr", {}},
    {{"HDF5 or NetCDF 4",
      "convert one of its variables ('gdalinfo FILE' lists them), e.g. 'gdal_translate "
      "NETCDF:FILE:VARIABLE out.tif'"},
     ".h5 .hdf5 .he5",
     {0, "\x89HDF\r\n\x1a\n"sv}},
    {{"NetCDF",
      "convert one of its variables ('gdalinfo FILE' lists them), e.g. 'gdal_translate "
      "NETCDF:FILE:VARIABLE out.tif'"},
     ".nc .nc4 .cdf",
     {0, "CDF"}},
    {{"HDF4", kRaster}, ".hdf", {0, "\x0e\x03\x13\x01"sv}},
    {{"GRIB", kRaster}, ".grib .grib2 .grb .grb2", {0, "GRIB"}},
    {{"JPEG 2000", kRaster}, ".jp2 .j2k", {4, "jP  "}},
    {{"JPEG 2000", kRaster}, "", {0, "\xff\x4f\xff\x51"sv}},
    {{"an ERDAS Imagine raster", kRaster}, ".img", {0, "EHFA_HEADER_TAG"}},
    {{"DTED", kRaster}, ".dt0 .dt1 .dt2", {0, "UHL1"}},
    {{"NITF", kRaster}, ".ntf .nitf", {0, "NITF0"}},
    {{"a VTP binary terrain", kRaster}, ".bt", {0, "binterr1"}},
    {{"a SAGA grid", kRaster}, ".sdat .sgrd", {}},
    {{"an ER Mapper raster", kRaster}, ".ers", {}},
    {{"a Surfer grid", kRaster}, "", {0, "DSBB"}},
    {{"a Surfer grid", kRaster}, "", {0, "DSRB"}},
    {{"a Surfer grid", kRaster}, ".grd", {0, "DSAA"}},
    {{"a JPEG picture", "its numbers are colours, not heights: look for the GeoTIFF"},
     ".jpg .jpeg",
     {0, "\xff\xd8\xff"sv}},
    // Vectors.
    {{"a shapefile", kVector}, ".shp", {0, "\0\0\x27\x0a"sv}},
    {{"a GeoPackage",
      "convert it, e.g. 'gdal_translate FILE out.tif' (a raster) or 'ogr2ogr -f CSV -lco "
      "GEOMETRY=AS_XYZ out.csv FILE' (points)"},
     ".gpkg",
     {0, "SQLite format 3"},
     {68, "GPKG"}},
    {{"an SQLite database (MBTiles?)", kRaster}, ".mbtiles .sqlite", {0, "SQLite format 3"}},
    {{"an HTML page", "a server may have sent it instead of the file: download that again"},
     ".html .htm",
     {0, "<!doctype html", true}},
    {{"an HTML page", "a server may have sent it instead of the file: download that again"},
     "",
     {0, "<html", true}},
    {{"XML (GML, KML, LandXML?)", kVector}, ".kml .gml .xml", {}},
    // Meshes.
    {{"glTF as text", "export it in the binary form, GLB"}, ".gltf", {}},
    {{"JSON, but not GeoJSON", kVector}, ".json", {}},
    {{"VTK", "convert it to PLY, e.g. with ParaView"}, ".vtk .vtp .vtu", {0, "# vtk DataFile"}},
    // Containers of any of them.
    {{"compressed by bzip2", "unpack it: 'bzip2 -dk FILE'"}, ".bz2", {0, "BZh"}},
    {{"compressed by xz", "unpack it: 'xz -dk FILE'"},
     ".xz",
     {0,
      "\xfd"
      "7zXZ\0"sv}},
    {{"compressed by zstd", "unpack it: 'zstd -d FILE'"}, ".zst", {0, "\x28\xb5\x2f\xfd"sv}},
    {{"a zip archive", "unpack it: 'unzip FILE'"}, ".zip .kmz", {0, "PK\x03\x04"sv}},
    {{"a 7z archive", "unpack it: '7z x FILE'"}, ".7z", {0, "7z\xbc\xaf\x27\x1c"sv}},
    {{"a RAR archive", "unpack it: 'unrar x FILE'"}, ".rar", {0, "Rar!\x1a\x07"sv}},
    {{"a tar archive", "unpack it: 'tar xf FILE'"}, ".tar .tgz", {257, "ustar"}},
    {{"a Git LFS pointer, not the file", "fetch the file: 'git lfs pull'"},
     "",
     {0, "version https://git-lfs"}},
};

bool shows(const Mark& mark, std::string_view head) {
  if (mark.bytes.empty() || head.size() < mark.at + mark.bytes.size()) return false;
  const std::string_view bytes = head.substr(mark.at, mark.bytes.size());
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  return std::equal(bytes.begin(), bytes.end(), mark.bytes.begin(),
                    [&](char a, char b) { return a == b || (mark.any_case && lower(a) == b); });
}

bool has_word(std::string_view words, std::string_view word) {
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    if (words.substr(at, end - at) == word) return true;
    at = end + 1;
  }
  return false;
}

/// Returns the format recognised by the first bytes of a file (4,096 or all); nullptr if none.
const ForeignFormat* foreign_format_of_content(std::string_view head) {
  // Text may begin with the byte order mark of UTF-8 and may be indented.
  std::string_view text = head;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  text.remove_prefix(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  for (const ForeignRow& row : kForeignFormats) {
    if (!shows(row.first, row.first.at == 0 ? text : head)) continue;
    if (!row.second.bytes.empty() && !shows(row.second, head)) continue;
    return &row.format;
  }
  return nullptr;
}

/// Returns the format of an ending in lower case such as ".laz"; nullptr if none.
const ForeignFormat* foreign_format_of_ending(std::string_view ending) {
  if (ending.empty()) return nullptr;
  for (const ForeignRow& row : kForeignFormats) {
    if (has_word(row.endings, ending)) return &row.format;
  }
  return nullptr;
}

std::string ending_of(const std::filesystem::path& file) {
  return lower_case(file.extension().string());
}

/// Returns the format with that file ending; nullptr if there is none.
const Format* format_of_ending(const std::string& ending) {
  for (const Format& format : formats()) {
    const auto& endings = format.endings;
    if (std::find(endings.begin(), endings.end(), ending) != endings.end()) return &format;
  }
  return nullptr;
}

bool is_ept_name(const std::string& file) {
  return std::filesystem::path(file).filename() == kEptName;
}

Error unsupported(const std::string& file, const ForeignFormat& format) {
  return Error(shown_name(file), fmt::format("is {}, which cannot be read", format.name))
      .remedy(std::string(format.remedy));
}

}  // namespace

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

std::string names_of_formats(bool Format::*capability) {
  std::string out;
  for (const Format& format : formats()) {
    if (capability != nullptr && !(format.*capability)) continue;
    if (!out.empty()) out += ", ";
    out += format.name;
  }
  return out;
}

const Format* packed_format_of(const std::string& file) {
  const std::string ending = ending_of(file);
  if (ending != ".zip" && ending != ".gz") return nullptr;
  return format_of_ending(ending_of(std::filesystem::path(file).stem()) + ending);
}

const Format& format_of(const std::string& file, const SourceOptions& options) {
  if (!options.format.empty()) {
    for (const Format& format : formats()) {
      if (format.name == options.format) return format;
    }
    throw std::invalid_argument(
        fmt::format("unknown input format '{}'; known are {}", options.format, names_of_formats()));
  }
  constexpr std::size_t kHeadBytes = 4096;
  const std::vector<char> head = peek_head(file, kHeadBytes, options.stop);
  const auto bytes = std::as_bytes(std::span(head));
  const std::span<const Format> distinctive = formats().first(formats().size() - 1);
  for (const Format& format : distinctive) {
    if (format.recognise(bytes)) return format;
  }
  if (is_ept_name(file)) return ept_format();
  if (const Format* const packed = packed_format_of(file)) return *packed;
  // Before text, the last format, because some of these look like text.
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

}  // namespace terrace::stream
