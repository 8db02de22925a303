// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <terrace/cluster/hierarchy.hpp>
#include <terrace/stream/schema.hpp>
#include <terrace/stream/store.hpp>

#include "earth/ground.hpp"
#include "terrace/terrain/build.hpp"

/// Clustering in a build: distances on the ground, attributes as further axes, outliers.

namespace terrace::terrain {

/// The attribute that marks outliers with 1 and all other points with 0. It is the last one.
inline constexpr const char* kOutlierName = "outlier";

/// The name of the input in messages.
[[nodiscard]] inline std::string input_name(const BuildRequest& request) {
  return request.inputs.empty() ? "the source" : request.inputs.front();
}

/// Throws UsageError if options of the clustering exclude each other or are out of range.
void check_clustering(const BuildRequest& request);

/// Returns the points of a block: those of the request, or more if there are many medians.
[[nodiscard]] std::size_t block_points_for(const BuildRequest& request);

/// Adds the outlier mark to the attributes, if the request has an outlier price. Throws:
/// stream::Error if the source has an attribute with that name.
void add_outlier_mark(const BuildRequest& request, std::vector<stream::Channel>& attributes);

/// Copies `count` packed records to `result`, each followed by a zero byte.
void append_zero_byte(std::span<const std::byte> records, std::size_t record_bytes,
                      std::size_t count, std::vector<std::byte>& result);

/// Returns the options of the clustering. schema: includes the outlier mark. All three arguments
/// must outlive the options. Throws: stream::Error on a missing attribute, naming the existing
/// ones.
cluster::HierarchyOptions clustering_of(const BuildRequest& request, const stream::Schema& schema,
                                        const Ground& ground);

/// Returns the options of the clustering as the manifest of a store records them: names and values,
/// in the order of the manifest.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> recorded_parameters(
    const BuildRequest& request);
/// Returns the request with the options of clustering that recorded_parameters() gave; all others
/// stay as they are. file: the store, for messages. Throws: stream::Error for a name or value that
/// recorded_parameters() does not write.
[[nodiscard]] BuildRequest recorded_request(const stream::StoreSchema& schema,
                                            const std::string& file, BuildRequest request = {});

}  // namespace terrace::terrain
