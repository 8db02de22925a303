// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

/// The kinds of files that terrace writes, and the file name endings for each format. A name with
/// the ending of another format is refused, because the program that opens the file relies on it.

namespace terrace::terrain {

struct OutputFormat {
  std::string_view name;     ///< as users name it
  std::string_view endings;  ///< ".a .b", in lower case
};

struct OutputKind {
  std::string_view what;  ///< for messages, as in "a raster"
  std::span<const OutputFormat> formats;
  /// listed: the ending must be one of `formats`. It may be missing only if there is one format.
  /// free: any ending or none is allowed, unless it belongs to another format.
  enum class Names : std::uint8_t { listed, free } names = Names::listed;
  bool streams = true;  ///< may go to standard output
};

namespace output_formats {
inline constexpr OutputFormat kPoints[] = {
    {"xyz", ".xyz .txt"},       {"csv", ".csv .txt"},   {"ply", ".ply"},
    {"ply-ascii", ".ply"},      {"las", ".las"},        {"laz", ".laz"},
    {"copc", ".copc.laz .laz"}, {"geojson", ".geojson"}};
inline constexpr OutputFormat kMesh[] = {
    {"ply", ".ply"}, {"ply-ascii", ".ply"}, {"obj", ".obj"}, {"glb", ".glb"}};
inline constexpr OutputFormat kTetrahedra[] = {{"vtk", ".vtk"}};
inline constexpr OutputFormat kRaster[] = {{"tif", ".tif .tiff"}};
inline constexpr OutputFormat kPicture[] = {{"png", ".png"}};
inline constexpr OutputFormat kLines[] = {{"geojson", ".geojson .json"}};
inline constexpr OutputFormat kTable[] = {{"csv", ".csv .txt"}};
inline constexpr OutputFormat kPlaces[] = {{"csv", ".csv .txt .tsv .tab"}};
inline constexpr OutputFormat kLabels[] = {{"txt", ".txt .csv .labels"}};
inline constexpr OutputFormat kOverlay[] = {{"overlay", ".overlay"}};
inline constexpr OutputFormat kFolder[] = {{"folder", ""}};
}  // namespace output_formats

/// One row for each output of a verb or a function of the Python module.
namespace outputs {
using enum OutputKind::Names;
inline constexpr OutputKind kPointFile{"a file of points",
                                       std::span(output_formats::kPoints).first(7)};
/// The outputs of stores that may hold lines.
inline constexpr OutputKind kPointOrLineFile{"a file of points", output_formats::kPoints};
inline constexpr OutputKind kMeshFile{"a mesh", output_formats::kMesh};
inline constexpr OutputKind kTetrahedraFile{"a file of tetrahedra", output_formats::kTetrahedra,
                                            listed, false};
inline constexpr OutputKind kRasterFile{"a raster", output_formats::kRaster, listed, false};
inline constexpr OutputKind kPictureFile{"a picture", output_formats::kPicture};
inline constexpr OutputKind kContourFile{"a file of contour lines", output_formats::kLines};
inline constexpr OutputKind kProfileTable{"a profile", output_formats::kTable};
inline constexpr OutputKind kSampleTable{"a table of heights", output_formats::kPlaces};
inline constexpr OutputKind kPairsTable{"a table of pairs", output_formats::kTable};
inline constexpr OutputKind kDendrogramTable{"a dendrogram", output_formats::kTable};
/// Also an input of `sample`.
inline constexpr OutputKind kPlaceTable{"a table of places", output_formats::kPlaces, free};
inline constexpr OutputKind kLabelFile{"a list of labels", output_formats::kLabels, free};
inline constexpr OutputKind kOverlayFile{"an overlay", output_formats::kOverlay, free, false};
inline constexpr OutputKind kStore{"a store, which is a folder,", output_formats::kFolder, free,
                                   false};
inline constexpr OutputKind kTileSet{"a tile set, which is a folder,", output_formats::kFolder,
                                     free, false};
inline constexpr OutputKind kSite{"a site, which is a folder,", output_formats::kFolder, free,
                                  false};
}  // namespace outputs

/// Returns a list such as ".ply, .obj or .glb".
std::string endings_of(const OutputKind& kind);

/// Returns the format of the output `path`. This is `format` if given, otherwise the format of the
/// ending, otherwise the only format. "-" gets the first format unless `format` is given. Throws:
/// UsageError if there is no such format, or if the name has the ending of another one; both
/// messages list the choices.
[[nodiscard]] std::string_view format_of_output(const OutputKind& kind, const std::string& path,
                                                const std::string& format = {});

/// Checks the name and the format of an output. Throws: as format_of_output().
inline void check_output_name(const OutputKind& kind, const std::string& path,
                              const std::string& format = {}) {
  static_cast<void>(format_of_output(kind, path, format));
}

/// Checks the name of an input of this kind. Throws: UsageError if it has the ending of another
/// format.
void check_input_name(const OutputKind& kind, const std::string& path);

}  // namespace terrace::terrain
