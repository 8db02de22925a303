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

/// Options shared by several verbs that read stores.

namespace terrace::tools {

struct CommonOptions;

/// The CRS of coordinates in the request (--region-crs unless the verb names it otherwise),
/// --to-crs and --towgs84.
class CrsOptions {
 public:
  /// Adds all three. `given` completes "the CRS of ...".
  void define(CLI::App& app, const std::string& name = "--region-crs",
              const std::string& given = "regions and focuses");
  /// Adds all but --to-crs.
  void define_given(CLI::App& app, const std::string& name = "--region-crs",
                    const std::string& given = "regions and focuses");
  /// The functions below report the operation that they use between datums and throw what
  /// transformation_to throws.
  /// Returns the transformation from the store's CRS to that of the request; nullopt if none is
  /// named.
  [[nodiscard]] std::optional<terrain::Transformation> given(const stream::Store& store,
                                                             const CommonOptions& common) const;
  [[nodiscard]] terrain::RegionConversion regions(const stream::Store& store,
                                                  const CommonOptions& common) const;
  [[nodiscard]] terrain::PlaceConversion places(const stream::Store& store,
                                                const CommonOptions& common) const;
  /// Returns the transformation to --to-crs, from `given` or otherwise from the store's CRS;
  /// nullopt without --to-crs.
  [[nodiscard]] std::optional<terrain::Transformation> written(
      const stream::Store& store, const CommonOptions& common,
      const std::optional<terrain::Transformation>& given = {}) const;
  /// Returns the transformation from the store's CRS to --to-crs; nullopt also if both are the
  /// same.
  [[nodiscard]] std::optional<terrain::Transformation> to(const stream::Store& store,
                                                          const CommonOptions& common) const;

 private:
  std::string given_, to_, shift_;
};

/// Selects a part of a store and its detail: the store, --level, --region, --focus, --cluster,
/// --where and CrsOptions.
struct PartOptions {
  std::string path, level, region, cluster, where;
  std::vector<std::string> focuses;
  CrsOptions crs;

  /// `kept` says what a region keeps, such as "only points inside".
  void define(CLI::App& app, const std::string& kept);
  /// Adds --cluster. `given` says what the option outputs for a cluster.
  CLI::Option* define_cluster(CLI::App& app, const std::string& given);
  /// Throws as parse_detail does.
  [[nodiscard]] terrain::Detail detail(const stream::Store& store,
                                       const CommonOptions& common) const;
};

/// Selects the surface through a store's samples: the store, --level, --max-edge, --where and
/// --method.
struct SurfaceOptions {
  std::string path, level = "0", method = "linear", where;
  std::optional<double> max_edge;

  void define(CLI::App& app);
  /// Adds all but --method.
  void define_triangles(CLI::App& app);
  /// Checks the options, then opens the store. Throws UsageError and stream::Error.
  [[nodiscard]] stream::Store open(terrain::SamplerOptions& sampler) const;
};

}  // namespace terrace::tools
