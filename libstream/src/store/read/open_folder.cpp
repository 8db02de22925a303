// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "io/temporary.hpp"
#include "store/json.hpp"
#include "store/manifest.hpp"
#include "store/overlay_page.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/network.hpp"
#include "terrace/stream/overlay.hpp"
#include "terrace/stream/store.hpp"

/// Opens a store in a folder, where a writer that died may have left it under another name, or at a
/// URL.

namespace terrace::stream {

using namespace store;

namespace {

namespace fs = std::filesystem;

/// Returns the names of the manifest and the files that it lists; empty if the folder is not a
/// store. Reads manifests of any version, and damaged ones as far as possible.
std::set<std::string> files_of_store(const fs::path& folder) {
  std::error_code error;
  const fs::path path = folder / kManifestName;
  if (!fs::is_regular_file(path, error)) return {};
  std::set<std::string> names;
  try {
    const JsonValue manifest = JsonValue::parse(read_manifest(*open_file(path)));
    if (manifest.at("format").string() != kFormatName) return {};
    names.insert(kManifestName);
    if (manifest.has("surface")) {
      names.insert(manifest.at("surface").at("data").at("file").string());
    }
    for (const JsonValue& level : manifest.at("levels").items()) {
      for (const JsonValue& segment : level.at("segments").items()) {
        for (const char* part : {"data", "index"}) {
          names.insert(segment.at(part).at("file").string());
        }
      }
    }
  } catch (const std::runtime_error&) {
  }
  return names;
}

bool is_overlay(const fs::path& path) {
  constexpr std::string_view kMark(kOverlayMark);
  std::string begin(kMark.size(), '\0');
  std::ifstream(path, std::ios::binary)
      .read(begin.data(), static_cast<std::streamsize>(begin.size()));
  return begin == kMark;
}

}  // namespace

std::vector<std::string> overlays_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error, ignored;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    if (entry->is_regular_file(ignored) && is_overlay(entry->path())) {
      names.push_back(entry->path().filename().string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

Ownership Store::ownership_of(const fs::path& folder) {
  const std::set<std::string> ours = files_of_store(folder);
  if (ours.empty()) return false;
  return ownership_of_entries(folder, [&](const fs::directory_entry& entry) {
    std::error_code ignored;
    return fs::is_regular_file(entry.symlink_status(ignored)) &&
           (ours.contains(entry.path().filename().string()) || is_overlay(entry.path()));
  });
}

Store Store::open(const std::filesystem::path& path) {
  if (const std::string url = path.string(); is_url(url)) {
    return open(shown_url(url), files_at_url(url));
  }
  if (!exists(path)) {
    throw Error(path.string(), "there is no store here")
        .remedy("give a folder written by terrace build");
  }
  return open(path.string(), [path](const std::string& name) { return open_file(path / name); });
}

bool Store::exists(const std::filesystem::path& path) {
  if (is_url(path.string())) return true;
  std::error_code error;
  return std::filesystem::is_regular_file(path / kManifestName, error) ||
         restore_replaced(follow_links(path));
}

}  // namespace terrace::stream
