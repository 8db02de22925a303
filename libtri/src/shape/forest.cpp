// SPDX-License-Identifier: Apache-2.0
// The first step of the poles rule (poles.hpp): a minimum spanning forest of signed edges, by
// Boruvka's algorithm.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

#include "../pool.hpp"
#include "poles.hpp"

namespace terrace::tri::shape {
namespace {

constexpr std::size_t kForestBlock = std::size_t{1} << 14;
/// Number of iterations that memory is prefetched ahead.
constexpr std::size_t kPrefetchDistance = 8;

/// A signed edge between two sets of tetrahedra. A facet says that its sides have the same label, a
/// vertex that its poles have different labels.
struct Edge {
  /// The defect as a float, shifted left by one; the lowest bit is 1 for a vertex. Keys sort by
  /// rounded defect.
  std::uint32_t key;
  std::uint32_t source;  ///< the facet, as one of its sides, or the vertex
  /// The roots of the two sets. b is twice the root, plus 1 if the roots should have different
  /// labels.
  std::uint32_t a, b;

  /// The key and the source.
  [[nodiscard]] std::uint64_t id() const { return std::uint64_t{key} << 32 | source; }
};

std::uint32_t key_of(double defect, bool of_vertex) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(defect));
  return bits << 1 | static_cast<std::uint32_t>(of_vertex);
}

struct Poles {
  std::uint32_t first = spatial::kNone;   ///< kNone: beyond the hull
  std::uint32_t second = spatial::kNone;  ///< kNone: does not exist
  double defect = 0.0;
};

/// Finds the poles of vertices, by vertex slot.
class PoleFinder {
 public:
  /// Only vertices whose tetrahedra are all in the part have poles.
  PoleFinder(const Spheres& spheres, const Part& part) : spheres_(spheres), part_(part) {
    const std::vector<Place>& places = spheres.places();
    vertices_.resize(static_cast<std::uint32_t>(places.size()));
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      vertices_[v] = {places[v].at, {}, initial_sphere(v)};
  }

  std::vector<Poles> find() {
    std::vector<Poles> poles(vertices_.size());
    {
      Pool<std::uint64_t> largest;
      largest.resize(vertices_.size());
      for (std::uint32_t v = 0; v < vertices_.size(); ++v) largest[v] = initial_sphere(v);
      for_each_corner(
          [&](std::uint64_t sphere_key, std::uint32_t v) { keep_larger(largest[v], sphere_key); });
      for (std::uint32_t v = 1; v < poles.size(); ++v) {
        if (!is_sphere(largest[v])) continue;
        poles[v].first = tetrahedron_of(largest[v]);
        vertices_[v].to_first = spheres_.to_centre(poles[v].first, vertices_[v].at);
      }
    }
    set_hull_poles(poles);
    for_each_corner([&](std::uint64_t sphere_key, std::uint32_t v) {
      Vertex& vertex = vertices_[v];
      const Vector3 to_centre = spheres_.to_centre(tetrahedron_of(sphere_key), vertex.at);
      // Avoids a branch, which the processor could not predict.
      const auto is_opposite = static_cast<std::uint64_t>(dot(to_centre, vertex.to_first) < 0.0);
      keep_larger(vertex.largest, sphere_key & (0 - is_opposite));
    });
    for (std::uint32_t v = 1; v < poles.size(); ++v) {
      const Vertex& vertex = vertices_[v];
      if (!is_sphere(vertex.largest)) continue;
      poles[v].second = tetrahedron_of(vertex.largest);
      Vector3 to_second = spheres_.to_centre(poles[v].second, vertex.at);
      for (double& c : to_second) c = -c;
      poles[v].defect = kPoleWeight * defect_between(vertex.to_first, to_second);
    }
    return poles;
  }

 private:
  /// The data needed for every tetrahedron around a vertex. Fits into one cache line.
  struct Vertex {
    Vector3 at, to_first;
    /// Key of the largest sphere on the opposite side so far, see sphere_key_of().
    std::uint64_t largest;
  };
  static_assert(sizeof(Vertex) <= 64);

  // Keys of spheres: the upper half of the squared radius, plus 2, followed by the tetrahedron's
  // number.

