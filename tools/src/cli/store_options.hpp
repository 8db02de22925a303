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
struct Summary;

/// The CRS of coordinates in the request (--region-crs unless the verb names it otherwise),
/// --to-crs and --towgs84. All functions that return a transformation or conversion print a note on
/// the operation between datums and throw what transformation_to() throws.
class CrsOptions {
 public:
  /// Adds all three. `subject` completes "the CRS of ...".
  void define(CLI::App& app, const std::string& name = "--region-crs",
              const std::string& subject = "regions and focuses");
  /// Adds all but --to-crs.
  void define_input(CLI::App& app, const std::string& name = "--region-crs",
                    const std::string& subject = "regions and focuses");

  /// Returns the transformation from the store's CRS to that of the request; nullopt if the request
  /// names none.
  [[nodiscard]] std::optional<terrain::Transformation> from_store_to_input(
      const stream::Store& store, const CommonOptions& common) const;
  /// Returns the conversion of regions and focuses to the store's CRS.
  [[nodiscard]] terrain::RegionConversion regions(const stream::Store& store,
                                                  const CommonOptions& common) const;
  /// Returns the conversion of positions from the store's CRS to --to-crs.
  [[nodiscard]] terrain::PlaceConversion places(const stream::Store& store,
                                                const CommonOptions& common) const;
  /// Returns the transformation to --to-crs, from the CRS of the request if `input` is given and
  /// otherwise from the store's CRS. Returns nullopt without --to-crs.
  [[nodiscard]] std::optional<terrain::Transformation> from_input_to_output(
      const stream::Store& store, const CommonOptions& common,
      const std::optional<terrain::Transformation>& input = {}) const;
  /// Returns the transformation from the store's CRS to --to-crs; nullopt without --to-crs, and if
  /// both are the same.
  [[nodiscard]] std::optional<terrain::Transformation> from_store_to_output(
      const stream::Store& store, const CommonOptions& common) const;

 private:
  std::string input_crs_, output_crs_, datum_shift_;
  mutable std::string noted_;  ///< the last note, so that it is not printed twice
};

/// Selects a part of a store and its detail: the store, --level, --region, --focus, --cluster,
/// --where and CrsOptions.
struct PartOptions {
  std::string path, level, region, cluster, where;
  std::vector<std::string> focuses;
  CrsOptions crs;

  /// `region_effect` describes the effect of --region, such as "only points inside".
  void define(CLI::App& app, const std::string& region_effect);
  /// Adds --cluster. `cluster_effect` describes what the verb writes for a cluster.
  CLI::Option* define_cluster(CLI::App& app, const std::string& cluster_effect);
  /// Throws as parse_detail does.
  [[nodiscard]] terrain::Detail detail(const stream::Store& store,
                                       const CommonOptions& common) const;
};

/// Selects the surface through a store's samples: the store, --level, --focus, --max-error,
/// --max-edge, --where and --method.
struct SurfaceOptions {
  std::string path, level, method = "linear", where;
  std::vector<std::string> focuses;
  std::optional<double> max_error, max_edge;

  void define(CLI::App& app);
  /// Adds all but --method.
  void define_triangles(CLI::App& app);
  /// Checks the options, then opens the store. Throws UsageError and stream::Error.
  [[nodiscard]] stream::Store open(terrain::SamplerOptions& sampler) const;
  /// Returns the detail of the surface and the region, if the text is not empty. Throws as
  /// parse_detail does.
  [[nodiscard]] terrain::Detail detail(const stream::Store& store, const CrsOptions& crs,
                                       const CommonOptions& common,
                                       const std::string& region = {}) const;
  /// Adds the levels of the detail and the bound to a summary.
  void report(const terrain::Detail& detail, Summary& summary) const;
};

}  // namespace terrace::tools
