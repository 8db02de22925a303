// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <span>
#include <string>

#include <CLI/CLI.hpp>
#include <terrace/stream/source.hpp>

#include "terrace/terrain/crs.hpp"

/// --where, --region, --region-crs, --resolution, --keep and --drop of verbs that read files.

namespace terrace::terrain {
class Region;
}

namespace terrace::tools {

struct CommonOptions;

class SelectionOptions {
 public:
  void define(CLI::App& app);
  /// Returns whether --where or --region may exclude points.
  [[nodiscard]] bool selects() const { return !where_.empty() || !region_.empty(); }
  /// Returns the selection of points and attributes for reading `inputs` with `reading`. Opens the
  /// inputs if it needs their CRS; `shift` is the datum shift of that CRS. Throws UsageError for an
  /// invalid list or region, and stream::Error.
  [[nodiscard]] stream::Selection selection(std::span<const std::string> inputs,
                                            const stream::SourceOptions& reading,
                                            const std::optional<terrain::DatumShift>& shift,
                                            const CommonOptions& common) const;

 private:
  /// Returns the conversion of `region` to the CRS of the inputs. Throws UsageError if it needs the
  /// CRS of an input that can be read only once.
  [[nodiscard]] terrain::RegionConversion conversion(
      std::span<const std::string> inputs, const stream::SourceOptions& reading,
      const std::optional<terrain::DatumShift>& shift, const terrain::Region& region) const;

  std::string where_, region_, region_crs_, keep_, drop_;
  std::optional<double> resolution_;
};

/// Adds --where, a condition on attributes.
void add_where(CLI::App& app, std::string& where);

}  // namespace terrace::tools
