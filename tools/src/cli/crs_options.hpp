// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>

#include "terrace/terrain/crs.hpp"

namespace CLI {
class App;
}

namespace terrace::tools {

struct CommonOptions;

using namespace terrain;

/// The options --region-crs, --to-crs and --towgs84 of a verb on stores.
class CrsOptions {
 public:
  void define(CLI::App& app);
  /// Without --to-crs.
  void define_region(CLI::App& app);
  /// Each says which operation it uses between datums. Throws: as transformation_to.
  [[nodiscard]] RegionConversion regions(const stream::Store& store,
                                         const CommonOptions& common) const;
  [[nodiscard]] PlaceConversion places(const stream::Store& store,
                                       const CommonOptions& common) const;
  /// To --to-crs; nothing without it, or if it is the store's.
  [[nodiscard]] std::optional<Transformation> to(const stream::Store& store,
                                                 const CommonOptions& common) const;

 private:
  [[nodiscard]] Transformation change(const stream::Store& store, const std::string& named,
                                      const CommonOptions& common) const;
  std::string region_, to_, shift_;
};

}  // namespace terrace::tools
