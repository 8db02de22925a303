// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <numeric>
#include <span>
#include <utility>

#include <terrace/base/parallel.hpp>
#include <terrace/base/stop_check.hpp>

#include "../pool.hpp"
#include "poles.hpp"

namespace terrace::tri::shape {
namespace {

constexpr std::size_t kForestBlock = std::size_t{1} << 14;
/// Number of iterations that memory is prefetched ahead.
constexpr std::size_t kAhead = 8;

/// A statement about two sets of tetrahedra. A facet states that its sides are alike, a vertex that
/// its poles differ.
struct Statement {
  /// The bits of the defect as a float (so that keys sort by rounded defect), then a bit that is
  /// set for a vertex.
  std::uint32_t key;
  std::uint32_t subject;  ///< the side or vertex that makes the statement
  /// The sets, by their roots. The second is doubled, plus 1 if the roots are said to be unlike.
  std::uint32_t one, other;

  /// The key and the subject.
  [[nodiscard]] std::uint64_t claim() const { return std::uint64_t{key} << 32 | subject; }
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
  /// In a part, only complete vertices have poles.
  PoleFinder(const Spheres& spheres, const Part& part) : spheres_(spheres), part_(part) {
    const std::vector<Place>& places = spheres.places();
    vertices_.resize(static_cast<std::uint32_t>(places.size()));
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      vertices_[v] = {places[v].at, {}, least(v)};
  }

  std::vector<Poles> find() {
    std::vector<Poles> poles(vertices_.size());
    {
      Pool<std::uint64_t> largest;
      largest.resize(vertices_.size());
      for (std::uint32_t v = 0; v < vertices_.size(); ++v) largest[v] = least(v);
      for_all([&](std::uint64_t sphere, std::uint32_t v) { keep_larger(largest[v], sphere); });
      for (std::uint32_t v = 1; v < poles.size(); ++v) {
        if (!is_sphere(largest[v])) continue;
        poles[v].first = tetrahedron_of(largest[v]);
        vertices_[v].to_first = spheres_.to_centre(poles[v].first, vertices_[v].at);
      }
    }
    add_hull(poles);
    for_all([&](std::uint64_t sphere, std::uint32_t v) {
      Vertex& vertex = vertices_[v];
      const Vector3 to_centre = spheres_.to_centre(tetrahedron_of(sphere), vertex.at);
      // Avoids a branch, which the processor could not predict.
      const auto is_opposite = static_cast<std::uint64_t>(dot(to_centre, vertex.to_first) < 0.0);
      keep_larger(vertex.largest, sphere & (0 - is_opposite));
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
  /// The data needed for every tetrahedron around a vertex, in one cache line.
  struct Vertex {
    Vector3 at, to_first;
    std::uint64_t largest;  ///< largest so far with its centre on the other side, see sphere_of()
  };

  // Spheres as numbers: the upper half of the squared radius, plus 2, followed by the tetrahedron's
  // number. kNoSphere is below all of them: no sphere yet. kRejectAll is above all of them: no
  // sphere, and none will be accepted.
  static constexpr std::uint64_t kNoSphere = std::uint64_t{1} << 32;
  static constexpr std::uint64_t kRejectAll = ~std::uint64_t{0};

  /// Returns the number of a sphere, or 0 if the tetrahedron is flat.
  [[nodiscard]] std::uint64_t sphere_of(std::uint32_t t) const {
    const double r2 = spheres_.radius2(t);
    if (std::isnan(r2)) return 0;
    return ((std::bit_cast<std::uint64_t>(r2) >> 32) + 2) << 32 | t;
  }
  static bool is_sphere(std::uint64_t sphere) { return sphere > kNoSphere && sphere != kRejectAll; }
  static std::uint32_t tetrahedron_of(std::uint64_t sphere) {
    return static_cast<std::uint32_t>(sphere);
  }
  [[nodiscard]] std::uint64_t least(std::uint32_t v) const {
    return part_.complete.empty() || part_.complete[v] != 0 ? kNoSphere : kRejectAll;
  }
  /// If two radii are equal, the sphere of the tetrahedron with the lexicographically first corners
  /// is the larger one.
  void keep_larger(std::uint64_t& best_so_far, std::uint64_t sphere) const {
    if (best_so_far >> 32 == sphere >> 32) [[unlikely]] {
      const std::uint32_t a = tetrahedron_of(best_so_far), b = tetrahedron_of(sphere);
      const double radius_a = spheres_.radius2(a), radius_b = spheres_.radius2(b);
      if (radius_a != radius_b ? radius_b > radius_a : spheres_.ranks_of(b) < spheres_.ranks_of(a))
        best_so_far = sphere;
    } else {
      best_so_far = std::max(best_so_far, sphere);
    }
  }
  /// Calls take(sphere, corner) for all corners of all finite tetrahedra.
  template <class Take>
  void for_all(const Take& take) const {
    const auto tetrahedra = spheres_.tetrahedra();
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
      if (!spheres_.finite(t)) continue;
      const std::uint64_t sphere = sphere_of(t);
      if (sphere == 0) continue;
      for (const std::uint32_t v : tetrahedra[t].corner) take(sphere, v);
    }
  }

  /// Sets the first pole of vertices on the hull, which is beyond it, in the direction of the sum
  /// of the outward normals around them.
  void add_hull(std::vector<Poles>& poles) {
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
                       [&](std::uint32_t v) { return least(v) == kNoSphere; }))
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
      if (n.vertex != previous) sum = {};
      previous = n.vertex;
      poles[n.vertex].first = spatial::kNone;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += n.normal[k];
    }
  }

