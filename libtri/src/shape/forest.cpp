// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <numeric>
#include <span>
#include <utility>

#include "../for_blocks.hpp"
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

  [[nodiscard]] bool of_vertex() const { return (key & 1) != 0; }
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
      vertices_[v] = {places[v].at, {}, least(v), spatial::kNone};
  }

  std::vector<Poles> find() {
    take_largest([](const Vertex&, const Vector3&) { return true; });
    std::vector<Poles> poles(vertices_.size());
    for (std::uint32_t v = 1; v < poles.size(); ++v) {
      Vertex& vertex = vertices_[v];
      poles[v].first = vertex.tetrahedron;
      if (vertex.tetrahedron != spatial::kNone)
        vertex.to_first = spheres_.to_centre(vertex.tetrahedron, vertex.at);
      vertex.radius2 = least(v);
      vertex.tetrahedron = spatial::kNone;
    }
    add_hull(poles);
    take_largest([](const Vertex& vertex, const Vector3& to_centre) {
      return dot(to_centre, vertex.to_first) < 0.0;
    });
    for (std::uint32_t v = 1; v < poles.size(); ++v) {
      const Vertex& vertex = vertices_[v];
      poles[v].second = vertex.tetrahedron;
      if (vertex.tetrahedron == spatial::kNone) continue;
      Vector3 back = spheres_.to_centre(vertex.tetrahedron, vertex.at);
      for (double& c : back) c = -c;
      poles[v].defect = kPoleWeight * defect_between(vertex.to_first, back);
    }
    return poles;
  }

 private:
  /// What is looked at for every tetrahedron around a vertex, in one cache line.
  struct Vertex {
    Vector3 at, to_first;
    double radius2;  ///< the largest so far, of the tetrahedron behind
    std::uint32_t tetrahedron;
  };
  /// No radius is larger than that of a vertex without poles.
  [[nodiscard]] double least(std::uint32_t v) const {
    return part_.whole.empty() || part_.whole[v] != 0 ? -1.0 : HUGE_VAL;
  }
  /// Finds the largest sphere at every vertex of those whose centre is admitted. Where two radii
  /// are equal, it is that of the tetrahedron with the lexicographically first corners.
  template <class Admits>
  void take_largest(Admits&& admits) {
    const auto tetrahedra = spheres_.tetrahedra();
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
      if (!spheres_.finite(t)) continue;
      const double r2 = spheres_.radius2(t);
      for (const std::uint32_t v : tetrahedra[t].corner) {
        Vertex& vertex = vertices_[v];
        // Flat tetrahedra have no radius: no comparison with NaN is true.
        if (!(r2 >= vertex.radius2) || !admits(vertex, spheres_.to_centre(t, vertex.at))) continue;
        if (r2 == vertex.radius2 && !(spheres_.ranks_of(t) < spheres_.ranks_of(vertex.tetrahedron)))
          continue;
        vertex.radius2 = r2;
        vertex.tetrahedron = t;
      }
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
                       [&](std::uint32_t v) { return vertices_[v].radius2 < 0.0; }))
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

/// Disjoint sets of tetrahedra, each known to be alike or unlike its set's root.
class SignedSets {
 public:
  explicit SignedSets(std::uint32_t count) {
    parent_.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) parent_[i] = 2 * i;
  }
  /// The root, doubled, plus 1 if it is unlike.
  std::uint32_t find(std::uint32_t x) {
    std::uint32_t sign = 0;
    for (;;) {
      const std::uint32_t up = parent_[x];
      if (up >> 1 == x) return 2 * x | sign;
      const std::uint32_t next = parent_[up >> 1] ^ (up & 1);
      parent_[x] = next;
      sign ^= next & 1;
      x = next >> 1;
    }
  }
  /// If they are in different sets; `unlike` is 0 or 1.
  void join(std::uint32_t a, std::uint32_t b, std::uint32_t unlike) {
    const std::uint32_t root_a = find(a), root_b = find(b);
    if (root_a >> 1 == root_b >> 1) return;
    const std::uint32_t sign = (root_a ^ root_b ^ unlike) & 1;
    // The smaller number is the root, so that roots stay in spatial order as their tetrahedra are.
    const std::uint32_t low = std::min(root_a, root_b) >> 1, high = std::max(root_a, root_b) >> 1;
    parent_[high] = 2 * low | sign;
  }

 private:
  Pool<std::uint32_t> parent_;
};

