// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

#include "base/file_marks.hpp"
#include "cli/cli.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/point_writer.hpp"
#include "terrace/terrain/triangle_mesh.hpp"

namespace terrace::tools {

/// First lines of the command's tables, which identify them. Tables cannot contain comments.
inline constexpr std::string_view kPairsHead = "a,b,distance";
inline constexpr std::string_view kTreeHead = "a,b,distance,size,level";
inline constexpr std::string_view kBoxTreeHead =
    "a,b,distance,size,level,minx,miny,minz,maxx,maxy,maxz";

/// Returns true if the regular file at `path` is empty or terrace wrote it. Most formats have a
/// place for a mark: a header comment (PLY, OBJ, VTK), the generator (GLB, GeoJSON, LAS), the
/// Software tag (TIFF, PNG) or the first bytes (overlays). Text has no such place (CSV and XYZ
/// points, tables, labels), and any program may write the same text. Such a file
/// counts as ours while it is unchanged since we wrote it (stream::is_unchanged_output).
bool written_by_terrace(const std::string& path);

/// Adds a line to the summary if coordinates were rounded to fit the file's format.
void report_rounding(const stream::PointWriter& writer, Summary& summary);

/// Reports how a mesh file stores its coordinates: prints a note, and adds "frame" to the summary.
void report_coordinates(const terrain::MeshCoordinates& coordinates, const CommonOptions& common,
                        Summary& summary);

/// Checks, before the work begins, that the output `path` may be written. Returns the
/// `replace` of the writer's options. With `force` a file that terrace wrote may be replaced, which
/// the writer checks again at the moment of replacement. Throws stream::Error if the path, or the
/// target of a link, exists and `force` is false or terrace did not write it.
stream::Naming may_replace(const std::string& path, bool force);

/// Checks one of several outputs of a run, which `group` publishes together.
stream::Naming may_replace(const std::string& path, bool force, stream::OutputGroup& group);

/// Returns the options for a point file at `path`, after may_replace(). `format` is the one that
/// the user named, or empty.
stream::WriterOptions point_writer_options(const std::string& path, const std::string& format,
                                           const CommonOptions& common);

}  // namespace terrace::tools