  const Spheres& spheres_;
  const Part& part_;
  Pool<Vertex> vertices_;
};

/// Disjoint sets of tetrahedra, each known to be alike or unlike the root of its set. A node is the
/// number of a tetrahedron doubled, plus 1 for "unlike it".
class SignedSets {
 public:
  explicit SignedSets(std::uint32_t count) {
    parent_.resize(count);
    for (std::uint32_t x = 0; x < count; ++x) parent_[x] = 2 * x;
  }
  /// Makes x, a root, a child of the node `below`.
  void attach(std::uint32_t x, std::uint32_t below) { parent_[x] = below; }
  /// Makes x a root again if it has been hooked to a root that has been hooked to x. Must be called
  /// in ascending order, so that the smaller number stays the root. Roots are then in spatial
  /// order, as their tetrahedra are.
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
  /// The root of a node that has been flattened.
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
    SignedSets sets(outside_node_ + 1);
    join_tetrahedra(sets);
    ticks_.look();
    list_statements(sets);
    std::vector<std::uint32_t> first_roots;
    for (std::uint32_t x = 0; x <= outside_node_; ++x)
      if (sets.is_root(x)) first_roots.push_back(x);
    std::vector<std::uint32_t> roots = first_roots;
    while (list_.size() > 0) join_best(sets, roots);
    // The first roots come first because they are on the paths of all others.
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
  [[nodiscard]] std::uint32_t unlabelled() const {
    return part_.label.empty() ? outside_node_ : static_cast<std::uint32_t>(part_.unlabelled);
  }