class Forest {
 public:
  Forest(const Spheres& spheres, unsigned threads, const Part& part)
      : spheres_(spheres),
        threads_(threads),
        part_(part),
        beyond_(static_cast<std::uint32_t>(spheres.tetrahedra().size())) {}

  std::vector<std::uint8_t> labels() {
    poles_ = PoleFinder(spheres_, part_).find();
    state_all();
    SignedSets sets(beyond_ + 1);
    std::vector<std::uint32_t> roots;
    for (std::uint32_t t = 0; t < beyond_; ++t)
      if (node(t) == 2 * t) roots.push_back(t);
    roots.push_back(beyond_);
    best_.resize(beyond_ + 1);
    while (list_.size() > 0) join_best(sets, roots);
    const std::uint32_t outside = sets.find(beyond_);
    std::vector<std::uint8_t> inside(beyond_);
    for (std::uint32_t t = 0; t < beyond_; ++t)
      inside[t] = static_cast<std::uint8_t>((sets.find(node(t) >> 1) ^ node(t) ^ outside) & 1);
    return inside;
  }

 private:
  /// The set that t belongs to from the start, doubled, plus 1 if t is known to be inside.
  [[nodiscard]] std::uint32_t node(std::uint32_t t) const {
    if (!spheres_.finite(t)) return 2 * beyond_;
    if (part_.label.empty() || part_.label[t] == 0) return 2 * t;
    return 2 * beyond_ + (part_.label[t] == 2);
  }
  /// Whether this side of a finite tetrahedron stands for its facet, about which it says something
  /// new.
  [[nodiscard]] bool stands(std::uint32_t t, spatial::Side mate) const {
    const std::uint32_t other = spatial::tetrahedron_of(mate);
    return t < other || !spheres_.finite(other);
  }

  /// `other` may be kNone: beyond the hull.
  [[nodiscard]] Statement make(std::uint32_t key, std::uint32_t what, std::uint32_t one,
                               std::uint32_t other, std::uint32_t unlike) const {
    const std::uint32_t a = node(one), b = other == spatial::kNone ? 2 * beyond_ : node(other);
    return {key, what, a >> 1, b ^ (a & 1) ^ unlike};
  }

