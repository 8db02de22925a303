// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "columns.hpp"
#include "terrace/tri/thinned_delaunay2.hpp"
#include "terrace/tri/view.hpp"
#include "windows.hpp"

namespace terrace::tri {

/// Chooses the steps of the complete windows by a view.
class WindowDemand {
 public:
  struct Change {
    /// Error over tolerance. Not above 1: the tolerance holds so far. 0: the window becomes
    /// coarser.
    double urgency = 0.0;
    ThinnedDelaunay2::Target target;
    bool coarsens = false;
  };

  /// The windows whose step must change, the most urgent first.
  std::span<const Change> changes(const ThinnedDelaunay2& raster, const ViewWindows& windows,
                                  const View& view, const ViewOptions& options, int coarser);
  [[nodiscard]] std::size_t memory() const {
    return columns_.memory() + changes_.capacity() * sizeof(Change);
  }

 private:
  ViewColumns columns_;
  ViewDemand demand_;
  std::vector<std::uint32_t> numbers_;
  std::vector<Change> changes_;
};

}  // namespace terrace::tri
