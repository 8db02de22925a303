// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <queue>
#include <utility>

#include <terrace/base/stop_check.hpp>

#include "poles.hpp"

namespace terrace::tri::shape {
namespace {

/// Labels, and the number of tetrahedra of each label at every vertex.
class Labels {
 public:
  Labels(const Spheres& spheres, std::vector<std::uint8_t>& inside,
         std::span<const std::uint8_t> complete)
      : spheres_(spheres), inside_(inside), complete_(complete), count_(spheres.places().size()) {
    const auto tetrahedra = spheres.tetrahedra();
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
      const auto& corner = tetrahedra[t].corner;
      if (spheres.finite(t)) {
        for (const std::uint32_t v : corner) ++count_[v][inside_[t]];
      } else if (spatial::is_ghost(corner)) {
        for (const std::uint32_t v : corner) ++count_[v][0];
      }
    }
  }
  [[nodiscard]] std::uint8_t at(std::uint32_t t) const { return inside_[t]; }
  [[nodiscard]] std::uint32_t count(std::uint32_t vertex, std::uint8_t label) const {
    return count_[vertex][label];
  }
  [[nodiscard]] bool is_off_surface(std::uint32_t v) const {
    return count_[v][0] == 0 || count_[v][1] == 0;
  }
  /// By vertex, true if it is off the surface and its tetrahedra may change. Empty if there is no
  /// such vertex.
  [[nodiscard]] std::vector<std::uint8_t> vertices_off_surface() const {
    std::vector<std::uint8_t> result(count_.size());
    bool found = false;
    for (std::uint32_t v = 1; v < count_.size(); ++v) {
      if (count_[v][0] + count_[v][1] == 0 || !is_off_surface(v)) continue;
      found |= (result[v] = complete_.empty() || complete_[v] != 0) != 0;
    }
    return found ? result : std::vector<std::uint8_t>{};
  }
  /// True if t is finite and all tetrahedra at its corners are in the part.
  [[nodiscard]] bool changeable(std::uint32_t t) const {
    if (!spheres_.finite(t)) return false;
    const auto& corner = spheres_.tetrahedra()[t].corner;
    return complete_.empty() || std::all_of(corner.begin(), corner.end(),
                                            [&](std::uint32_t v) { return complete_[v] != 0; });
  }
  LabelCounts take_counts() { return std::move(count_); }
  void flip(std::uint32_t t) {
    for (const std::uint32_t v : spheres_.tetrahedra()[t].corner) {
      --count_[v][inside_[t]];
      ++count_[v][1 - inside_[t]];
    }
    inside_[t] ^= 1;
  }

 private:
  const Spheres& spheres_;
  std::vector<std::uint8_t>& inside_;
  std::span<const std::uint8_t> complete_;
  LabelCounts count_;
};

/// Smaller gains could be rounding errors that flip a tetrahedron back and forth.
constexpr double kMinGain = 0x1p-40;

/// How much t's facets contradict its label, if at least two neighbours differ from it. Otherwise
/// 0.
double gain_of(const Spheres& spheres, const Labels& labels, std::uint32_t t) {
  const spatial::Tetrahedron& tetrahedron = spheres.tetrahedra()[t];
  std::array<bool, 4> differs{};
  int differing = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    differs[i] = labels.at(spatial::tetrahedron_of(tetrahedron.mate[i])) != labels.at(t);
    differing += differs[i];
  }
  if (differing < 2) return 0.0;
  std::array<double, 4> terms{};
  for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
    const double weight = 2.0 - spheres.facet_defect(spatial::make_side(t, i));
    terms[i] = differs[i] ? weight : -weight;
  }
  std::sort(terms.begin(), terms.end());
  return terms[0] + terms[1] + terms[2] + terms[3];
}

