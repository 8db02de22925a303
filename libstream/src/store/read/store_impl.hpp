// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "spares.hpp"
#include "store/manifest.hpp"
#include "store/read/level_reader.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"

namespace terrace::stream {

/// The state shared by copies of an open store.
struct Store::Impl {
  std::filesystem::path path;
  std::unique_ptr<ByteSource> manifest_file;
  store::Manifest manifest;
  std::uint64_t bytes = 0;
  std::vector<LevelInfo> infos;
  std::vector<std::unique_ptr<store::LevelReader>> levels;
  OpenByName files;  ///< only if there is a surface, to open it when it is first needed

  Spares<store::ReadSpace> spaces;

  const store::LevelReader& level(unsigned number) const {
    if (number >= levels.size()) {
      throw Error(path.string(), "there is no level " + std::to_string(number) + ", the top is " +
                                     std::to_string(levels.size() - 1));
    }
    return *levels[number];
  }
};

}  // namespace terrace::stream
