// SPDX-License-Identifier: Apache-2.0
#include "hierarchy/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "facility/points/search_frame.hpp"
#include "ground.hpp"

namespace terrace::cluster {

void leave_out(const FacilityPoints& problem, BlockClustering& clustering) {
  if (std::isinf(problem.outlier_price)) return;
  const SearchFrame frame = make_frame(problem);
  const double weight = frame.weights.front();  // all weights are equal
  const double price = frame.outlier_price;
  const double facility_cost = frame.facility_cost / weight;
  const std::vector<std::uint32_t>& facilities = clustering.facilities;
  const auto between = [&](std::size_t i, std::size_t cluster) {
    return std::sqrt(
        squared_length(difference(frame.points[i], frame.points[facilities[cluster]])));
  };

  std::vector<std::uint32_t> sizes(facilities.size(), 0);
  std::vector<double> spent(facilities.size(), facility_cost);
  for (std::size_t i = 0; i < frame.points.size(); ++i) {
    const std::uint32_t c = clustering.assignment[i];
    const double d = between(i, c);
    ++sizes[c];
    spent[c] += std::min(d, price);
    if (d > price) clustering.assignment[i] = kOutlier;
  }

  // Clusters that cost more than leaving out all their members, smallest first.
  std::vector<std::uint32_t> doubtful;
  std::vector<char> listed(facilities.size(), 0);
  for (std::uint32_t c = 0; c < facilities.size(); ++c) {
    if (!(sizes[c] * price < spent[c])) continue;
    doubtful.push_back(c);
    listed[c] = 1;
  }
  if (doubtful.empty()) return;
  std::stable_sort(doubtful.begin(), doubtful.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return sizes[a] < sizes[b]; });
  std::vector<std::vector<std::uint32_t>> members(facilities.size());  // of listed clusters
  for (std::uint32_t i = 0; i < frame.points.size(); ++i) {
    const std::uint32_t c = clustering.assignment[i];
    if (c != kOutlier && listed[c]) members[c].push_back(i);
  }

  struct Elsewhere {
    std::uint32_t cluster;
    double cost;
  };
  std::vector<Elsewhere> moves;
  std::vector<char> closed(facilities.size(), 0);
  std::size_t open = facilities.size();
  for (const std::uint32_t c : doubtful) {
    if (open == 1) break;
    moves.clear();
    double without = static_cast<double>(sizes[c] - members[c].size()) * price;
    bool leaves = false;
    for (const std::uint32_t i : members[c]) {
      Elsewhere best{kOutlier, price};
      for (std::uint32_t other = 0; other < facilities.size(); ++other) {
        if (other == c || closed[other]) continue;
        if (const double d = between(i, other); d < best.cost) best = {other, d};
      }
      moves.push_back(best);
      without += best.cost;
      leaves = leaves || best.cluster == kOutlier;
    }
    if (!leaves || !(without < spent[c])) continue;
    closed[c] = 1;
    --open;
    for (std::size_t k = 0; k < moves.size(); ++k) {
      const auto [to, cost] = moves[k];
      clustering.assignment[members[c][k]] = to;
      if (to == kOutlier) continue;
      ++sizes[to];
      spent[to] += cost;
      if (listed[to]) members[to].push_back(members[c][k]);
    }
  }
}

}  // namespace terrace::cluster
