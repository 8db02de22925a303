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
/// So many turns ahead memory is asked for.
constexpr std::size_t kAhead = 8;

/// A statement about two sets of tetrahedra: across a facet that they are alike, at a vertex that
/// its poles differ.
struct Statement {
  /// The bits of the defect as a float (so in order of size, rounded), then whether of a vertex.
  std::uint32_t key;
  std::uint32_t what;  ///< a side or a vertex
  /// The sets, by their roots; the second doubled, plus 1 if the roots are said to be unlike.
  std::uint32_t one, other;

  /// Key and what it is about.
  [[nodiscard]] std::uint64_t claim() const { return std::uint64_t{key} << 32 | what; }
};

std::uint32_t key_of(double defect, bool of_vertex) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(defect));
  return bits << 1 | static_cast<std::uint32_t>(of_vertex);
}

struct Poles {
  std::uint32_t first = spatial::kNone;   ///< kNone: beyond the hull
  std::uint32_t second = spatial::kNone;  ///< kNone: there is none
  double defect = 0.0;
};

/// Poles by vertex slot.
class PoleFinder {
 public:
  /// In a part only whole vertices have poles.
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
      for_all([&](std::uint64_t sphere, std::uint32_t v) { take_larger(largest[v], sphere); });
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
      // Without a branch, which the processor could not predict.
      const auto admitted = static_cast<std::uint64_t>(dot(to_centre, vertex.to_first) < 0.0);
      take_larger(vertex.largest, sphere & (0 - admitted));
    });
    for (std::uint32_t v = 1; v < poles.size(); ++v) {
      const Vertex& vertex = vertices_[v];
      if (!is_sphere(vertex.largest)) continue;
      poles[v].second = tetrahedron_of(vertex.largest);
      Vector3 back = spheres_.to_centre(poles[v].second, vertex.at);
      for (double& c : back) c = -c;
      poles[v].defect = kPoleWeight * defect_between(vertex.to_first, back);
    }
    return poles;
  }

 private:
  /// What is looked at for every tetrahedron around a vertex, in one cache line.
  struct Vertex {
    Vector3 at, to_first;
    std::uint64_t largest;  ///< sphere so far whose centre is on the other side, see sphere_of()
  };

  // Spheres as numbers: the upper half of the squared radius, plus 2, above the tetrahedron's
  // number. Below them: none. Above them: none, and none will be taken.
  static constexpr std::uint64_t kNoSphere = std::uint64_t{1} << 32;
  static constexpr std::uint64_t kNeverAny = ~std::uint64_t{0};

  /// 0 if flat.
  [[nodiscard]] std::uint64_t sphere_of(std::uint32_t t) const {
    const double r2 = spheres_.radius2(t);
    if (std::isnan(r2)) return 0;
    return ((std::bit_cast<std::uint64_t>(r2) >> 32) + 2) << 32 | t;
  }
  static bool is_sphere(std::uint64_t sphere) { return sphere > kNoSphere && sphere != kNeverAny; }
  static std::uint32_t tetrahedron_of(std::uint64_t sphere) {
    return static_cast<std::uint32_t>(sphere);
  }
  [[nodiscard]] std::uint64_t least(std::uint32_t v) const {
    return part_.whole.empty() || part_.whole[v] != 0 ? kNoSphere : kNeverAny;
  }
  /// Where two radii are equal, the larger sphere is that of the tetrahedron with the
  /// lexicographically first corners.
  void take_larger(std::uint64_t& held, std::uint64_t sphere) const {
    if (held >> 32 == sphere >> 32) [[unlikely]] {
      const std::uint32_t a = tetrahedron_of(held), b = tetrahedron_of(sphere);
      const double radius_a = spheres_.radius2(a), radius_b = spheres_.radius2(b);
      if (radius_a != radius_b ? radius_b > radius_a : spheres_.ranks_of(b) < spheres_.ranks_of(a))
        held = sphere;
    } else {
      held = std::max(held, sphere);
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

  /// Vertices on the hull have their first pole beyond it, in the direction of the sum of the
  /// outward normals around them.
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
    std::uint32_t before = spatial::kNone;
    for (const Normal& n : normals) {
      Vector3& sum = vertices_[n.vertex].to_first;
      if (n.vertex != before) sum = {};
      before = n.vertex;
      poles[n.vertex].first = spatial::kNone;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += n.normal[k];
    }
  }

  const Spheres& spheres_;
  const Part& part_;
  Pool<Vertex> vertices_;
};

