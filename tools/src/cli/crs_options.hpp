// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "earth/store_crs.hpp"

namespace CLI {
class App;
}

namespace terrace::tools {

using namespace terrain;

/// The options --region-crs, --to-crs and --towgs84 of a verb on stores.
class CrsOptions {
 public:
  void define(CLI::App& app);
  /// Without --to-crs.
  void define_region(CLI::App& app);
  /// Throws: as systems_of.
  [[nodiscard]] RegionConversion regions(const stream::Store& store) const;
  [[nodiscard]] PlaceConversion places(const stream::Store& store) const;
  /// The store's CRS and that of --to-crs; nothing without it, or if they are the same.
  [[nodiscard]] std::optional<SystemPair> to(const stream::Store& store) const;

 private:
  std::string region_, to_, shift_;
};

}  // namespace terrace::tools
