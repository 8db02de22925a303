// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cassert>
#include <filesystem>
#include <string>
#include <vector>

#include "format/foreign_format.hpp"
#include "format/formats.hpp"
#include "io/peek.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"
#include "terrace/stream/source.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kHeadBytes = 4096;

std::string known_formats() {
  std::string out;
  for (const Format& format : formats()) {
    if (!out.empty()) out += ", ";
    out += format.name;
  }
  return out;
}

std::string ending_of(const std::string& file) {
  std::string ending = std::filesystem::path(file).extension().string();
  for (char& c : ending) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return ending;
}

[[noreturn]] void refuse(const std::string& file, const ForeignFormat& format) {
  throw Error({.file = file == kStandardStream ? "standard input" : file,
               .where = {},
               .cause = "is " + std::string(format.name) + ", which cannot be read",
               .remedy = std::string(format.remedy)});
}

/// By name, else by content, else by ending. A file whose ending is known but whose content is not
/// goes to the ending's reader, which can say best what is wrong with it. Formats that are known
/// and not read are refused by content first too, as some of them look like text.
const Format& format_of(const std::string& file, const SourceOptions& options) {
  if (!options.format.empty()) {
    for (const Format& format : formats()) {
      if (format.name == options.format) return format;
    }
    throw Error({.file = {},
                 .where = {},
                 .cause = "unknown input format '" + options.format + "'",
                 .remedy = "known are " + known_formats()});
  }
  const std::vector<char> head = peek_head(file, kHeadBytes, options.stop);
  if (const auto* foreign = foreign_format_of_content({head.data(), head.size()})) {
    refuse(file, *foreign);
  }
  for (const Format& format : formats()) {
    if (format.recognise(std::as_bytes(std::span(head)))) return format;
  }
  const std::string ending = ending_of(file);
  for (const Format& format : formats()) {
    const auto& known = format.endings;
    if (std::find(known.begin(), known.end(), ending) != known.end()) return format;
  }
  const ForeignFormat* const foreign = foreign_format_of_ending(ending);
  if (foreign != nullptr && !head.empty()) refuse(file, *foreign);
  throw Error(
      {.file = file,
       .where = {},
       .cause = head.empty() ? "the file is empty" : "neither content nor name tell its format",
       .remedy = "name the format: " + known_formats()});
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
  assert(!files.empty() && options.block_points > 0);
  const HeadScope scope;
  const Format& format = format_of(files.front(), options);
  for (const std::string& file : files) {
    const Format& other = format_of(file, options);
    if (&other != &format) {
      throw Error({.file = file,
                   .where = {},
                   .cause = "is " + other.name + ", but " + files.front() + " is " + format.name,
                   .remedy = "name files of one format"});
    }
    if (!format.streams && !is_rereadable(file)) {
      throw Error({.file = file == kStandardStream ? "standard input" : file,
                   .where = {},
                   .cause = format.name + " cannot be read from a pipe",
                   .remedy = "name a file"});
    }
  }
  if (std::count(files.begin(), files.end(), kStandardStream) > 1) {
    throw Error({.file = "standard input",
                 .where = {},
                 .cause = "is named twice",
                 .remedy = "it can be read only once"});
  }
  return format.open(files, options);
}

}  // namespace

std::span<const Format> formats() {
  // The most telling content first: text is whatever looks like a table of numbers.
  static const std::array<Format, 3> all{geotiff_format(), ply_format(), xyz_format()};
  return all;
}

std::unique_ptr<PointSource> open_source(std::span<const std::string> files,
                                         const SourceOptions& options) {
  if (options.blocks_ahead == 0) return open_here(files, options);
  // The reading ends with the source too, not by the caller's stop alone.
  std::stop_source reading;
  SourceOptions inner = options;
  inner.stop = reading.get_token();
  const std::stop_callback on_stop(options.stop, [&reading] { reading.request_stop(); });
  return read_ahead(open_here(files, inner), options.blocks_ahead, reading, options.stop);
}

}  // namespace terrace::stream