  /// Writes the key of every facet of an unlabelled tetrahedron at both of its sides.
  void measure_facets() {
    const auto tetrahedra = spheres_.tetrahedra();
    const std::uint32_t count = unlabelled();
    keys_.resize(4 * count);
    const auto scratch = [] { return std::vector<spatial::Side>(); };
    base::parallel_blocks(
        count, kForestBlock, threads_, scratch,
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
            spheres_.prefetch(
                spatial::tetrahedron_of(mate_of(sides[std::min(f + kAhead, facets - 1)])));
            const spatial::Side mate = mate_of(sides[f]);
            const std::uint32_t key = key_of(spheres_.facet_defect(sides[f]), false);
            keys_[sides[f]] = key;
            if (spatial::tetrahedron_of(mate) < count) keys_[mate] = key;
          }
        });
  }

  /// Boruvka's first round, which needs no list: joins every tetrahedron with another one by the
  /// best statement about it.
  void join_tetrahedra(SignedSets& sets) {
    const std::uint32_t count = unlabelled();
    best_.resize(outside_node_ + 1);
    std::fill(best_.data(), best_.data() + count, kNoStatement);
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      if (poles_[v].second == spatial::kNone) continue;
      for (const std::uint32_t t : {poles_[v].first, poles_[v].second})
        if (t < count) keep_better(best_[t], key_of(poles_[v].defect, true), v);
    }
    for (std::uint32_t t = 0; t < outside_node_; ++t) {
      if (!spheres_.finite(t)) {
        sets.attach(t, 2 * outside_node_);
      } else if (t >= count) {
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
    for (std::uint32_t t = 0; t < count; ++t) sets.cut_pair(t);
    for (std::uint32_t t = 0; t < count; ++t) sets.flatten(t);
  }

  /// The other node of a claim about t. If the claim is about a facet, it names the side of t.
  [[nodiscard]] std::uint32_t partner(std::uint32_t t, std::uint64_t claim) const {
    const auto subject = static_cast<std::uint32_t>(claim);
    if (!of_vertex(claim))
      return 2 * spatial::tetrahedron_of(spheres_.tetrahedra()[t].mate[spatial::index_of(subject)]);
    const std::uint32_t other =
        poles_[subject].first == t ? poles_[subject].second : poles_[subject].first;
    return 2 * (other == spatial::kNone ? outside_node_ : other) + 1;
  }

  /// Lists all statements between two sets.
  void list_statements(const SignedSets& sets) {
    const auto tetrahedra = spheres_.tetrahedra();
    const std::uint32_t count = unlabelled();
    std::uint32_t listed = 0;
    const auto make_room_for = [&](std::uint32_t more) {
      if (listed + more > list_.size()) list_.resize(listed + listed / 8 + more);
    };
    const auto list = [&](std::uint32_t key, std::uint32_t subject, std::uint32_t one,
                          std::uint32_t other, bool is_new) {
      list_[listed] = {key, subject, one >> 1, other ^ (one & 1)};
      listed += static_cast<std::uint32_t>(is_new) & (one >> 1 != other >> 1);
    };
    make_room_for(count + count / 2);
    for (std::uint32_t t = 0; t < count; ++t) {
      ticks_(16);
      if (!spheres_.finite(t)) continue;
      make_room_for(4);
      const std::uint32_t one = sets.root(2 * t);
      for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
        const spatial::Side side = spatial::make_side(t, i), mate = tetrahedra[t].mate[i];
        list(keys_[side], side, one, sets.root(2 * spatial::tetrahedron_of(mate)),
             represents_facet(t, mate));
      }
    }
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      const Poles& poles = poles_[v];
      if (poles.second == spatial::kNone) continue;
      make_room_for(1);
      const std::uint32_t first = poles.first == spatial::kNone ? outside_node_ : poles.first;
      list(key_of(poles.defect, true), v, sets.root(2 * poles.second), sets.root(2 * first + 1),
           true);
    }
    list_.resize(listed);
    keys_.release();
  }

  void keep_better(std::uint64_t& best, std::uint32_t key, std::uint32_t subject) const {
    const std::uint64_t candidate = std::uint64_t{key} << 32 | subject;
    if (best >> 33 == candidate >> 33) [[unlikely]] {
      if (precedes(candidate, best)) best = candidate;
    } else {
      best = std::min(best, candidate);
    }
  }

  /// A further round of Boruvka's: joins every set with another by the best statement about it, and
  /// drops statements within one set.
  void join_best(SignedSets& sets, std::vector<std::uint32_t>& roots) {
    for (const std::uint32_t root : roots) best_[root] = kNoStatement;
    for (std::uint32_t i = 0; i < list_.size(); ++i) {
      ticks_(4);
      const Statement& s = list_[i];
      const std::uint64_t best = std::uint64_t{s.key >> 1} << 32 | i;
      for (std::uint64_t* best_so_far : {&best_[s.one], &best_[s.other >> 1]}) {
        if (*best_so_far >> 32 == best >> 32) [[unlikely]] {
          if (precedes(s.claim(), list_[static_cast<std::uint32_t>(*best_so_far)].claim()))
            *best_so_far = best;
        } else {
          *best_so_far = std::min(*best_so_far, best);
        }
      }
    }
    for (const std::uint32_t root : roots) {
      if (best_[root] == kNoStatement) continue;
      const Statement& s = list_[static_cast<std::uint32_t>(best_[root])];
      sets.attach(root, s.one == root ? s.other : 2 * s.one | (s.other & 1));
    }
    for (const std::uint32_t root : roots) sets.cut_pair(root);
    for (const std::uint32_t root : roots) sets.flatten(root);
    std::size_t count = 0;
    for (const std::uint32_t root : roots) {
      roots[count] = root;
      count += sets.is_root(root);
    }
    roots.resize(count);
    std::uint32_t listed = 0;
    for (const Statement& s : span_of(list_)) {
      const std::uint32_t one = sets.root(2 * s.one), other = sets.root(s.other);
      list_[listed] = {s.key, s.subject, one >> 1, other ^ (one & 1)};
      listed += one >> 1 != other >> 1;
    }
    list_.resize(listed);
  }

  /// Orders claims with the same rounded defect: by defect, then corners, with facets before
  /// vertices.
  [[nodiscard]] bool precedes(std::uint64_t a, std::uint64_t b) const {
    const double defect_a = defect_of(a), defect_b = defect_of(b);
    if (defect_a != defect_b) return defect_a < defect_b;
    return corners_of(a) < corners_of(b);
  }
  static bool of_vertex(std::uint64_t claim) { return (claim >> 32 & 1) != 0; }
  [[nodiscard]] double defect_of(std::uint64_t claim) const {
    const auto subject = static_cast<std::uint32_t>(claim);
    return of_vertex(claim) ? poles_[subject].defect : spheres_.facet_defect(subject);
  }
  [[nodiscard]] Ranks corners_of(std::uint64_t claim) const {
    constexpr std::uint32_t kNoCorner = 0xFFFFFFFFu;
    const auto subject = static_cast<std::uint32_t>(claim);
    if (!of_vertex(claim)) return spheres_.facet_ranks(subject);
    return {spheres_.places()[subject].rank, kNoCorner, kNoCorner, kNoCorner};
  }

  static constexpr std::uint64_t kNoStatement = ~std::uint64_t{0};

  const Spheres& spheres_;
  const base::StopCheck& check_stop_;
  base::StopTicks ticks_;
  unsigned threads_;
  const Part& part_;
  std::uint32_t outside_node_;
  std::vector<Poles> poles_;
  Pool<std::uint32_t> keys_;  ///< of facets, by side
  Pool<Statement> list_;
  /// By root: the rounded defect of the best statement about the set, followed by its number. In
  /// the first round its key, followed by a side or a vertex.
  Pool<std::uint64_t> best_;
};

}  // namespace

std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads, const Part& part,
                                        const base::StopCheck& check_stop) {
  return Forest(spheres, threads, part, check_stop).labels();
}

}  // namespace terrace::tri::shape