/// Disjoint sets of tetrahedra, each known to be alike or unlike its set's root. Nodes are given
/// doubled, plus 1 if what is meant is unlike them.
class SignedSets {
 public:
  explicit SignedSets(std::uint32_t count) {
    up_.resize(count);
    for (std::uint32_t x = 0; x < count; ++x) up_[x] = 2 * x;
  }
  /// Makes x, a root, a child.
  void hook(std::uint32_t x, std::uint32_t below) { up_[x] = below; }
  /// Makes x a root again if it has been hooked to a root that has been hooked to x. To be called
  /// in ascending order, so that the smaller number stays the root: roots are in spatial order
  /// then, as their tetrahedra are.
  void cut_pair(std::uint32_t x) {
    if (up_[up_[x] >> 1] >> 1 == x) up_[x] = 2 * x;
  }
  [[nodiscard]] bool is_root(std::uint32_t x) const { return up_[x] == 2 * x; }
  /// Makes x a child of its set's root.
  void flatten(std::uint32_t x) {
    for (std::uint32_t up = up_[x];;) {
      const std::uint32_t next = up_[up >> 1] ^ (up & 1);
      up_[x] = next;
      if (next == up) return;
      up = next;
    }
  }
  /// The root of a node that has been flattened.
  [[nodiscard]] std::uint32_t root(std::uint32_t node) const { return up_[node >> 1] ^ (node & 1); }

 private:
  Pool<std::uint32_t> up_;
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
        beyond_(static_cast<std::uint32_t>(spheres.tetrahedra().size())) {}

  std::vector<std::uint8_t> labels() {
    poles_ = PoleFinder(spheres_, part_).find();
    ticks_.look();
    measure_facets();
    SignedSets sets(beyond_ + 1);
    join_tetrahedra(sets);
    ticks_.look();
    list_statements(sets);
    std::vector<std::uint32_t> first_roots;
    for (std::uint32_t x = 0; x <= beyond_; ++x)
      if (sets.is_root(x)) first_roots.push_back(x);
    std::vector<std::uint32_t> roots = first_roots;
    while (list_.size() > 0) join_best(sets, roots);
    // These first, as they are on the way of all others.
    for (const std::uint32_t x : first_roots) sets.flatten(x);
    for (std::uint32_t x = 0; x <= beyond_; ++x) sets.flatten(x);
    const std::uint32_t outside = sets.root(2 * beyond_);
    std::vector<std::uint8_t> inside(beyond_);
    for (std::uint32_t t = 0; t < beyond_; ++t)
      inside[t] = static_cast<std::uint8_t>((sets.root(2 * t) ^ outside) & 1);
    return inside;
  }

