// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <istream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "terrace/matching/point_matching.hpp"

namespace terrace::matching::tsplib {

/// The points of a TSPLIB file with the file's own rounded distances.
struct Instance {
  std::string type;  // EUC_2D, CEIL_2D or ATT
  std::vector<Point2> points;
};

inline Instance read(std::istream& in) {
  Instance instance;
  std::string line;
  while (std::getline(in, line) && line.find("NODE_COORD_SECTION") == std::string::npos) {
    const std::size_t colon = line.find(':');
    if (line.rfind("EDGE_WEIGHT_TYPE", 0) == 0 && colon != std::string::npos) {
      std::istringstream(line.substr(colon + 1)) >> instance.type;
    }
  }
  while (std::getline(in, line)) {
    std::istringstream row(line);
    std::size_t number = 0;
    Point2 p{};
    if (!(row >> number >> p[0] >> p[1])) break;
    instance.points.push_back(p);
  }
  if (instance.points.empty()) throw std::runtime_error("no points in a TSPLIB file");
  return instance;
}

/// Returns the file's metric. The instance must outlive it.
inline PointMetric metric_of(const Instance& instance) {
  const auto squared_distance = [&points = instance.points](std::uint32_t i, std::uint32_t j) {
    const double dx = points[i][0] - points[j][0], dy = points[i][1] - points[j][1];
    return dx * dx + dy * dy;
  };
  PointMetric metric;
  if (instance.type == "EUC_2D") {
    metric.distance = [squared_distance](std::uint32_t i, std::uint32_t j) {
      return std::floor(std::sqrt(squared_distance(i, j)) + 0.5);
    };
    metric.offset = 0.5;
  } else if (instance.type == "CEIL_2D") {
    metric.distance = [squared_distance](std::uint32_t i, std::uint32_t j) {
      return std::ceil(std::sqrt(squared_distance(i, j)));
    };
  } else if (instance.type == "ATT") {
    metric.distance = [squared_distance](std::uint32_t i, std::uint32_t j) {
      return std::ceil(std::sqrt(squared_distance(i, j) / 10.0));
    };
    metric.factor = 0.3162277660168379;  // 1 / sqrt(10), rounded down
  } else {
    throw std::runtime_error("unknown TSPLIB metric " + instance.type);
  }
  return metric;
}

/// Reads pairs of name and optimum, in the order of the file (by size).
inline std::vector<std::pair<std::string, double>> read_optima(std::istream& in) {
  std::vector<std::pair<std::string, double>> optima;
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    std::string name, size, type;
    double optimum = 0;
    if (line.empty() || line[0] == '#' || !(row >> name >> size >> type >> optimum)) continue;
    optima.emplace_back(name, optimum);
  }
  return optima;
}

}  // namespace terrace::matching::tsplib
