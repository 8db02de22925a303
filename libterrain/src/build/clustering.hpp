// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <terrace/cluster/hierarchy.hpp>
#include <terrace/stream/schema.hpp>

#include "earth/ground.hpp"
#include "terrace/terrain/build.hpp"

/// How a build clusters its points: distances on the ground, attributes in them, outliers.

namespace terrace::terrain {

/// The attribute that marks outliers: 1 for them, 0 for all others. It is the last.
inline constexpr const char* kOutlierName = "outlier";

/// The input in messages.
[[nodiscard]] inline std::string input_name(const BuildRequest& request) {
  return request.inputs.empty() ? "the source" : request.inputs.front();
}

/// Adds the mark of outliers to the attributes, if the request has a price for them.
/// Throws: stream::Error if the source has an attribute of that name.
void add_outlier_mark(const BuildRequest& request, std::vector<stream::Channel>& attributes);

/// `count` packed records with a further byte each, zero.
void append_zero_byte(std::span<const std::byte> records, std::size_t record_bytes,
                      std::size_t count, std::vector<std::byte>& result);

/// schema: with the mark. All three must outlive the options.
/// Throws: stream::Error on an attribute that is not there, naming those that are.
cluster::HierarchyOptions clustering_of(const BuildRequest& request, const stream::Schema& schema,
                                        const Ground& ground);

}  // namespace terrace::terrain
