// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <system_error>

#include "io/temporary.hpp"
#include "store/manifest.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

/// A store in its folder, where a writer that died may have left it under another name.

namespace terrace::stream {

Store Store::open(const std::filesystem::path& path) {
  if (!exists(path)) {
    throw Error({.file = path.string(),
                 .where = {},
                 .cause = "there is no store here",
                 .remedy = "name a folder that terrace build has written"});
  }
  return open(path.string(), [path](const std::string& name) { return open_file(path / name); });
}

bool Store::exists(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_regular_file(path / kManifestName, error) ||
         put_back_replaced(follow_links(path));
}

}  // namespace terrace::stream
