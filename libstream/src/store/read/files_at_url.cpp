// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "io/temporary.hpp"
#include "store/json.hpp"
#include "store/manifest.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/network.hpp"
#ifdef TERRACE_NETWORK
#include "net/remote_folder.hpp"
#endif

namespace terrace::stream {

#ifdef TERRACE_NETWORK
namespace {

/// Opening a store reads at most this much of the end of an index, besides the directory. Smaller
/// files are requested as a whole.
constexpr std::uint64_t kOpeningBytes = std::uint64_t{64} << 10;

/// Takes the sizes of a store's files from the manifest, so that they need not be asked for, and
/// requests together what opening the store and reading its root needs. A damaged manifest is left
/// to Store::open().
void prepare(net::RemoteFolder& folder, const std::string& manifest) {
  std::vector<ByteRange> needed;
  const auto expect = [&](const store::JsonValue& file) {
    const std::string& name = file.at("file").string();
    folder.expect(name, file.at("bytes").count());
    return std::pair(name, file.at("bytes").count());
  };
  try {
    const store::JsonValue json = store::JsonValue::parse(manifest);
    if (json.has("surface")) expect(json.at("surface").at("data"));
    const std::vector<store::JsonValue>& levels = json.at("levels").items();
    for (const store::JsonValue& level : levels) {
      const std::vector<store::JsonValue>& segments = level.at("segments").items();
      for (const store::JsonValue& segment : segments) {
        const auto [data, data_bytes] = expect(segment.at("data"));
        const auto [index, index_bytes] = expect(segment.at("index"));
        if (segments.size() > 1) continue;  // opened when they are first needed
        const std::uint64_t directory = segment.at("directory_bytes").count();
        const std::uint64_t end = index_bytes - std::min(index_bytes, directory) < kOpeningBytes
                                      ? index_bytes
                                      : kOpeningBytes + directory;
        needed.push_back({index, index_bytes - end, end});
        if (&level == &levels.back() && data_bytes <= kOpeningBytes) {
          needed.push_back({data, 0, data_bytes});
        }
      }
    }
  } catch (const store::Damage&) {
    return;
  }
  folder.prefetch(needed);
}

}  // namespace

OpenByName files_at_url(const std::string& url, const NetworkOptions& options) {
  const auto folder = std::make_shared<net::RemoteFolder>(url, options);
  return [folder](const std::string& name) {
    auto file = folder->open(name);
    if (name == kManifestName) prepare(*folder, store::read_manifest(*file));
    return file;
  };
}

#else

OpenByName files_at_url(const std::string& url, const NetworkOptions&) {
  throw Error(shown_url(url), "this build of terrace cannot read over the network")
      .remedy("build it with libcurl and -Dterrace_network=enabled, or copy the files");
}

#endif

}  // namespace terrace::stream