  void state_all() {
    const auto tetrahedra = spheres_.tetrahedra();
    const std::size_t unlabelled = part_.label.empty() ? tetrahedra.size() : part_.unlabelled;
    const std::size_t blocks = (unlabelled + kForestBlock - 1) / kForestBlock;
    std::vector<std::size_t> start(blocks + 1);
    const auto none = [] { return 0; };
    for_blocks(unlabelled, kForestBlock, threads_, none,
               [&](std::size_t begin, std::size_t end, int) {
                 std::size_t count = 0;
                 for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
                   if (!spheres_.finite(t)) continue;
                   for (const spatial::Side mate : tetrahedra[t].mate) count += stands(t, mate);
                 }
                 start[begin / kForestBlock] = count;
               });
    std::exclusive_scan(start.begin(), start.end(), start.begin(), std::size_t{0});
    const auto at_vertices = static_cast<std::size_t>(
        std::count_if(poles_.begin(), poles_.end(),
                      [](const Poles& poles) { return poles.second != spatial::kNone; }));
    list_.resize(static_cast<std::uint32_t>(start.back() + at_vertices));
    for_blocks(unlabelled, kForestBlock, threads_, none,
               [&](std::size_t begin, std::size_t end, int) {
                 const std::span to{list_.data() + start[begin / kForestBlock],
                                    list_.data() + start[begin / kForestBlock + 1]};
                 // First the facets alone, so that the branch is not mixed with the arithmetic.
                 std::size_t count = 0;
                 for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
                   if (!spheres_.finite(t)) continue;
                   for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
                     const spatial::Side mate = tetrahedra[t].mate[i];
                     if (!stands(t, mate)) continue;
                     to[count].what = spatial::make_side(t, i);
                     to[count++].other = spatial::tetrahedron_of(mate);
                   }
                 }
                 for (std::size_t i = 0; i < to.size(); ++i) {
                   // Neighbours lie anywhere.
                   spheres_.prefetch(to[std::min(i + kAhead, to.size() - 1)].other);
                   Statement& s = to[i];
                   s = make(key_of(spheres_.facet_defect(s.what), false), s.what,
                            spatial::tetrahedron_of(s.what), s.other, 0);
                 }
               });
    Statement* to = list_.data() + start.back();
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      const Poles& poles = poles_[v];
      if (poles.second == spatial::kNone) continue;
      *to = make(key_of(poles.defect, true), v, poles.second, poles.first, 1);
      to += to->one != to->other >> 1;  // else both are known
    }
    list_.resize(static_cast<std::uint32_t>(to - list_.data()));
  }

  /// One of Boruvka's rounds: every set is joined with another by the best statement about it, and
  /// statements within one set are dropped.
  void join_best(SignedSets& sets, std::vector<std::uint32_t>& roots) {
    for (const std::uint32_t root : roots) best_[root] = kNoBest;
    for (std::uint32_t i = 0; i < list_.size(); ++i) {
      const Statement& s = list_[i];
      const std::uint64_t best = std::uint64_t{s.key >> 1} << 32 | i;
      for (std::uint64_t* held : {&best_[s.one], &best_[s.other >> 1]}) {
        if (*held >> 32 == best >> 32) [[unlikely]] {
          if (before(s, list_[static_cast<std::uint32_t>(*held)])) *held = best;
        } else {
          *held = std::min(*held, best);
        }
      }
    }
    for (const std::uint32_t root : roots) {
      if (best_[root] == kNoBest) continue;
      const Statement& s = list_[static_cast<std::uint32_t>(best_[root])];
      sets.join(s.one, s.other >> 1, s.other & 1);
    }
    std::size_t count = 0;
    for (const std::uint32_t root : roots) {
      const std::uint32_t up = sets.find(root);
      best_[root] = up;
      if (up >> 1 == root) roots[count++] = root;
    }
    roots.resize(count);
    std::uint32_t left = 0;
    for (const Statement& s : span_of(list_)) {
      const auto one = static_cast<std::uint32_t>(best_[s.one]);
      const auto other = static_cast<std::uint32_t>(best_[s.other >> 1]);
      list_[left] = {s.key, s.what, one >> 1, other ^ ((one ^ s.other) & 1)};
      left += one >> 1 != other >> 1;
    }
    list_.resize(left);
  }

  /// Decides between defects that are the same when rounded: by defect, corners, facets first.
  [[nodiscard]] bool before(const Statement& a, const Statement& b) const {
    const double defect_a = defect_of(a), defect_b = defect_of(b);
    if (defect_a != defect_b) return defect_a < defect_b;
    return corners_of(a) < corners_of(b);
  }
  [[nodiscard]] double defect_of(const Statement& s) const {
    return s.of_vertex() ? poles_[s.what].defect : spheres_.facet_defect(s.what);
  }
  [[nodiscard]] Ranks corners_of(const Statement& s) const {
    constexpr std::uint32_t kNoCorner = 0xFFFFFFFFu;
    if (!s.of_vertex()) return spheres_.facet_ranks(s.what);
    return {spheres_.places()[s.what].rank, kNoCorner, kNoCorner, kNoCorner};
  }

  static constexpr std::uint64_t kNoBest = ~std::uint64_t{0};

  const Spheres& spheres_;
  unsigned threads_;
  const Part& part_;
  std::uint32_t beyond_;
  std::vector<Poles> poles_;
  Pool<Statement> list_;
  /// By root: the rounded defect of the best statement about the set, above its number; after the
  /// joining the new root, doubled, plus 1 if unlike.
  Pool<std::uint64_t> best_;
};

}  // namespace

std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads,
                                        const Part& part) {
  return Forest(spheres, threads, part).labels();
}

}  // namespace terrace::tri::shape
