// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/interpolation.hpp>

#include "terrace/terrain/crs.hpp"
#include "terrace/terrain/detail.hpp"
#include "terrace/terrain/heights.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

/// Options that several verbs on stores have.

namespace terrace::tools {

struct CommonOptions;

using namespace terrain;

/// The CRS of what is given (--region-crs unless named otherwise), --to-crs and --towgs84.
class CrsOptions {
 public:
  /// given: as in "the CRS of regions".
  void define(CLI::App& app, const std::string& name = "--region-crs",
              const std::string& given = "regions and focuses");
  /// Without --to-crs.
  void define_given(CLI::App& app, const std::string& name = "--region-crs",
                    const std::string& given = "regions and focuses");
  /// Each reports the operation that it uses between datums. Throws: as transformation_to.
  /// To the CRS of what is given; nullopt if none is named.
  [[nodiscard]] std::optional<Transformation> given(const stream::Store& store,
                                                    const CommonOptions& common) const;
  [[nodiscard]] RegionConversion regions(const stream::Store& store,
                                         const CommonOptions& common) const;
  [[nodiscard]] PlaceConversion places(const stream::Store& store,
                                       const CommonOptions& common) const;
  /// To --to-crs, from `given` or else from the store's CRS; nullopt without --to-crs.
  [[nodiscard]] std::optional<Transformation> written(
      const stream::Store& store, const CommonOptions& common,
      const std::optional<Transformation>& given = {}) const;
  /// To --to-crs from the store's CRS; nullopt also if both are the same.
  [[nodiscard]] std::optional<Transformation> to(const stream::Store& store,
                                                 const CommonOptions& common) const;

 private:
  std::string given_, to_, shift_;
};

/// Which part of a store at which detail: the store, --level, --region, --focus, --cluster, --where
/// and CrsOptions.
struct PartOptions {
  std::string path, level, region, cluster, where;
  std::vector<std::string> focuses;
  CrsOptions crs;

  /// kept: what a region keeps, as in "only points inside".
  void define(CLI::App& app, const std::string& kept);
  /// Adds --cluster. given: what a cluster gives.
  CLI::Option* define_cluster(CLI::App& app, const std::string& given);
  /// Throws: as parse_detail.
  [[nodiscard]] Detail detail(const stream::Store& store, const CommonOptions& common) const;
};

/// The surface between a store's samples: the store, --level, --max-edge, --where and --method.
struct SurfaceOptions {
  std::string path, level = "0", method = "linear", where;
  std::optional<double> max_edge;

  void define(CLI::App& app);
  /// Without --method.
  void define_triangles(CLI::App& app);
  /// Checks the options, then opens the store. Throws: UsageError, stream::Error.
  [[nodiscard]] stream::Store open(SamplerOptions& sampler) const;
};

}  // namespace terrace::tools