 private:
  /// Whether this side of a finite tetrahedron stands for its facet, about which it says something
  /// new.
  [[nodiscard]] bool stands(std::uint32_t t, spatial::Side mate) const {
    const std::uint32_t other = spatial::tetrahedron_of(mate);
    return (t < other) | !spheres_.finite(other);
  }
  [[nodiscard]] std::uint32_t unlabelled() const {
    return part_.label.empty() ? beyond_ : static_cast<std::uint32_t>(part_.unlabelled);
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
          // First the facets alone, so that the branch is not mixed with the arithmetic.
          sides.resize(4 * (end - begin));
          std::size_t facets = 0;
          for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
            if (!spheres_.finite(t)) continue;
            for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
              sides[facets] = spatial::make_side(t, i);
              facets += stands(t, tetrahedra[t].mate[i]);
            }
          }
          const auto mate_of = [&](spatial::Side side) {
            return tetrahedra[spatial::tetrahedron_of(side)].mate[spatial::index_of(side)];
          };
          for (std::size_t f = 0; f < facets; ++f) {
            // Neighbours lie anywhere.
            spheres_.prefetch(
                spatial::tetrahedron_of(mate_of(sides[std::min(f + kAhead, facets - 1)])));
            const spatial::Side mate = mate_of(sides[f]);
            const std::uint32_t key = key_of(spheres_.facet_defect(sides[f]), false);
            keys_[sides[f]] = key;
            if (spatial::tetrahedron_of(mate) < count) keys_[mate] = key;
          }
        });
  }

  /// Boruvka's first round, before there is a list: every tetrahedron is joined with another by the
  /// best statement about it.
  void join_tetrahedra(SignedSets& sets) {
    const std::uint32_t count = unlabelled();
    best_.resize(beyond_ + 1);
    std::fill(best_.data(), best_.data() + count, kNoBest);
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      if (poles_[v].second == spatial::kNone) continue;
      for (const std::uint32_t t : {poles_[v].first, poles_[v].second})
        if (t < count) take_better(best_[t], key_of(poles_[v].defect, true), v);
    }
    for (std::uint32_t t = 0; t < beyond_; ++t) {
      if (!spheres_.finite(t)) {
        sets.hook(t, 2 * beyond_);
      } else if (t >= count) {
        sets.hook(t, 2 * beyond_ + (part_.label[t] == 2));
      } else {
        std::uint64_t best = best_[t];
        for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
          const spatial::Side side = spatial::make_side(t, i);
          take_better(best, keys_[side], side);
        }
        sets.hook(t, partner(t, best));
      }
    }
    for (std::uint32_t t = 0; t < count; ++t) sets.cut_pair(t);
    for (std::uint32_t t = 0; t < count; ++t) sets.flatten(t);
  }

  /// The other node of a claim about t, whose side it names if it is of a facet.
  [[nodiscard]] std::uint32_t partner(std::uint32_t t, std::uint64_t claim) const {
    const auto what = static_cast<std::uint32_t>(claim);
    if (!of_vertex(claim))
      return 2 * spatial::tetrahedron_of(spheres_.tetrahedra()[t].mate[spatial::index_of(what)]);
    const std::uint32_t other = poles_[what].first == t ? poles_[what].second : poles_[what].first;
    return 2 * (other == spatial::kNone ? beyond_ : other) + 1;
  }

  /// Lists all statements between two sets.
  void list_statements(const SignedSets& sets) {
    const auto tetrahedra = spheres_.tetrahedra();
    const std::uint32_t count = unlabelled();
    std::uint32_t left = 0;
    const auto has_room_for_more = [&](std::uint32_t more) {
      if (left + more > list_.size()) list_.resize(left + left / 8 + more);
    };
    const auto list = [&](std::uint32_t key, std::uint32_t what, std::uint32_t one,
                          std::uint32_t other, bool new_one) {
      list_[left] = {key, what, one >> 1, other ^ (one & 1)};
      left += static_cast<std::uint32_t>(new_one) & (one >> 1 != other >> 1);
    };
    has_room_for_more(count + count / 2);
    for (std::uint32_t t = 0; t < count; ++t) {
      ticks_(16);
      if (!spheres_.finite(t)) continue;
      has_room_for_more(4);
      const std::uint32_t one = sets.root(2 * t);
      for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
        const spatial::Side side = spatial::make_side(t, i), mate = tetrahedra[t].mate[i];
        list(keys_[side], side, one, sets.root(2 * spatial::tetrahedron_of(mate)), stands(t, mate));
      }
    }
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      const Poles& poles = poles_[v];
      if (poles.second == spatial::kNone) continue;
      has_room_for_more(1);
      const std::uint32_t first = poles.first == spatial::kNone ? beyond_ : poles.first;
      list(key_of(poles.defect, true), v, sets.root(2 * poles.second), sets.root(2 * first + 1),
           true);
    }
    list_.resize(left);
    keys_.release();
  }

  void take_better(std::uint64_t& best, std::uint32_t key, std::uint32_t what) const {
    const std::uint64_t candidate = std::uint64_t{key} << 32 | what;
    if (best >> 33 == candidate >> 33) [[unlikely]] {
      if (before(candidate, best)) best = candidate;
    } else {
      best = std::min(best, candidate);
    }
  }

  /// One of Boruvka's rounds: every set is joined with another by the best statement about it, and
  /// statements within one set are dropped.
  void join_best(SignedSets& sets, std::vector<std::uint32_t>& roots) {
    for (const std::uint32_t root : roots) best_[root] = kNoBest;
    for (std::uint32_t i = 0; i < list_.size(); ++i) {
      ticks_(4);
      const Statement& s = list_[i];
      const std::uint64_t best = std::uint64_t{s.key >> 1} << 32 | i;
      for (std::uint64_t* held : {&best_[s.one], &best_[s.other >> 1]}) {
        if (*held >> 32 == best >> 32) [[unlikely]] {
          if (before(s.claim(), list_[static_cast<std::uint32_t>(*held)].claim())) *held = best;
        } else {
          *held = std::min(*held, best);
        }
      }
    }
    for (const std::uint32_t root : roots) {
      if (best_[root] == kNoBest) continue;
      const Statement& s = list_[static_cast<std::uint32_t>(best_[root])];
      sets.hook(root, s.one == root ? s.other : 2 * s.one | (s.other & 1));
    }
    for (const std::uint32_t root : roots) sets.cut_pair(root);
    for (const std::uint32_t root : roots) sets.flatten(root);
    std::size_t count = 0;
    for (const std::uint32_t root : roots) {
      roots[count] = root;
      count += sets.is_root(root);
    }
    roots.resize(count);
    std::uint32_t left = 0;
    for (const Statement& s : span_of(list_)) {
      const std::uint32_t one = sets.root(2 * s.one), other = sets.root(s.other);
      list_[left] = {s.key, s.what, one >> 1, other ^ (one & 1)};
      left += one >> 1 != other >> 1;
    }
    list_.resize(left);
  }

  /// Decides between claims with the same defect when rounded: by defect, corners, facets first.
  [[nodiscard]] bool before(std::uint64_t a, std::uint64_t b) const {
    const double defect_a = defect_of(a), defect_b = defect_of(b);
    if (defect_a != defect_b) return defect_a < defect_b;
    return corners_of(a) < corners_of(b);
  }
  static bool of_vertex(std::uint64_t claim) { return (claim >> 32 & 1) != 0; }
  [[nodiscard]] double defect_of(std::uint64_t claim) const {
    const auto what = static_cast<std::uint32_t>(claim);
    return of_vertex(claim) ? poles_[what].defect : spheres_.facet_defect(what);
  }
  [[nodiscard]] Ranks corners_of(std::uint64_t claim) const {
    constexpr std::uint32_t kNoCorner = 0xFFFFFFFFu;
    const auto what = static_cast<std::uint32_t>(claim);
    if (!of_vertex(claim)) return spheres_.facet_ranks(what);
    return {spheres_.places()[what].rank, kNoCorner, kNoCorner, kNoCorner};
  }

  static constexpr std::uint64_t kNoBest = ~std::uint64_t{0};

  const Spheres& spheres_;
  const base::StopCheck& check_stop_;
  base::StopTicks ticks_;
  unsigned threads_;
  const Part& part_;
  std::uint32_t beyond_;
  std::vector<Poles> poles_;
  Pool<std::uint32_t> keys_;  ///< of facets, by side
  Pool<Statement> list_;
  /// By root: the rounded defect of the best statement about the set, above its number; in the
  /// first round its key, above a side or a vertex.
  Pool<std::uint64_t> best_;
};

}  // namespace

std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads, const Part& part,
                                        const base::StopCheck& check_stop) {
  return Forest(spheres, threads, part, check_stop).labels();
}

}  // namespace terrace::tri::shape
