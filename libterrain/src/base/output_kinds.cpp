// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/output_kinds.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <vector>

#include <fmt/core.h>

#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

/// Endings outside the table: formats that terrace only reads or does not know.
constexpr std::string_view kOthers =
    ".7z .adf .asc .bil .bmp .bz2 .db .dbf .dem .doc .docx .dt0 .dt1 .dt2 .dxf .e57 .fgb .flt .gif "
    ".gltf .gml .gpkg .gpx .grb .grd .grib .gz .h5 .hdf .hdr .hgt .htm .html .img .jp2 .jpeg .jpg "
    ".js .kml .kmz .mbtiles .mp4 .nc .npy .npz .ods .off .parquet .pcd .pdf .pgm .pmtiles .ppm "
    ".prj .py .rar .shp .sqlite .stl .svg .tar .tgz .topojson .vrt .webp .wkt .xls .xlsx .xml .xz "
    ".zip .zst";

constexpr std::array<std::span<const OutputFormat>, 8> kAll{
    output_formats::kPoints, output_formats::kMesh,    output_formats::kTetrahedra,
    output_formats::kRaster, output_formats::kPicture, output_formats::kLines,
    output_formats::kPlaces, output_formats::kOverlay};

/// Calls take(word) for each word of a blank-separated list until it returns true. Returns whether
/// it did.
template <class Take>
bool any_word(std::string_view words, const Take& take) {
  while (!words.empty()) {
    const std::size_t end = std::min(words.find(' '), words.size());
    if (take(words.substr(0, end))) return true;
    words.remove_prefix(std::min(end + 1, words.size()));
  }
  return false;
}

/// Whether a file's name, in lower case, has one of the endings after at least one character.
bool has_ending(const std::string& name, std::string_view endings) {
  return any_word(endings, [&](std::string_view ending) {
    return name.size() > ending.size() && name.ends_with(ending);
  });
}

/// Whether the name has the ending of any known format.
bool is_known(const std::string& name) {
  return has_ending(name, kOthers) ||
         std::ranges::any_of(kAll, [&](std::span<const OutputFormat> formats) {
           return std::ranges::any_of(formats, [&](const OutputFormat& format) {
             return has_ending(name, format.endings);
           });
         });
}

std::string listed(const std::vector<std::string_view>& words, const char* last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? std::string(" ") + last + " " : ", ";
    text += words[i];
  }
  return text;
}

struct NameOfFile {
  std::string name, ending;  ///< in lower case

  explicit NameOfFile(const std::string& path)
      : name(std::filesystem::path(path).filename().string()) {
    for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c;
    ending = std::filesystem::path(name).extension().string();
  }
};

UsageError refused(const OutputKind& kind, const std::string& path, const stream::Message& cause) {
  const std::string endings = endings_of(kind);
  return UsageError(
      stream::message("{}: {}; {}", path, cause,
                      endings.empty() ? "name a folder" : "name a file that ends in " + endings));
}

}  // namespace

std::string endings_of(const OutputKind& kind) {
  std::vector<std::string_view> endings;
  for (const OutputFormat& format : kind.formats) {
    any_word(format.endings, [&](std::string_view ending) {
      if (std::ranges::find(endings, ending) == endings.end()) endings.push_back(ending);
      return false;
    });
  }
  return listed(endings, "or");
}

std::string_view format_of_output(const OutputKind& kind, const std::string& path,
                                  const std::string& format) {
  const auto& [name, ending] = NameOfFile(path);
  const std::string cannot = fmt::format("{} cannot be written as {}", kind.what, ending);
  const bool streams = path == "-";
  if (streams && !kind.streams) {
    throw UsageError(std::string(kind.what) + " cannot go to standard output; name a " +
                     (endings_of(kind).empty() ? "folder" : "file"));
  }
  if (!format.empty()) {
    std::vector<std::string_view> names;
    for (const OutputFormat& row : kind.formats) {
      names.push_back(row.name);
      if (row.name != format) continue;
      if (!streams && !has_ending(name, row.endings) && is_known(name)) {
        throw refused(kind, path,
                      stream::message("{output_format} {} does not write files that end in {}",
                                      format, ending));
      }
      return row.name;
    }
    throw UsageError(stream::message("{output_format} '{}': {} can be {}", format, kind.what,
                                     listed(names, "or")));
  }
  if (streams) return kind.formats.front().name;
  for (const OutputFormat& row : kind.formats) {
    if (has_ending(name, row.endings)) return row.name;
  }
  if (kind.names == OutputKind::Names::free) {
    if (is_known(name)) throw refused(kind, path, cannot);
  } else if (!ending.empty()) {
    throw refused(kind, path, cannot);
  } else if (kind.formats.size() > 1) {
    throw refused(kind, path, "has no ending, so its format is not known");
  }
  return kind.formats.front().name;
}

void check_input_name(const OutputKind& kind, const std::string& path) {
  const NameOfFile file(path);
  for (const OutputFormat& row : kind.formats) {
    if (has_ending(file.name, row.endings)) return;
  }
  if (is_known(file.name)) {
    throw refused(kind, path, fmt::format("{} cannot be read from {}", kind.what, file.ending));
  }
}

}  // namespace terrace::terrain
