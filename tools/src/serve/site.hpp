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

struct Resource {
  std::shared_ptr<const stream::ByteSource> bytes;
  std::string type;          ///< media type
  std::string tag;           ///< the entity tag, quoted
  bool open_to_all = false;  ///< needs no token: the viewer's own files
};

/// Resources by path, without the leading slash. Only these are served; no path of a request ever
/// becomes a file system path.
using Site = std::map<std::string, Resource>;

/// Returns a site with the viewer, `stores.json`, and for each store its files in `stores/NAME/`
/// and `stores/NAME.start`, which has the parts needed for the first picture. Names come from the
/// folders and are made unique, start files included. Files are opened here and stay open. Throws
/// stream::Error, also if a file of a store is a link.
Site make_site(std::span<const stream::Store> stores);

/// The site of stores. It is rebuilt when a store has been replaced, either by a rename or by
/// copying files over its own, which takes a while. An answer in progress keeps the files that it
/// started with.
class LiveSite {
 public:
  /// `open` opens the store at a path. Throws stream::Error.
  LiveSite(std::vector<std::string> paths,
           std::function<stream::Store(const std::string& path)> open);

  /// Returns the site of the stores now at their paths. While one of them is missing or cannot be
  /// served, it returns the previous site and keeps retrying. A new manifest is noticed at once,
  /// other changed files within a tenth of a second. Throws stream::Stopped if reading a store is
  /// stopped.
  const Site& now();

 private:
  using Clock = std::chrono::steady_clock;
  /// Identifies a file and its state: differs between two files at a path, and after a change.
  using Stamp = std::array<std::int64_t, 5>;
  static Stamp stamp(const std::filesystem::path& file);
  static std::vector<Stamp> stamps(std::span<const std::filesystem::path> files);
  /// Rebuilds the site. Returns whether the files stayed the same meanwhile, so that the site shows
  /// one state of the stores.
  bool make();

  std::vector<std::string> paths_;
  std::function<stream::Store(const std::string& path)> open_;
  std::vector<std::filesystem::path> manifests_, files_;  ///< files_: all others
  std::vector<Stamp> manifest_stamps_,
      file_stamps_;           ///< stamps of the files that site_ was made from
  std::vector<Stamp> tried_;  ///< manifest stamps of the last attempt
  bool stale_ = false;        ///< the last attempt failed
  Clock::time_point next_look_{};
  Site site_;
};

/// Ending of a start file, which otherwise has the store's name.
inline constexpr const char* kStartEnding = ".start";

/// Returns the name of each store in a site.
std::vector<std::string> site_names(std::span<const stream::Store> stores);

/// Returns the parts of a store that a view needs to start: a line of JSON with the ground map and
/// the list of parts, then their bytes. See docs/background/viewer.md.
std::string start_file(const stream::Store& store);

struct Published {
  std::uint64_t files = 0, bytes = 0;
};

/// Writes the site of the stores as a folder for any web server. It appears complete and synced by
/// one rename. With `replace`, it replaces a folder that terrace published, unless that contains
/// other files. If repack_threads is not 0, stores are repacked by that many threads. Throws
/// stream::Error, and stream::Stopped if reading a store is stopped.
Published publish(std::span<const stream::Store> stores, const std::filesystem::path& folder,
                  bool replace, unsigned repack_threads);

}  // namespace terrace::tools