  /// No sphere yet. Below all keys.
  static constexpr std::uint64_t kNoSphere = std::uint64_t{1} << 32;
  /// No sphere, and none will be accepted. Above all keys.
  static constexpr std::uint64_t kRejectAll = ~std::uint64_t{0};

  /// Returns the key of a circumsphere, or 0 if the tetrahedron is flat.
  [[nodiscard]] std::uint64_t sphere_key_of(std::uint32_t t) const {
    const double r2 = spheres_.radius2(t);
    if (std::isnan(r2)) return 0;
    return ((std::bit_cast<std::uint64_t>(r2) >> 32) + 2) << 32 | t;
  }
  static bool is_sphere(std::uint64_t sphere_key) {
    return sphere_key > kNoSphere && sphere_key != kRejectAll;
  }
  static std::uint32_t tetrahedron_of(std::uint64_t sphere_key) {
    return static_cast<std::uint32_t>(sphere_key);
  }
  [[nodiscard]] std::uint64_t initial_sphere(std::uint32_t v) const {
    return part_.complete.empty() || part_.complete[v] != 0 ? kNoSphere : kRejectAll;
  }
  /// Replaces the best sphere if this one is larger. Of equal radii, the tetrahedron with the
  /// lexicographically first corners wins.
  void keep_larger(std::uint64_t& best_so_far, std::uint64_t sphere_key) const {
    if (best_so_far >> 32 == sphere_key >> 32) [[unlikely]] {
      const std::uint32_t a = tetrahedron_of(best_so_far), b = tetrahedron_of(sphere_key);
      const double radius_a = spheres_.radius2(a), radius_b = spheres_.radius2(b);
      if (radius_a != radius_b ? radius_b > radius_a : spheres_.ranks_of(b) < spheres_.ranks_of(a))
        best_so_far = sphere_key;
    } else {
      best_so_far = std::max(best_so_far, sphere_key);
    }
  }
  /// Calls take(sphere key, corner) for all corners of all finite tetrahedra.
  template <class Take>
  void for_each_corner(const Take& take) const {
    const auto tetrahedra = spheres_.tetrahedra();
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
      if (!spheres_.finite(t)) continue;
      const std::uint64_t sphere_key = sphere_key_of(t);
      if (sphere_key == 0) continue;
      for (const std::uint32_t v : tetrahedra[t].corner) take(sphere_key, v);
    }
  }

  /// Sets the first pole of hull vertices to the outside, in the direction of the sum of the
  /// adjacent outward normals.
  void set_hull_poles(std::vector<Poles>& poles) {
    struct Normal {
      std::uint32_t vertex;
      Ranks facet;
      Vector3 normal;
    };
    std::vector<Normal> normals;
    const auto tetrahedra = spheres_.tetrahedra();
    for (const spatial::Tetrahedron& ghost : tetrahedra) {
      if (!spatial::is_ghost(ghost.corner)) continue;
      const std::uint32_t i = spatial::ghost_index(ghost.corner);
      const auto facet = spatial::facet_of(ghost, i);
      if (std::none_of(facet.begin(), facet.end(),
                       [&](std::uint32_t v) { return initial_sphere(v) == kNoSphere; }))
        continue;
      const spatial::Side side = ghost.mate[i];
      const Vector3 normal = spheres_.hull_normal(side);
      for (const std::uint32_t v : facet)
        normals.push_back({v, spheres_.facet_ranks(side), normal});
    }
    std::sort(normals.begin(), normals.end(), [](const Normal& a, const Normal& b) {
      return a.vertex != b.vertex ? a.vertex < b.vertex : a.facet < b.facet;
    });
    std::uint32_t previous = spatial::kNone;
    for (const Normal& n : normals) {
      Vector3& sum = vertices_[n.vertex].to_first;
      if (n.vertex != previous) {
        sum = {};
        poles[n.vertex].first = spatial::kNone;
      }
      previous = n.vertex;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += n.normal[k];
    }
  }

  const Spheres& spheres_;
  const Part& part_;
  Pool<Vertex> vertices_;
};

