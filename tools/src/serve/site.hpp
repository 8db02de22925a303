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

/// What the viewer needs of a web server: its own files and those of the stores, each at a path.

namespace terrace::tools {

struct Resource {
  std::shared_ptr<const stream::ByteSource> bytes;
  std::string type;          ///< of the media
  std::string tag;           ///< the entity tag, quoted
  bool open_to_all = false;  ///< needs no token: the viewer's own files
};

/// By path, without the slash at the front. There is nothing besides: no path of a request ever
/// becomes one of a file system.
using Site = std::map<std::string, Resource>;

/// The viewer, `stores.json`, and of each store its files in `stores/NAME/` and
/// `stores/NAME.start`, which has the parts that the first picture is made of. Names are those of
/// the folders, made unique together with those of the start files. Files are opened here and stay
/// open. Throws: stream::Error, also if a file of a store is a link.
Site make_site(std::span<const stream::Store> stores);

/// The site of stores, made again when one of them has been replaced: by a rename, or by copying
/// files over its own, which takes a while. An answer under way keeps the files that it began with.
class LiveSite {
 public:
  /// open: opens the store at a path. Throws: stream::Error.
  LiveSite(std::vector<std::string> paths,
           std::function<stream::Store(const std::string& path)> open);

  /// The site of the stores that are at their paths now; the last one while one of them is missing
  /// or cannot be served, which is tried again until it can. A new manifest is seen at once, other
  /// changed files within a tenth of a second. Throws: stream::Stopped if a store is to stop.
  const Site& now();

 private:
  using Clock = std::chrono::steady_clock;
  /// Differs between two files at a path, and between a file and its changed self.
  using Stamp = std::array<std::int64_t, 5>;
  static Stamp stamp(const std::filesystem::path& file);
  static std::vector<Stamp> stamps(std::span<const std::filesystem::path> files);
  /// Whether the files stayed the same meanwhile, so that the site is of one state of the stores.
  bool make();

  std::vector<std::string> paths_;
  std::function<stream::Store(const std::string& path)> open_;
  std::vector<std::filesystem::path> manifests_, files_;  ///< files: the others
  std::vector<Stamp> manifest_stamps_, file_stamps_;      ///< of what the site was made from
  std::vector<Stamp> tried_;                              ///< manifests of the last attempt
  bool stale_ = false;                                    ///< the last attempt failed
  Clock::time_point next_look_{};
  Site site_;
};

/// The start file of a store has the store's name and this.
inline constexpr const char* kStartEnding = ".start";

/// The name of each store in a site.
std::vector<std::string> site_names(std::span<const stream::Store> stores);

/// The parts of a store that a view needs to begin: a line of JSON with the ground map and the list
/// of parts, then their bytes. tools/viewer/README.md describes it.
std::string start_file(const stream::Store& store);

struct Published {
  std::uint64_t files = 0, bytes = 0;
};

/// Writes the site of the stores as a folder for any web server. It appears whole and synced, by
/// one rename. replace: a folder that terrace has published before gives way, unless it has files
/// of others. repack_threads: unless 0, stores are repacked, by so many. Throws: stream::Error;
/// stream::Stopped if a store is to stop.
Published publish(std::span<const stream::Store> stores, const std::filesystem::path& folder,
                  bool replace, unsigned repack_threads);

}  // namespace terrace::tools
