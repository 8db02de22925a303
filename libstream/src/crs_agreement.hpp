// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "terrace/stream/source.hpp"

namespace terrace::stream {

/// Compares the CRS of files with that of the first file. Thousands of files share few different
/// descriptions of a CRS, so each description is compared once.
class CrsAgreement {
 public:
  /// same: may be empty.
  CrsAgreement(Crs first, SameCrs same) : known_{std::move(first)}, same_(std::move(same)) {}

  bool agrees(const Crs& other) {
    if (std::find(known_.begin(), known_.end(), other) != known_.end()) return true;
    if (!same_ || !same_(known_.front(), other)) return false;
    if (known_.size() < kMaxKnown) known_.push_back(other);
    return true;
  }

 private:
  static constexpr std::size_t kMaxKnown = 64;

  std::vector<Crs> known_;  ///< the first file's, and others that mean the same
  SameCrs same_;
};

}  // namespace terrace::stream
