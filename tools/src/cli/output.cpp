// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/output.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <utility>

#include "base/units.hpp"
#include "cli/interrupt.hpp"
#include "earth/crs/crs_definition.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/terrain/crs.hpp"

namespace terrace::tools {
namespace {

/// No table of ours has longer lines.
constexpr std::size_t kLongestMarkLine = 64u << 10;

/// As std::to_chars() writes it.
bool is_number_of_ours(std::string_view cell) {
  const std::string_view digits = cell.substr(cell.starts_with('-') ? 1 : 0);
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (!digits.empty() && std::all_of(digits.begin(), digits.end(), is_digit)) {
    return digits.size() == 1 || digits.front() != '0';
  }
  if (digits == "nan" || digits == "inf") return true;
  const auto value = number_from<double>(cell);
  return value && number_text(*value) == cell;
}

/// True for a header of `sample`: its columns are the last, with a number behind each name that the
/// places had already.
bool ends_with_answers(std::string_view line) {
  const std::size_t last = line.find_last_of(",;\t");
  if (last == line.npos) return false;
  const char separator = line[last];
  for (const std::string_view name : {"aspect", "slope", "gradient", "height"}) {
    const std::size_t begin = line.rfind(separator);
    if (begin == line.npos) return false;
    std::string_view cell = line.substr(begin + 1);
    line = line.substr(0, begin);
    if (!cell.starts_with(name)) return false;
    cell.remove_prefix(name.size());
    const bool numbered = cell.size() > 1 && cell.front() == '_' &&
                          cell.find_first_not_of("0123456789", 1) == cell.npos;
    if (!cell.empty() && !numbered) return false;
  }
  return true;
}

/// Recognises a table of ours by its first line, or else line by line.
class Table {
 public:
  /// False as soon as it cannot be ours.
  bool take(std::string_view line) {
    if (ours_) return true;
    const auto is_text = [](char c) { return c == '\t' || static_cast<unsigned char>(c) >= ' '; };
    if (!std::ranges::all_of(line, is_text)) return false;
    if (columns_ > 0) return is_row(line);
    // What `sample` writes begins with the comments that the places had.
    if (line.empty() || line.front() == '#') {
      comments_ = true;
      return true;
    }
    for (const std::string_view head :
         {kPairsHead, kTreeHead, kBoxTreeHead, kDendrogramHead, kProfileHead}) {
      if (line == head && !comments_) return ours_ = true;
    }
    if (ends_with_answers(line)) return ours_ = true;
    if (comments_) return false;
    const bool points = line == "x,y,z" || line.starts_with("x,y,z,");
    separator_ = points ? ',' : ' ';
    columns_ = 1 + static_cast<std::size_t>(std::count(line.begin(), line.end(), separator_));
    return points || is_row(line);
  }
  /// Decided: no more lines are needed.
  [[nodiscard]] bool ours() const { return ours_; }
  [[nodiscard]] bool has_rows() const { return columns_ > 0; }

 private:
  [[nodiscard]] bool is_row(std::string_view line) const {
    std::size_t cells = 0;
    for (;;) {
      const std::size_t end = std::min(line.find(separator_), line.size());
      if (++cells > columns_ || !is_number_of_ours(line.substr(0, end))) return false;
      if (end == line.size()) return cells == columns_;
      line.remove_prefix(end + 1);
    }
  }

  bool ours_ = false, comments_ = false;
  char separator_ = ' ';
  std::size_t columns_ = 0;  ///< 0: no row yet
};

bool is_our_table(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  Table table;
  std::string line(kLongestMarkLine, '\0');
  while (file.getline(line.data(), static_cast<std::streamsize>(line.size()))) {
    // Our last line has an end: a truncated one is not ours.
    if (file.eof()) return false;
    const auto size = static_cast<std::size_t>(file.gcount()) - 1;
    if (!table.take(std::string_view(line).substr(0, size))) return false;
    if (table.ours()) return true;
  }
  return file.eof() && table.has_rows();
}

}  // namespace

bool written_by_terrace(const std::string& path) {
  const std::optional<bool> marked = marked_by_terrace(path);
  return marked ? *marked : is_our_table(path);
}

std::function<stream::Crs()> crs_to_write(stream::Crs recorded) {
  return [recorded = std::move(recorded)] {
    try {
      const auto system = CoordinateSystem::of(recorded, {});
      return system ? system->crs_with_wkt1() : recorded;
    } catch (const terrain::CrsDatabaseError&) {
      throw;
    } catch (const stream::Error&) {
      return recorded;
    }
  };
}

void tell_rounding(const stream::PointWriter& writer, Summary& summary) {
  if (writer.rounding() == 0.0) return;
  summary.json["rounding"] = writer.rounding();
  summary.text += "coordinates were rounded by up to " + readable_number(writer.rounding()) +
                  " to fit the format\n";
}

void tell_coordinates(const terrain::MeshCoordinates& coordinates, const CommonOptions& common,
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
  const fs::file_status status = fs::status(path, error);  // of what a link leads to
  if (status.type() == fs::file_type::not_found) return naming;
  const auto refuse = [&](const std::string& cause, const std::string& remedy) {
    throw stream::Error({.file = path, .where = {}, .cause = cause, .remedy = remedy});
  };
  if (error) throw stream::system_error(path, "cannot be looked at", error.value());
  if (!fs::is_regular_file(status)) {
    refuse("is not a regular file", "name another output; - is standard output");
  }
  if (!force) refuse("exists already", "name another output, or give --force to replace it");
  if (!written_by_terrace(path)) {
    refuse("was not written by terrace, as far as its format tells, so --force does not replace it",
           "remove it yourself or name another output");
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
