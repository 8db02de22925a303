// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <numeric>
#include <span>
#include <utility>

#include "../for_blocks.hpp"
#include "poles.hpp"

namespace terrace::tri::shape {
namespace {

constexpr std::size_t kForestBlock = std::size_t{1} << 14;

/// A statement about two tetrahedra: across a facet that they are alike, at a vertex that its poles
/// differ.
struct Statement {
  /// The bits of the defect as a float (so in order of size, rounded), then whether of a vertex.
  std::uint32_t key;
  std::uint32_t what;  ///< a side or a vertex

  [[nodiscard]] bool of_vertex() const { return (key & 1) != 0; }
};

Statement statement(double defect, bool of_vertex, std::uint32_t what) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(defect));
  return {bits << 1 | static_cast<std::uint32_t>(of_vertex), what};
}

struct Poles {
  std::uint32_t first = spatial::kNone;   ///< kNone: beyond the hull
  std::uint32_t second = spatial::kNone;  ///< kNone: there is none
  double defect = 0.0;
};

/// Poles by vertex slot.
class PoleFinder {
 public:
  explicit PoleFinder(const Spheres& spheres)
      : spheres_(spheres), poles_(spheres.places().size()), to_first_(spheres.places().size()) {}

  std::vector<Poles> find() {
    const auto tetrahedra = spheres_.tetrahedra();
    std::vector<double> radius2(poles_.size(), -1.0);
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
      if (!spheres_.finite(t) || spheres_.flat(t)) continue;
      const double r2 = spheres_.radius2(t);
      for (const std::uint32_t v : tetrahedra[t].corner) {
        if (larger(r2, t, radius2[v], poles_[v].first)) {
          radius2[v] = r2;
          poles_[v].first = t;
        }
      }
    }
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      if (poles_[v].first != spatial::kNone) to_first_[v] = spheres_.to_centre(poles_[v].first, v);
    }
    add_hull();
    std::fill(radius2.begin(), radius2.end(), -1.0);
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
      if (!spheres_.finite(t) || spheres_.flat(t)) continue;
      const double r2 = spheres_.radius2(t);
      for (const std::uint32_t v : tetrahedra[t].corner) {
        if (!larger(r2, t, radius2[v], poles_[v].second)) continue;
        if (!(dot(spheres_.to_centre(t, v), to_first_[v]) < 0.0)) continue;
        radius2[v] = r2;
        poles_[v].second = t;
      }
    }
    for (std::uint32_t v = 1; v < poles_.size(); ++v) {
      Poles& pole = poles_[v];
      if (pole.second == spatial::kNone) continue;
      Vector3 back = spheres_.to_centre(pole.second, v);
      for (double& c : back) c = -c;
      pole.defect = kPoleWeight * defect_between(to_first_[v], back);
    }
    return std::move(poles_);
  }

 private:
  /// Of two equal radii the tetrahedron with the lexicographically first corners is the pole.
  [[nodiscard]] bool larger(double r2, std::uint32_t t, double best, std::uint32_t held) const {
    if (r2 != best) return r2 > best;
    return held != t && spheres_.ranks_of(t) < spheres_.ranks_of(held);
  }

  /// Vertices on the hull have their first pole beyond it, in the direction of the sum of the
  /// outward normals around them.
  void add_hull() {
    struct Normal {
      std::uint32_t vertex;
      Ranks facet;
      Vector3 normal;
    };
    std::vector<Normal> normals;
    const auto tetrahedra = spheres_.tetrahedra();
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
      if (!spheres_.finite(t)) continue;
      for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
        if (spheres_.finite(spatial::tetrahedron_of(tetrahedra[t].mate[i]))) continue;
        const spatial::Side side = spatial::make_side(t, i);
        const Vector3 normal = spheres_.hull_normal(side);
        for (const std::uint32_t v : spatial::facet_of(tetrahedra[t], i))
          normals.push_back({v, spheres_.facet_ranks(side), normal});
      }
    }
    std::sort(normals.begin(), normals.end(), [](const Normal& a, const Normal& b) {
      return a.vertex != b.vertex ? a.vertex < b.vertex : a.facet < b.facet;
    });
    std::uint32_t before = spatial::kNone;
    for (const Normal& n : normals) {
      Vector3& sum = to_first_[n.vertex];
      if (n.vertex != before) sum = {};
      before = n.vertex;
      poles_[n.vertex].first = spatial::kNone;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += n.normal[k];
    }
  }

  const Spheres& spheres_;
  std::vector<Poles> poles_;
  std::vector<Vector3> to_first_;
};

/// By ascending keys; `spare` has the same size.
void radix_sort(std::vector<Statement>& list, std::vector<Statement>& spare) {
  constexpr unsigned kBits = 11;
  constexpr std::size_t kBins = std::size_t{1} << kBits;
  std::vector<std::size_t> start(3 * kBins);
  for (const Statement& s : list)
    for (unsigned pass = 0; pass < 3; ++pass)
      ++start[pass * kBins + (s.key >> (pass * kBits) & (kBins - 1))];
  for (unsigned pass = 0; pass < 3; ++pass) {
    std::size_t* bin = start.data() + pass * kBins;
    std::exclusive_scan(bin, bin + kBins, bin, std::size_t{0});
    for (const Statement& s : list) spare[bin[s.key >> (pass * kBits) & (kBins - 1)]++] = s;
    std::swap(list, spare);
  }
}