void smooth(const Spheres& spheres, Labels& labels, base::StopTicks& ticks) {
  struct Candidate {
    double gain;
    Ranks corners;
    std::uint32_t tetrahedron;
    bool operator<(const Candidate& other) const {
      return gain != other.gain ? gain < other.gain : corners > other.corners;
    }
  };
  const auto tetrahedra = spheres.tetrahedra();
  std::priority_queue<Candidate> next;
  const auto consider = [&](std::uint32_t t) {
    if (!labels.changeable(t)) return;
    const double gain = gain_of(spheres, labels, t);
    if (gain > kMinGain) next.push({gain, spheres.ranks_of(t), t});
  };
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
    ticks(32);
    consider(t);
  }
  while (!next.empty()) {
    ticks(256);
    const Candidate candidate = next.top();
    next.pop();
    const std::uint32_t t = candidate.tetrahedron;
    if (gain_of(spheres, labels, t) != candidate.gain) continue;
    const auto& corner = tetrahedra[t].corner;
    if (std::any_of(corner.begin(), corner.end(),
                    [&](std::uint32_t v) { return labels.count(v, labels.at(t)) == 1; }))
      continue;
    labels.flip(t);
    for (const spatial::Side mate : tetrahedra[t].mate) consider(spatial::tetrahedron_of(mate));
  }
}

void sculpt(const Spheres& spheres, Labels& labels, base::StopTicks& ticks) {
  struct Candidate {
    double defect;
    std::uint32_t vertex_rank;
    Ranks facet;
    spatial::Side side;  ///< side of the tetrahedron to flip, opposite to the vertex
    bool operator<(const Candidate& other) const {
      if (defect != other.defect) return defect > other.defect;
      if (vertex_rank != other.vertex_rank) return vertex_rank > other.vertex_rank;
      return facet > other.facet;
    }
  };
  const auto tetrahedra = spheres.tetrahedra();
  const auto vertex_of = [&](spatial::Side side) {
    return tetrahedra[spatial::tetrahedron_of(side)].corner[spatial::index_of(side)];
  };
  std::priority_queue<Candidate> next;
  const auto consider = [&](spatial::Side side) {
    const std::uint32_t t = spatial::tetrahedron_of(side);
    if (!spheres.finite(t) || !labels.is_off_surface(vertex_of(side)) || !labels.changeable(t))
      return;
    const spatial::Side mate = tetrahedra[t].mate[spatial::index_of(side)];
    if (labels.at(spatial::tetrahedron_of(mate)) == labels.at(t)) return;
    next.push({spheres.facet_defect(side), spheres.places()[vertex_of(side)].rank,
               spheres.facet_ranks(side), side});
  };
  const std::vector<std::uint8_t> is_off_surface = labels.vertices_off_surface();
  if (is_off_surface.empty()) return;
  for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
    ticks(8);
    if (!spheres.finite(t)) continue;
    for (const std::uint32_t i : {0u, 1u, 2u, 3u})
      if (is_off_surface[tetrahedra[t].corner[i]] != 0) consider(spatial::make_side(t, i));
  }
  while (!next.empty()) {
    ticks(256);
    const spatial::Side side = next.top().side;
    next.pop();
    const std::uint32_t t = spatial::tetrahedron_of(side);
    const spatial::Side mate = tetrahedra[t].mate[spatial::index_of(side)];
    if (!labels.is_off_surface(vertex_of(side)) ||
        labels.at(spatial::tetrahedron_of(mate)) == labels.at(t))
      continue;
    labels.flip(t);
    for (const spatial::Side neighbour : tetrahedra[t].mate) consider(neighbour);
  }
}

}  // namespace

LabelCounts smooth_and_sculpt(const Spheres& spheres, std::vector<std::uint8_t>& inside,
                              const Part& part, const base::StopCheck& check_stop) {
  base::StopTicks ticks(check_stop);
  Labels labels(spheres, inside, part.complete);
  smooth(spheres, labels, ticks);
  sculpt(spheres, labels, ticks);
  return labels.take_counts();
}

}  // namespace terrace::tri::shape
