// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "store/manifest.hpp"
#include "store/read/level_reader.hpp"

namespace terrace::stream::store {

/// Checks every byte and every invariant of an open store; see Store::verify. Memory: two bits per
/// cluster and some buffers. manifest_file: the file of `manifest`.
bool verify_store(const Store& store, const ByteSource& manifest_file, const Manifest& manifest,
                  const std::vector<std::unique_ptr<LevelReader>>& levels,
                  const std::stop_token& stop, const std::function<void(const Problem&)>& report);

}  // namespace terrace::stream::store