/// Disjoint sets of tetrahedra that know whether each one has the same label as the root of its
/// set. A node is the number of a tetrahedron doubled, plus 1 for the opposite label.
class SignedUnionFind {
 public:
  explicit SignedUnionFind(std::uint32_t count) {
    parent_.resize(count);
    for (std::uint32_t x = 0; x < count; ++x) parent_[x] = 2 * x;
  }
  /// Makes x, a root, a child of the node `parent`.
  void attach(std::uint32_t x, std::uint32_t parent) { parent_[x] = parent; }
  /// Makes x a root again if x and its parent are each other's parents. Must be called in ascending
  /// order, so that the smaller number stays the root. Roots are then in spatial order, as their
  /// tetrahedra are.
  void cut_pair(std::uint32_t x) {
    if (parent_[parent_[x] >> 1] >> 1 == x) parent_[x] = 2 * x;
  }
  [[nodiscard]] bool is_root(std::uint32_t x) const { return parent_[x] == 2 * x; }
  /// Makes x a child of the root of its set.
  void flatten(std::uint32_t x) {
    for (std::uint32_t up = parent_[x];;) {
      const std::uint32_t next = parent_[up >> 1] ^ (up & 1);
      parent_[x] = next;
      if (next == up) return;
      up = next;
    }
  }
  /// Returns the root of a flattened node, with its sign.
  [[nodiscard]] std::uint32_t root(std::uint32_t node) const {
    return parent_[node >> 1] ^ (node & 1);
  }

 private:
  Pool<std::uint32_t> parent_;
};

class Forest {
 public:
  Forest(const Spheres& spheres, unsigned threads, const Part& part,
         const base::StopCheck& check_stop)
      : spheres_(spheres),
        check_stop_(check_stop),
        ticks_(check_stop),
        threads_(threads),
        part_(part),
        outside_node_(static_cast<std::uint32_t>(spheres.tetrahedra().size())) {}

  std::vector<std::uint8_t> labels() {
    poles_ = PoleFinder(spheres_, part_).find();
    ticks_.look();
    measure_facets();
    SignedUnionFind sets(outside_node_ + 1);
    join_tetrahedra(sets);
    ticks_.look();
    collect_edges(sets);
    std::vector<std::uint32_t> first_roots;
    for (std::uint32_t x = 0; x <= outside_node_; ++x)
      if (sets.is_root(x)) first_roots.push_back(x);
    std::vector<std::uint32_t> roots = first_roots;
    while (edges_.size() > 0) join_best(sets, roots);
    // Flatten the first roots first, because all paths pass through them.
    for (const std::uint32_t x : first_roots) sets.flatten(x);
    for (std::uint32_t x = 0; x <= outside_node_; ++x) sets.flatten(x);
    const std::uint32_t outside = sets.root(2 * outside_node_);
    std::vector<std::uint8_t> inside(outside_node_);
    for (std::uint32_t t = 0; t < outside_node_; ++t)
      inside[t] = static_cast<std::uint8_t>((sets.root(2 * t) ^ outside) & 1);
    return inside;
  }

 private:
  /// True if this side of a finite tetrahedron represents its facet, so that each facet is counted
  /// once.
  [[nodiscard]] bool represents_facet(std::uint32_t t, spatial::Side mate) const {
    const std::uint32_t other = spatial::tetrahedron_of(mate);
    return (t < other) | !spheres_.finite(other);
  }
  [[nodiscard]] std::uint32_t unlabelled_count() const {
    return part_.label.empty() ? outside_node_ : static_cast<std::uint32_t>(part_.unlabelled);
  }

