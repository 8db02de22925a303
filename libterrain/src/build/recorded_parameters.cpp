// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string_view>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/stored_entities.hpp"
#include "base/units.hpp"
#include "build/clustering.hpp"
#include "terrace/terrain/error.hpp"

namespace terrace::terrain {
namespace {

constexpr std::string_view kChannel = "channel ";

constexpr std::array<std::pair<const char*, cluster::Effort>, 4> kEfforts{
    {{"fast", cluster::Effort::fast},
     {"default", cluster::Effort::standard},
     {"fine", cluster::Effort::fine},
     {"full", cluster::Effort::full}}};

std::optional<cluster::FacilityStrategy> strategy_of(std::string_view name) {
  using cluster::FacilityStrategy;
  for (unsigned i = 0; i <= static_cast<unsigned>(FacilityStrategy::greedy_stars); ++i) {
    const auto strategy = static_cast<FacilityStrategy>(i);
    if (cluster::name_of(strategy) == name) return strategy;
  }
  return std::nullopt;
}

/// Parses a whole number or a real one. Throws: std::invalid_argument for any other text.
template <class Number>
Number number_of(std::string_view text) {
  Number number{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) throw std::invalid_argument("");
  return number;
}

template <class Value>
Value known(const std::optional<Value>& value) {
  if (!value) throw std::invalid_argument("");
  return *value;
}

/// Throws: std::invalid_argument, UsageError.
void set_parameter(const std::string& name, const std::string& value, BuildRequest& request) {
  if (name == "block") {
    request.block_points = number_of<std::size_t>(value);
  } else if (name == "k") {
    request.k = number_of<std::size_t>(value);
  } else if (name == "facility_cost") {
    request.facility_cost = number_of<double>(value);
  } else if (name == "effort") {
    request.effort = known(effort_of(value));
  } else if (name == "z_weight") {
    request.z_weight = number_of<double>(value);
  } else if (name == "seed") {
    request.seed = number_of<std::uint64_t>(value);
  } else if (name == "metric") {
    request.metric = MetricChoice::recorded(value);
  } else if (name == "strategy") {
    request.strategy = known(strategy_of(value));
  } else if (name == "batch") {
    request.batch = number_of<std::size_t>(value);
  } else if (name == kEntitiesParameter) {
    // Checked by entities_of().
  } else if (name == "outlier_price") {
    request.outlier_price = number_of<double>(value);
  } else if (name.starts_with(kChannel)) {
    request.channels.emplace_back(name.substr(kChannel.size()), number_of<double>(value));
  } else {
    throw std::invalid_argument("");
  }
}

}  // namespace

std::vector<std::pair<std::string, std::string>> recorded_parameters(const BuildRequest& request) {
  std::vector<std::pair<std::string, std::string>> parameters{
      {"block", fmt::format("{}", request.block_points)},
      request.k > 0 ? std::pair("k", fmt::format("{}", request.k))
                    : std::pair("facility_cost", number_text(request.facility_cost)),
      {"effort", name_of(request.effort)},
      {"z_weight", number_text(request.z_weight)},
      {"seed", fmt::format("{}", request.seed)}};
  if (request.metric.kind != MetricChoice::Kind::euclidean) {
    parameters.emplace_back("metric", request.metric.canonical());
  }
  if (request.strategy != cluster::FacilityStrategy::automatic) {
    parameters.emplace_back("strategy", cluster::name_of(request.strategy));
  }
  if (request.batch != 1) parameters.emplace_back("batch", fmt::format("{}", request.batch));
  if (request.entities != stream::Entities::points) {
    parameters.emplace_back(kEntitiesParameter, stream::name_of(request.entities));
  }
  for (const auto& [name, weight] : request.channels) {
    parameters.emplace_back(std::string(kChannel) + name, number_text(weight));
  }
  if (std::isfinite(request.outlier_price)) {
    parameters.emplace_back("outlier_price", number_text(request.outlier_price));
  }
  return parameters;
}

BuildRequest recorded_request(const stream::StoreSchema& schema, const std::string& file,
                              BuildRequest request) {
  request.entities = entities_of(schema);
  request.channels.clear();
  for (const auto& parameter : schema.parameters) {
    const auto unknown = [&] {
      return stream::Error(file, fmt::format("the parameter \"{}\" is not one of this version: {}",
                                             parameter.first, parameter.second))
          .remedy("rebuild the store from its source");
    };
    try {
      set_parameter(parameter.first, parameter.second, request);
    } catch (const std::invalid_argument&) {
      throw unknown();
    } catch (const UsageError&) {
      throw unknown();
    }
  }
  return request;
}

std::optional<cluster::Effort> effort_of(const std::string& name) {
  for (const auto& [text, effort] : kEfforts) {
    if (name == text) return effort;
  }
  return std::nullopt;
}

std::string name_of(cluster::Effort effort) {
  return kEfforts[static_cast<std::size_t>(effort)].first;
}

}  // namespace terrace::terrain
