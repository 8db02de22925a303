// SPDX-License-Identifier: Apache-2.0
#include "lemon_oracle.hpp"

#include <lemon/matching.h>
#include <lemon/smart_graph.h>

struct LemonOracle::Graph {
  lemon::SmartGraph graph;
  lemon::SmartGraph::EdgeMap<std::int64_t> weight{graph};
};

LemonOracle::LemonOracle(std::uint32_t vertex_count, const std::vector<Edge>& edges)
    : graph_(new Graph) {
  lemon::SmartGraph& graph = graph_->graph;
  graph.reserveNode(static_cast<int>(vertex_count));
  graph.reserveEdge(static_cast<int>(edges.size()));
  for (std::uint32_t v = 0; v < vertex_count; ++v) graph.addNode();
  for (const Edge& e : edges) {
    const auto edge = graph.addEdge(graph.nodeFromId(static_cast<int>(e.i)),
                                    graph.nodeFromId(static_cast<int>(e.j)));
    graph_->weight[edge] = -e.weight;
  }
}

LemonOracle::~LemonOracle() = default;

bool LemonOracle::solve(std::int64_t& cost) {
  lemon::MaxWeightedPerfectMatching<lemon::SmartGraph, lemon::SmartGraph::EdgeMap<std::int64_t>>
      matching(graph_->graph, graph_->weight);
  if (!matching.run()) return false;
  cost = -matching.matchingWeight();
  return true;
}
