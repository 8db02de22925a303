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

/// How tables of the command begin: formats without room for a comment.
inline constexpr std::string_view kPairsHead = "a,b,distance";
inline constexpr std::string_view kTreeHead = "a,b,distance,size,level";
inline constexpr std::string_view kBoxTreeHead =
    "a,b,distance,size,level,minx,miny,minz,maxx,maxy,maxz";
inline constexpr std::string_view kDendrogramHead = "a,b,height,size";

/// True if the regular file at `path` is empty or terrace wrote it. Its format says so at the place
/// that the format has for that: a comment of the header (PLY, OBJ, VTK), the generator (GLB,
/// GeoJSON, LAS), the tag Software (TIFF, PNG), the first bytes (overlays). Text has no such place
/// (points as CSV and XYZ, tables, labels), and any program may write the very same: it counts as
/// ours as long as nothing has changed it (stream::is_unchanged_output).
bool written_by_terrace(const std::string& path);

/// Reports in the summary if coordinates were rounded to fit the file's format.
void tell_rounding(const stream::PointWriter& writer, Summary& summary);

/// Reports what a mesh file has for the coordinates: a note, and in the summary "frame".
void tell_coordinates(const terrain::MeshCoordinates& coordinates, const CommonOptions& common,
                      Summary& summary);

/// Checks, before the work begins, that the output `path` may be written. Returns the writers'
/// `replace`: with `force`, a file of ours, which is looked at again when it is replaced.
/// Throws: stream::Error if something is there, or where a link leads, and `force` is false or it
/// is not a file of ours.
stream::Naming may_replace(const std::string& path, bool force);

/// The same for one of several outputs of a run: `group` gives all of them their names.
stream::Naming may_replace(const std::string& path, bool force, stream::OutputGroup& group);

/// Options for a file of points at `path`, after may_replace(). format: the user's, or empty.
stream::WriterOptions point_writer_options(const std::string& path, const std::string& format,
                                           const CommonOptions& common);

}  // namespace terrace::tools
