// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/source.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "format/input_files.hpp"
#include "format/registry.hpp"
#include "format/selection.hpp"
#include "io/peek.hpp"
#include "io/spool.hpp"
#include "io/text.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/input.hpp"

namespace terrace::stream {
namespace {

/// Names of the entities, in the order of Entities.
constexpr std::array<std::string_view, 4> kEntityNames{"points", "triangles", "segments",
                                                       "polylines"};

constexpr std::size_t kCopyBytes = std::size_t{256} << 10;

/// A source that reads temporary copies of files, and names the original files.
class SpooledSource final : public PointSource {
 public:
  SpooledSource(const Format& format, std::span<const std::string> files,
                const SourceOptions& options)
      : names_(files.begin(), files.end()), copies_(files.begin(), files.end()) {
    for (std::size_t i = 0; i < names_.size(); ++i) {
      if (!is_seekable(names_[i])) copies_[i] = copy_to_temporary(names_[i], options.stop);
    }
    with_names([&] { source_ = format.open(copies_, options); });
    info_ = source_->info();
    for (std::string& file : info_.files) file = name_of_copy(file);
    for (const auto& spool : spools_) info_.spooled_bytes += spool->size();
  }

  const SourceInfo& info() const override { return info_; }
  bool next(PointBlock& block) override {
    bool more = false;
    with_names([&] { more = source_->next(block); });
    return more;
  }
  Progress progress() const override { return source_->progress(); }
  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    with_names([&] { source_->refine(cell_aspect, memory_bytes); });
  }
  std::uint64_t reading_bytes() const override { return source_->reading_bytes(); }

 private:
  /// Copies a file to a temporary one; returns the name by which that can be opened.
  std::string copy_to_temporary(const std::string& file, const std::stop_token& stop) {
    Input input(file, stop);
    auto spool = std::make_unique<Spool>(input.name());
    while (!input.fill(kCopyBytes).empty()) {
      spool->append(std::as_bytes(std::span(input.window())));
      input.consume(input.window().size());
    }
    spools_.push_back(std::move(spool));
    return spools_.back()->path();
  }

  std::string name_of_copy(const std::string& file) const {
    const auto at = std::find(copies_.begin(), copies_.end(), file);
    if (at == copies_.end()) return file;
    const std::string& name = names_[static_cast<std::size_t>(at - copies_.begin())];
    return name == kStandardStream ? "standard input" : name;
  }

  template <class Do>
  void with_names(const Do& work) const {
    try {
      work();
    } catch (const Error& error) {
      Error::Parts parts = error.parts();
      parts.file = name_of_copy(parts.file);
      throw Error(std::move(parts));
    }
  }

  std::vector<std::string> names_, copies_;
  std::vector<std::unique_ptr<Spool>> spools_;
  std::unique_ptr<PointSource> source_;  // destroyed before the copies that it reads
  SourceInfo info_;
};

/// Opens the files with `format.open`, after copying those without random access (pipes, gzip) to
/// unnamed temporary files. Messages name the original files. Throws: Error, Stopped.
std::unique_ptr<PointSource> open_spooled(const Format& format, std::span<const std::string> files,
                                          const SourceOptions& options) {
  return std::make_unique<SpooledSource>(format, files, options);
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
  std::string_view option;   ///< a pattern of Message, with the name in SourceOptions
  std::string_view lack;     ///< follows the name of a format without the capability
  std::string_view example;  ///< of what has the capability
};

constexpr std::array<Requirement, 6> kRequirements{{
    {&Format::height_colours,
     [](const SourceOptions& o) { return o.heights_of_colour != HeightsOfColour::none; },
     "{heights_of_colour}", "does not encode heights as colours", "an image"},
    {&Format::octree, [](const SourceOptions& o) { return o.selection.resolution > 0; },
     "{resolution}", "has no octree", "a COPC file or EPT"},
    {&Format::triangles, [](const SourceOptions& o) { return o.entities == Entities::triangles; },
     "{entities}", "has no triangles", "a mesh"},
    {&Format::lines,
     [](const SourceOptions& o) {
       return o.entities == Entities::segments || o.entities == Entities::polylines;
     },
     "{entities}", "has no lines", "a file of lines"},
    {&Format::raster, [](const SourceOptions& o) { return o.cell > 0; }, "{cell}",
     "is not a raster format", "a raster"},
    {&Format::raster, [](const SourceOptions& o) { return o.band != 1; }, "{band}", "has no bands",
     "a raster"},
}};

/// Throws: Error if an option needs a capability that the format lacks.
void check_capabilities(const Format& format, const std::string& file,
                        const SourceOptions& options) {
  for (const Requirement& requirement : kRequirements) {
    if (format.*requirement.capability || !requirement.is_set(options)) continue;
    throw Error(shown_name(file), fmt::format("{} {}", format.name, requirement.lack))
        .remedy(message("name {} ({}), or leave {} out", requirement.example,
                        names_of_formats(requirement.capability),
                        Message::format(requirement.option, {})));
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
        .remedy(message("name files of one format, or select files of a folder by {format}"));
  }
  return format;
}

/// Whether files from pipes or gzip must be copied before the format can read them. Throws: Error
/// if copies would not help.
bool needs_copies(const Format& format, std::span<const std::string> files) {
  bool copies = false;
  for (const std::string& file : files) {
    if (format.streams || is_seekable(file) || packed_format_of(file) == &format) continue;
    if (!format.self_contained) {
      throw Error(shown_name(file), format.name + " cannot be read from a pipe or from gzip")
          .remedy("name an unpacked file");
    }
    copies = true;
  }
  if (std::count(files.begin(), files.end(), kStandardStream) > 1) {
    throw Error("standard input", "is named twice")
        .remedy("name it once: it can be read only once");
  }
  return copies;
}

/// open_source() without reading ahead.
std::unique_ptr<PointSource> open_on_this_thread(std::span<const std::string> files,
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

bool is_shape_column(std::string_view name, Entities entities) {
  if (entities == Entities::points) return false;
  const bool lines = entities != Entities::triangles;
  if (lines && (name == "line" || name == "part" || name == "vertices" || name == "dimensions")) {
    return true;
  }
  const std::size_t corners = entities == Entities::triangles  ? 3
                              : entities == Entities::segments ? 2
                                                               : kPolylineVertices;
  return name.size() == 2 && name[0] >= 'x' && name[0] <= 'z' && name[1] >= '2' &&
         static_cast<std::size_t>(name[1] - '0') <= corners;
}

std::optional<Entities> entities_named(std::string_view name) {
  const auto entry = std::find(kEntityNames.begin(), kEntityNames.end(), name);
  if (entry == kEntityNames.end()) return std::nullopt;
  return static_cast<Entities>(entry - kEntityNames.begin());
}

std::unique_ptr<PointSource> open_source(std::span<const std::string> names,
                                         const SourceOptions& options) {
  if (names.empty()) throw std::invalid_argument("there is no file to open");
  if (options.block_points == 0) throw std::invalid_argument("block_points must be positive");
  const std::vector<std::string> files = input_files(names, options.format);
  if (options.blocks_ahead == 0) return open_on_this_thread(files, options);
  // Reading ends when the source is destroyed, not only when the caller requests a stop.
  std::stop_source reading;
  SourceOptions inner = options;
  inner.stop = reading.get_token();
  const std::stop_callback on_stop(options.stop, [&reading] { reading.request_stop(); });
  return read_ahead(open_on_this_thread(files, inner), options.blocks_ahead, reading, options.stop);
}

}  // namespace terrace::stream