/// Disjoint sets of tetrahedra, each known to be alike or unlike its set's root.
class SignedSets {
 public:
  explicit SignedSets(std::size_t count) : parent_(count) {
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
  void join(std::uint32_t a, std::uint32_t b, std::uint32_t unlike) {
    const std::uint32_t root_a = find(a), root_b = find(b);
    if (root_a >> 1 == root_b >> 1) return;
    const std::uint32_t sign = (root_a ^ root_b ^ unlike) & 1;
    // The larger number below the smaller: about as good as by size, as numbers are mixed.
    const std::uint32_t low = std::min(root_a, root_b) >> 1, high = std::max(root_a, root_b) >> 1;
    parent_[high] = 2 * low | sign;
  }

 private:
  std::vector<std::uint32_t> parent_;
};

class Forest {
 public:
  Forest(const Spheres& spheres, unsigned threads)
      : spheres_(spheres),
        threads_(threads),
        beyond_(static_cast<std::uint32_t>(spheres.tetrahedra().size())) {}

  std::vector<std::uint8_t> labels() {
    poles_ = PoleFinder(spheres_).find();
    state_all();
    {
      std::vector<Statement> spare(list_.size());
      radix_sort(list_, spare);
    }
    SignedSets sets(std::size_t{beyond_} + 1);
    for (std::size_t begin = 0, end = 0; begin < list_.size(); begin = end) {
      for (end = begin + 1; end < list_.size() && list_[end].key >> 1 == list_[begin].key >> 1;)
        ++end;
      if (end - begin > 1) order_exactly({list_.data() + begin, end - begin});
      for (std::size_t i = begin; i < end; ++i) believe(sets, list_[i]);
    }
    const std::uint32_t outside = sets.find(beyond_);
    std::vector<std::uint8_t> inside(beyond_);
    for (std::uint32_t t = 0; t < beyond_; ++t)
      if (spheres_.finite(t)) inside[t] = static_cast<std::uint8_t>((sets.find(t) ^ outside) & 1);
    return inside;
  }

 private:
  [[nodiscard]] std::uint32_t node(std::uint32_t t) const {
    return spheres_.finite(t) ? t : beyond_;
  }
  /// Whether this side of a finite tetrahedron stands for its facet.
  [[nodiscard]] bool stands(std::uint32_t t, spatial::Side mate) const {
    const std::uint32_t other = spatial::tetrahedron_of(mate);
    return t < other || !spheres_.finite(other);
  }

  void state_all() {
    const auto tetrahedra = spheres_.tetrahedra();
    const std::size_t blocks = (tetrahedra.size() + kForestBlock - 1) / kForestBlock;
    std::vector<std::size_t> start(blocks + 1);
    const auto none = [] { return 0; };
    for_blocks(tetrahedra.size(), kForestBlock, threads_, none,
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
    list_.resize(start.back() + at_vertices);
    for_blocks(tetrahedra.size(), kForestBlock, threads_, none,
               [&](std::size_t begin, std::size_t end, int) {
                 Statement* to = list_.data() + start[begin / kForestBlock];
                 for (auto t = static_cast<std::uint32_t>(begin); t < end; ++t) {
                   if (!spheres_.finite(t)) continue;
                   for (const std::uint32_t i : {0u, 1u, 2u, 3u}) {
                     if (!stands(t, tetrahedra[t].mate[i])) continue;
                     const spatial::Side side = spatial::make_side(t, i);
                     *to++ = statement(spheres_.facet_defect(side), false, side);
                   }
                 }
               });
    Statement* to = list_.data() + start.back();
    for (std::uint32_t v = 1; v < poles_.size(); ++v)
      if (poles_[v].second != spatial::kNone) *to++ = statement(poles_[v].defect, true, v);
  }

  /// Statements whose defects are the same when rounded: by defect, corners, facets first.
  void order_exactly(std::span<Statement> run) {
    struct Full {
      double defect;
      Ranks corners;
      Statement statement;
    };
    std::vector<Full> full;
    full.reserve(run.size());
    constexpr std::uint32_t kNoCorner = 0xFFFFFFFFu;
    for (const Statement& s : run) {
      if (s.of_vertex()) {
        const std::uint32_t rank = spheres_.places()[s.what].rank;
        full.push_back({poles_[s.what].defect, {rank, kNoCorner, kNoCorner, kNoCorner}, s});
      } else {
        full.push_back({spheres_.facet_defect(s.what), spheres_.facet_ranks(s.what), s});
      }
    }
    std::sort(full.begin(), full.end(), [](const Full& a, const Full& b) {
      return a.defect != b.defect ? a.defect < b.defect : a.corners < b.corners;
    });
    for (std::size_t i = 0; i < run.size(); ++i) run[i] = full[i].statement;
  }

  void believe(SignedSets& sets, const Statement& s) const {
    if (s.of_vertex()) {
      const Poles& poles = poles_[s.what];
      sets.join(poles.first == spatial::kNone ? beyond_ : poles.first, poles.second, 1);
    } else {
      const std::uint32_t t = spatial::tetrahedron_of(s.what);
      const spatial::Side mate = spheres_.tetrahedra()[t].mate[spatial::index_of(s.what)];
      sets.join(t, node(spatial::tetrahedron_of(mate)), 0);
    }
  }

  const Spheres& spheres_;
  unsigned threads_;
  std::uint32_t beyond_;
  std::vector<Poles> poles_;
  std::vector<Statement> list_;
};

}  // namespace

std::vector<std::uint8_t> signed_forest(const Spheres& spheres, unsigned threads) {
  return Forest(spheres, threads).labels();
}

}  // namespace terrace::tri::shape
