// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/output.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/core.h>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::tools {

using namespace terrain;

bool written_by_terrace(const std::string& path) {
  const std::optional<bool> marked = marked_by_terrace(path);
  return marked ? *marked : stream::is_unchanged_output(path);
}

void report_rounding(const stream::PointWriter& writer, Summary& summary) {
  if (writer.rounding() == 0.0) return;
  summary.json["rounding"] = writer.rounding();
  summary.text += "coordinates were rounded by up to " + readable_number(writer.rounding()) +
                  " to fit the format\n";
}

void report_coordinates(const terrain::MeshCoordinates& coordinates, const CommonOptions& common,
                        Summary& summary) {
  if (!coordinates.note.empty()) common.say(coordinates.note);
  if (!coordinates.frame) return;
  const stream::MeshFrame& frame = *coordinates.frame;
  summary.json["frame"] = {
      {"crs", frame.crs}, {"origin", coordinates.origin}, {"metres_per_unit", frame.metres}};
}

stream::Naming may_replace(const std::string& path, bool force) {
  namespace fs = std::filesystem;
  stream::Naming naming;
  if (force) {
    naming = {[](const fs::path& there) { return written_by_terrace(there.string()); }};
  }
  if (path == "-") return naming;
  std::error_code error;
  const fs::file_status status = fs::status(path, error);  // follows links
  if (status.type() == fs::file_type::not_found) return naming;
  if (error) throw stream::system_error(path, "cannot be examined", error.value());
  if (!fs::is_regular_file(status)) {
    throw stream::Error(path, "is not a regular file")
        .remedy("name another output; - is standard output");
  }
  if (!force) {
    throw stream::Error(path, "exists already")
        .remedy("name another output, or give --force to replace it");
  }
  if (!written_by_terrace(path)) {
    const bool has_mark = marked_by_terrace(path).has_value();
    throw stream::Error(
        path, fmt::format("was not written by terrace, {}, so --force does not replace it",
                          has_mark ? "according to its format"
                                   : "or was changed or copied since (text files carry no mark)"))
        .remedy("remove it yourself or name another output");
  }
  return naming;
}

stream::Naming may_replace(const std::string& path, bool force, stream::OutputGroup& group) {
  stream::Naming naming = may_replace(path, force);
  naming.group = &group;
  return naming;
}

stream::WriterOptions point_writer_options(const std::string& path, const std::string& format,
                                           const CommonOptions& common) {
  const std::uint64_t memory = common.memory_or(0);
  return {.format = format,
          .replace = may_replace(path, common.force),
          .stop = stop_token(),
          .memory_bytes = memory - std::min(memory, kProgramMemory),
          .threads = common.threads};
}

}  // namespace terrace::tools