  /// Writes the key of every facet of an unlabelled tetrahedron at both of its sides.
  void measure_facets() {
    const auto tetrahedra = spheres_.tetrahedra();
    const std::uint32_t unlabelled = unlabelled_count();
    keys_.resize(4 * unlabelled);
    const auto scratch = [] { return std::vector<spatial::Side>(); };
    base::parallel_blocks(
        unlabelled, kForestBlock, threads_, scratch,
        [&](std::size_t begin, std::size_t end, std::vector<spatial::Side>& sides) {
          if (check_stop_) check_stop_();
          // Lists the facets first, so that the branch is not mixed with the arithmetic.
          sides.resize(4 * (end - begin));
          std::size_t facets = 0;
          for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
            if (!spheres_.finite(t)) continue;
            for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
              sides[facets] = spatial::make_side(t, i);
              facets += represents_facet(t, tetrahedra[t].mate[i]);
            }
          }
          const auto mate_of = [&](spatial::Side side) {
            return tetrahedra[spatial::tetrahedron_of(side)].mate[spatial::index_of(side)];
          };
          for (std::size_t f = 0; f < facets; ++f) {
            // Neighbours may be anywhere in memory.
            spheres_.prefetch(spatial::tetrahedron_of(
                mate_of(sides[std::min(f + kPrefetchDistance, facets - 1)])));
            const spatial::Side mate = mate_of(sides[f]);
            const std::uint32_t key = key_of(spheres_.facet_defect(sides[f]), false);
            keys_[sides[f]] = key;
            if (spatial::tetrahedron_of(mate) < unlabelled) keys_[mate] = key;
          }
        });
  }

  /// Boruvka's first round, which needs no list of edges: joins every tetrahedron with another one
  /// by its best edge.
  void join_tetrahedra(SignedUnionFind& sets) {
    const std::uint32_t unlabelled = unlabelled_count();
    best_.resize(outside_node_ + 1);
    std::fill(best_.data(), best_.data() + unlabelled, kNoEdge);
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      if (poles_[v].second == spatial::kNone) continue;
      for (const std::uint32_t t : {poles_[v].first, poles_[v].second})
        if (t < unlabelled) keep_better(best_[t], key_of(poles_[v].defect, true), v);
    }
    for (std::uint32_t t = 0; t < outside_node_; ++t) {
      if (!spheres_.finite(t)) {
        sets.attach(t, 2 * outside_node_);
      } else if (t >= unlabelled) {
        sets.attach(t, 2 * outside_node_ + (part_.label[t] == 2));
      } else {
        std::uint64_t best = best_[t];
        for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
          const spatial::Side side = spatial::make_side(t, i);
          keep_better(best, keys_[side], side);
        }
        sets.attach(t, partner(t, best));
      }
    }
    for (std::uint32_t t = 0; t < unlabelled; ++t) sets.cut_pair(t);
    for (std::uint32_t t = 0; t < unlabelled; ++t) sets.flatten(t);
  }

  /// Returns the node that an edge of t joins to t. id: of a facet, given by the side of t, or of a
  /// vertex.
  [[nodiscard]] std::uint32_t partner(std::uint32_t t, std::uint64_t id) const {
    const auto source = static_cast<std::uint32_t>(id);
    if (!of_vertex(id))
      return 2 * spatial::tetrahedron_of(spheres_.tetrahedra()[t].mate[spatial::index_of(source)]);
    const std::uint32_t other =
        poles_[source].first == t ? poles_[source].second : poles_[source].first;
    return 2 * (other == spatial::kNone ? outside_node_ : other) + 1;
  }

  /// Collects all edges between two sets.
  void collect_edges(const SignedUnionFind& sets) {
    const auto tetrahedra = spheres_.tetrahedra();
    const std::uint32_t unlabelled = unlabelled_count();
    std::uint32_t edge_count = 0;
    const auto make_room_for = [&](std::uint32_t more) {
      if (edge_count + more > edges_.size()) edges_.resize(edge_count + edge_count / 8 + more);
    };
    const auto append = [&](std::uint32_t key, std::uint32_t source, std::uint32_t a,
                            std::uint32_t b, bool is_new) {
      edges_[edge_count] = {key, source, a >> 1, b ^ (a & 1)};
      edge_count += static_cast<std::uint32_t>(is_new) & (a >> 1 != b >> 1);
    };
    make_room_for(unlabelled + unlabelled / 2);
    for (std::uint32_t t = 0; t < unlabelled; ++t) {
      ticks_(16);
      if (!spheres_.finite(t)) continue;
      make_room_for(4);
      const std::uint32_t a = sets.root(2 * t);
      for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
        const spatial::Side side = spatial::make_side(t, i), mate = tetrahedra[t].mate[i];
        append(keys_[side], side, a, sets.root(2 * spatial::tetrahedron_of(mate)),
               represents_facet(t, mate));
      }
    }
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      const Poles& poles = poles_[v];
      if (poles.second == spatial::kNone) continue;
      make_room_for(1);
      const std::uint32_t first = poles.first == spatial::kNone ? outside_node_ : poles.first;
      append(key_of(poles.defect, true), v, sets.root(2 * poles.second), sets.root(2 * first + 1),
             true);
    }
    edges_.resize(edge_count);
    keys_.release();
  }

  void keep_better(std::uint64_t& best, std::uint32_t key, std::uint32_t source) const {
    const std::uint64_t candidate = std::uint64_t{key} << 32 | source;
    if (best >> 33 == candidate >> 33) [[unlikely]] {
      if (precedes(candidate, best)) best = candidate;
    } else {
      best = std::min(best, candidate);
    }
  }

  /// A further round of Boruvka's algorithm: joins every set with another by its best edge, and
  /// drops edges within one set.
  void join_best(SignedUnionFind& sets, std::vector<std::uint32_t>& roots) {
    for (const std::uint32_t root : roots) best_[root] = kNoEdge;
    for (std::uint32_t i = 0; i < edges_.size(); ++i) {
      ticks_(4);
      const Edge& edge = edges_[i];
      const std::uint64_t best = std::uint64_t{edge.key >> 1} << 32 | i;
      for (std::uint64_t* best_of_root : {&best_[edge.a], &best_[edge.b >> 1]}) {
        if (*best_of_root >> 32 == best >> 32) [[unlikely]] {
          if (precedes(edge.id(), edges_[static_cast<std::uint32_t>(*best_of_root)].id()))
            *best_of_root = best;
        } else {
          *best_of_root = std::min(*best_of_root, best);
        }
      }
    }
    for (const std::uint32_t root : roots) {
      if (best_[root] == kNoEdge) continue;
      const Edge& edge = edges_[static_cast<std::uint32_t>(best_[root])];
      sets.attach(root, edge.a == root ? edge.b : 2 * edge.a | (edge.b & 1));
    }
    for (const std::uint32_t root : roots) sets.cut_pair(root);
    for (const std::uint32_t root : roots) sets.flatten(root);
    std::size_t count = 0;
    for (const std::uint32_t root : roots) {
      roots[count] = root;
      count += sets.is_root(root);
    }
    roots.resize(count);
    std::uint32_t edge_count = 0;
    for (const Edge& edge : span_of(edges_)) {
      const std::uint32_t a = sets.root(2 * edge.a), b = sets.root(edge.b);
      edges_[edge_count] = {edge.key, edge.source, a >> 1, b ^ (a & 1)};
      edge_count += a >> 1 != b >> 1;
    }
    edges_.resize(edge_count);
  }

  /// Orders edges with the same rounded defect: by defect, then corners, with facets before
  /// vertices.
  [[nodiscard]] bool precedes(std::uint64_t a, std::uint64_t b) const {
    const double defect_a = defect_of(a), defect_b = defect_of(b);
    if (defect_a != defect_b) return defect_a < defect_b;
    return corners_of(a) < corners_of(b);
  }
  static bool of_vertex(std::uint64_t id) { return (id >> 32 & 1) != 0; }
  [[nodiscard]] double defect_of(std::uint64_t id) const {
    const auto source = static_cast<std::uint32_t>(id);
    return of_vertex(id) ? poles_[source].defect : spheres_.facet_defect(source);
  }
  [[nodiscard]] Ranks corners_of(std::uint64_t id) const {
    constexpr std::uint32_t kNoCorner = 0xFFFFFFFFu;
    const auto source = static_cast<std::uint32_t>(id);
    if (!of_vertex(id)) return spheres_.facet_ranks(source);
    return {spheres_.places()[source].rank, kNoCorner, kNoCorner, kNoCorner};
  }

  static constexpr std::uint64_t kNoEdge = ~std::uint64_t{0};

  const Spheres& spheres_;
  const base::StopCheck& check_stop_;
  base::StopTicks ticks_;
  unsigned threads_;
  const Part& part_;
  std::uint32_t outside_node_;
  std::vector<Poles> poles_;
  Pool<std::uint32_t> keys_;  ///< keys of facets, by side
  Pool<Edge> edges_;
  /// By root: the rounded defect of the best edge of the set, followed by its index in edges_. In
  /// the first round its id.
  Pool<std::uint64_t> best_;
};

}  // namespace

std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads, const Part& part,
                                        const base::StopCheck& check_stop) {
  return Forest(spheres, threads, part, check_stop).labels();
}

}  // namespace terrace::tri::shape
