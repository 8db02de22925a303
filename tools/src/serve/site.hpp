// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/byte_source.hpp>
#include <terrace/stream/store.hpp>

/// The site that a web server offers the viewer: its own files and those of the stores, each at a
/// path.

namespace terrace::tools {

/// A file of a site.
struct Resource {
  std::shared_ptr<const stream::ByteSource> bytes;
  std::string type;          ///< media type
  std::string tag;           ///< the entity tag, quoted
  bool open_to_all = false;  ///< needs no token: the viewer's own files
};

/// Resources by path, without the leading slash. Only these are served; no path of a request ever
/// becomes a file system path.
using Site = std::map<std::string, Resource>;

/// Returns a site with the viewer and `stores.json`. Each store has its files in `stores/NAME/`,
/// and `stores/NAME.start` with the parts needed for the first picture. NAME is the name of the
/// store's folder, changed where it is not unique. Opens the files, which stay open. Throws
/// stream::Error, also if a file of a store is a link.
Site make_site(std::span<const stream::Store> stores);

/// The site of stores that may be replaced meanwhile, either by a rename or by copying files over
/// those of a store, which takes a while. The site is then rebuilt. An answer in progress keeps the
/// files that it started with.
class LiveSite {
 public:
  /// Builds the site. `open` opens the store at a path. Throws stream::Error.
  LiveSite(std::vector<std::string> paths,
           std::function<stream::Store(const std::string& path)> open);

  /// Returns the site of the stores that are at their paths now. While one of them is missing or
  /// cannot be served, returns the previous site and retries at the next calls. Notices a new
  /// manifest at once, and other changed files within a tenth of a second. Throws stream::Stopped
  /// if reading a store is stopped.
  const Site& current();

 private:
  using Clock = std::chrono::steady_clock;
  /// Identifies a file and its state: differs between two files at a path, and after a change.
  using Stamp = std::array<std::int64_t, 5>;
  static Stamp stamp(const std::filesystem::path& file);
  static std::vector<Stamp> stamps(std::span<const std::filesystem::path> files);
  /// Rebuilds the site. Returns false, without a change, if files changed meanwhile, because the
  /// site would mix two states of the stores.
  bool rebuild();

  std::vector<std::string> paths_;
  std::function<stream::Store(const std::string& path)> open_;
  std::vector<std::filesystem::path> manifests_, files_;  ///< files_: all except the manifests
  std::vector<Stamp> manifest_stamps_, file_stamps_;      ///< stamps of the files in site_
  std::vector<Stamp> attempted_stamps_;  ///< stamps of the manifests at the last attempt
  bool last_attempt_failed_ = false;
  Clock::time_point next_check_{};
  Site site_;
};

/// Ending of a start file, whose name is the store's plus this.
inline constexpr const char* kStartEnding = ".start";

/// Returns the name of each store in a site.
std::vector<std::string> site_names(std::span<const stream::Store> stores);

/// Returns the parts of a store that a view needs to start: a line of JSON with the ground map and
/// the list of parts, then their bytes. See docs/background/viewer.md.
std::string start_file(const stream::Store& store);

/// The number of files of a site and their total size.
struct SiteSize {
  std::uint64_t files = 0, bytes = 0;
};

/// Writes the site of the stores as a folder for any web server. The folder appears complete and
/// synced by one rename. With `replace`, it replaces a folder that terrace published, unless that
/// contains other files. If repack_threads is not 0, that many threads repack the stores. Throws
/// stream::Error, and stream::Stopped if reading a store is stopped.
SiteSize publish(std::span<const stream::Store> stores, const std::filesystem::path& folder,
                 bool replace, unsigned repack_threads);

}  // namespace terrace::tools
