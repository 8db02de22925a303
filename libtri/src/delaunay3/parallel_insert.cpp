// SPDX-License-Identifier: Apache-2.0
// Insertion of many vertices by two threads. Vertices are numbered along a Hilbert curve, so the
// first half of the numbers is on one side of space and the second half on the other. Each thread
// inserts the vertices of one half as long as it meets only tetrahedra of that half. The others are
// deferred. A second round cuts the circle of numbers elsewhere, so that most deferred vertices are
// far from its border. The rest are inserted one by one.
#include <algorithm>
#include <array>
#include <exception>
#include <system_error>
#include <thread>

#include <terrace/base/stop_check.hpp>

#include "cavity_insert.hpp"
#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "insert.hpp"
#include "int_kernel.hpp"
#include "walk.hpp"

namespace terrace::tri::spatial {
namespace {

constexpr std::uint32_t kParts = 2;

/// A part of the mesh in which one thread inserts while others work in theirs. It consists of the
/// tetrahedra whose corners (except the ghost) all have numbers in one range, which may wrap around
/// the end. Only this thread reads and writes such a tetrahedron. A tetrahedron with corners in
/// several ranges is read by all threads and written by none. The work on a part therefore does not
/// depend on what happens in other parts at the same time.
///
/// New tetrahedra go to blocks of slots that alternate between the parts.
class Part {
 public:
  static constexpr bool kIsEntireMesh = false;
  static constexpr std::uint32_t kBlock = 128;  ///< marks of two cache lines

  /// `size` vertices first, first + 1, ... on a circle of `all` vertices that begins at `begin`.
  struct Range {
    std::uint32_t begin, all, first, size;

    [[nodiscard]] bool has(std::uint32_t v) const {
      std::uint32_t offset = v - first;
      if (offset >= all) offset += all;
      return offset < size;
    }
  };

  /// Uses slots from `base` on: `blocks` blocks for each of `parts` parts. This is part `number`.
  /// free_list: slots that this part may use first.
  Part(const Range& range, std::uint32_t base, std::uint32_t parts, std::uint32_t number,
       std::uint32_t blocks, std::uint32_t free_list)
      : range_(range),
        base_(base),
        parts_(parts),
        number_(number),
        room_(blocks * kBlock),
        free_(free_list) {}

  [[nodiscard]] const Range& range() const { return range_; }
  [[nodiscard]] bool owns(std::uint32_t corner) const {
    return range_.has(corner) || corner == kGhost;
  }
  [[nodiscard]] bool owns(const Tetrahedron& t) const {
    for (const std::uint32_t v : t.corner)
      if (!owns(v)) return false;
    return true;
  }
  /// True if the neighbour beyond facet i may be read. If a corner of that facet is in the range,
  /// the neighbour cannot belong to another thread.
  [[nodiscard]] bool may_read_beyond(const Tetrahedron& t, std::uint32_t i) const {
    for (std::uint32_t k = 0; k < 4; ++k)
      if (k != i && range_.has(t.corner[k])) return true;
    return false;
  }

  /// True if this many more slots are certainly available.
  [[nodiscard]] bool has_room(std::size_t count) const { return used_ + count <= room_; }
  template <class Mesh>
  std::uint32_t new_tetrahedron(Mesh& mesh) {
    if (free_ == kNone) return slot_at(used_++);
    const std::uint32_t t = free_;
    free_ = mesh.tetrahedron[t].corner[1];
    return t;
  }
  template <class Mesh>
  void free_tetrahedron(Mesh& mesh, std::uint32_t t) {
    mesh.tetrahedron[t].corner[0] = kFreeCorner;
    mesh.tetrahedron[t].corner[1] = free_;
    free_ = t;
  }
  template <class Mesh>
  void count(Mesh&, std::int64_t not_ghosts, std::int64_t all) {
    finite_ += not_ghosts + all;
  }

  [[nodiscard]] std::uint32_t used() const { return used_; }
  [[nodiscard]] std::uint32_t slot_at(std::uint32_t i) const {
    return base_ + (i / kBlock * parts_ + number_) * kBlock + i % kBlock;
  }
  [[nodiscard]] std::uint32_t free_list() const { return free_; }
  [[nodiscard]] std::int64_t finite() const { return finite_; }

 private:
  Range range_;
  std::uint32_t base_;
  std::uint32_t parts_;
  std::uint32_t number_;
  std::uint32_t room_;
  std::uint32_t used_ = 0;
  std::uint32_t free_;
  std::int64_t finite_ = 0;
};

/// Starts a thread with this thread's metric. The result is not joinable if the system refuses to
/// start one.
template <class Kernel, class Work>
std::thread start_thread(const Work& work) {
  try {
    if constexpr (std::is_same_v<Kernel, EllipticalKernel>) {
      return std::thread([work, &form = EllipticalKernel::form()] {
        const EllipticalKernel::Scope scope(form);
        work();
      });
    } else {
      return std::thread(work);
    }
  } catch (const std::system_error&) {
    return {};
  }
}

/// The nearest vertex before v on the curve (or else after it) that has tetrahedra and is in the
/// range, or kNone. Takes few steps, as one vertex in four comes from coarser passes.
template <class Kernel>
std::uint32_t find_hint(const Mesh<Kernel>& mesh, const Curve& curve, const Part::Range& range,
                        std::uint32_t v) {
  const auto has_tetrahedron = [&](std::uint32_t u) { return mesh.vertex[u].incident < kLocalBit; };
  for (std::uint32_t u = v; u - curve.begin >= curve.step && range.has(u - curve.step);) {
    u -= curve.step;
    if (has_tetrahedron(u)) return u;
  }
  for (std::uint32_t u = v; curve.end - u > curve.step && range.has(u + curve.step);) {
    u += curve.step;
    if (has_tetrahedron(u)) return u;
  }
  return kNone;
}

/// The work of one thread. Alignment keeps the data of different threads in separate cache lines.
template <class Kernel>
class alignas(128) Worker {
 public:
  Worker(Mesh<Kernel>& mesh, const Curve& curve, const Part& thread_part)
      : part(thread_part),
        mesh_(mesh),
        curve_(curve),
        insertion_(mesh, cavity_, part),
        ticks_(mesh.ticks) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void run(std::span<const std::uint32_t> vertices) {
    try {
      for (; attempts < vertices.size(); ++attempts) {
        ticks_(kTicksOfInsertion);
        if (insert(vertices[attempts])) continue;
        if (out_of_room_) return;
        deferred.push_back(vertices[attempts]);
      }
    } catch (...) {
      failure = std::current_exception();
    }
  }

  Part part;
  std::vector<std::uint32_t> deferred;
  std::size_t attempts = 0;  ///< number of vertices, all unless slots ran out
  std::exception_ptr failure;

 private:
  bool insert(std::uint32_t v) {
    const auto& p = mesh_.vertex[v].point;
    const std::uint32_t hint = find_hint(mesh_, curve_, part.range(), v);
    if (hint == kNone) return false;
    const WalkEnd end = walk(mesh_, p, mesh_.vertex[hint].incident, part);
    if (end.tetrahedron == kNone) return false;
    if (!end.outside) {
      const std::uint32_t equal = equal_corner(mesh_, end.tetrahedron, p);
      if (equal != kNone) {
        mesh_.vertex[v].incident = kAlias | equal;
        return true;
      }
    }
    if (!insertion_.run(v, end.tetrahedron)) {
      out_of_room_ = insertion_.out_of_room();
      return false;
    }
    return true;
  }

  Mesh<Kernel>& mesh_;
  const Curve& curve_;
  Cavity cavity_;
  CavityInsertion<Kernel, Part> insertion_;
  bool out_of_room_ = false;
  base::StopTicks ticks_;
};

template <class Kernel>
class Round {
 public:
  /// Divides the curve's vertices, as a circle, into parts. The first begins at number `cut`.
  Round(Mesh<Kernel>& mesh, const Curve& curve, std::uint32_t cut) : mesh_(mesh), curve_(curve) {
    const std::uint32_t all = curve.end - curve.begin;
    const std::uint32_t half = all / 2;
    ranges_ = {Part::Range{curve.begin, all, curve.begin + cut, half},
               Part::Range{curve.begin, all, curve.begin + (cut + half) % all, all - half}};
  }

  /// Inserts sorted vertices, which it rotates so that the first part comes first.
  /// Returns the vertices that could not be inserted, sorted.
  std::vector<std::uint32_t> run(std::span<std::uint32_t> vertices, unsigned threads) {
    std::rotate(vertices.begin(),
                std::lower_bound(vertices.begin(), vertices.end(), ranges_[0].first),
                vertices.end());
    const auto split = std::partition_point(vertices.begin(), vertices.end(),
                                            [&](std::uint32_t v) { return ranges_[0].has(v); });
    std::array<std::span<std::uint32_t>, kParts> lists = {std::span(vertices.begin(), split),
                                                          std::span(split, vertices.end())};
    std::vector<std::uint32_t> deferred;
    while (!lists[0].empty() || !lists[1].empty()) {
      fill_block();
      const std::uint32_t base = mesh_.tetrahedron.size();
      make_room(lists[0].size() + lists[1].size());
      const std::uint32_t blocks = (mesh_.tetrahedron.size() - base) / (kParts * Part::kBlock);
      Worker<Kernel> first(mesh_, curve_,
                           Part(ranges_[0], base, kParts, 0, blocks, mesh_.free_tetrahedron));
      Worker<Kernel> second(mesh_, curve_, Part(ranges_[1], base, kParts, 1, blocks, kNone));
      std::thread other;
      if (threads > 1) other = start_thread<Kernel>([&] { second.run(lists[1]); });
      first.run(lists[0]);
      if (other.joinable()) {
        other.join();
      } else if (!first.failure) {
        second.run(lists[1]);
      }
      for (const auto* worker : {&first, &second}) {
        if (worker->failure) std::rethrow_exception(worker->failure);
        mesh_.finite_count = static_cast<std::uint32_t>(mesh_.finite_count + worker->part.finite());
        deferred.insert(deferred.end(), worker->deferred.begin(), worker->deferred.end());
      }
      close_gaps(base, first.part, second.part);
      lists = {lists[0].subspan(first.attempts), lists[1].subspan(second.attempts)};
      if (first.attempts + second.attempts > 0) continue;
      // A cavity needs more than all the room.
      for (const auto& list : lists) deferred.insert(deferred.end(), list.begin(), list.end());
      break;
    }
    std::sort(deferred.begin(), deferred.end());
    return deferred;
  }

 private:
  /// Frees slots up to a multiple of the block size, so that blocks align with cache lines.
  void fill_block() {
    while (mesh_.tetrahedron.size() % Part::kBlock != 0) {
      const std::uint32_t t = mesh_.tetrahedron.size();
      if (t >= kMaxTetrahedra) return;
      mesh_.tetrahedron.resize(t + 1);
      mesh_.mark.resize(t + 1);
      mesh_.mark[t] = kUnknown;
      mesh_.free_tetrahedron_slot(t);
    }
  }

  /// Makes room for the tetrahedra of this many new vertices, in whole blocks. Uses capacity that
  /// is already reserved if it nearly suffices.
  void make_room(std::size_t vertex_count) {
    constexpr std::size_t kUnit = kParts * std::size_t{Part::kBlock};
    const std::size_t size = mesh_.tetrahedron.size();
    const std::size_t reserved = mesh_.tetrahedron.bytes() / sizeof(Tetrahedron) - size;
    const std::size_t desired = 7 * vertex_count + 16 * kUnit;
    const std::size_t added =
        reserved >= 6 * vertex_count + 8 * kUnit ? std::min(reserved, desired) : desired;
    const std::size_t new_size = size + added / kUnit * kUnit;
    if (new_size > kMaxTetrahedra)
      throw std::length_error("a triangulation holds at most 2^30 - 2 tetrahedra");
    mesh_.tetrahedron.resize(static_cast<std::uint32_t>(new_size));
    mesh_.mark.resize(static_cast<std::uint32_t>(new_size));
    std::fill(mesh_.mark.data() + size, mesh_.mark.data() + new_size, kUnknown);
  }

  /// Returns the slots that the parts have not used to the free list.
  void close_gaps(std::uint32_t base, const Part& first, const Part& second) {
    std::uint32_t end = base;
    for (const Part* part : {&first, &second})
      if (part->used() > 0) end = std::max(end, part->slot_at(part->used() - 1) + 1);
    mesh_.tetrahedron.resize(end);
    mesh_.mark.resize(end);
    mesh_.free_tetrahedron = kNone;
    for (const Part* part : {&second, &first}) {
      for (std::uint32_t t = part->free_list(); t != kNone;) {
        const std::uint32_t next = mesh_.tetrahedron[t].corner[1];
        mesh_.free_tetrahedron_slot(t);
        t = next;
      }
      for (std::uint32_t i = part->used(); part->slot_at(i) < end; ++i)
        mesh_.free_tetrahedron_slot(part->slot_at(i));
    }
  }

  Mesh<Kernel>& mesh_;
  const Curve& curve_;
  std::array<Part::Range, kParts> ranges_;
};

}  // namespace

template <class Kernel>
void insert_slot(Mesh<Kernel>& mesh, std::uint32_t vertex, std::uint32_t hint) {
  mesh.ticks(kTicksOfInsertion);
  const auto& p = mesh.vertex[vertex].point;
  const WalkEnd end = walk(mesh, p, mesh.vertex[hint].incident);
  if (!end.outside) {
    const std::uint32_t equal = equal_corner(mesh, end.tetrahedron, p);
    if (equal != kNone) {
      mesh.vertex[vertex].incident = kAlias | equal;
      return;
    }
  }
  insert_vertex(mesh, vertex, end.tetrahedron);
  mesh.last_vertex = vertex;
}

template <class Kernel>
void insert_in_parallel(Mesh<Kernel>& mesh, const Curve& curve, std::span<std::uint32_t> vertices,
                        unsigned threads) {
  // A Hilbert curve passes through the halves of space one after the other. Its two middle quarters
  // together and its two outer ones are also halves, with a perpendicular cut.
  const std::uint32_t all = curve.end - curve.begin;
  std::vector<std::uint32_t> remaining = Round<Kernel>(mesh, curve, 0).run(vertices, threads);
  remaining = Round<Kernel>(mesh, curve, all / 4).run(remaining, threads);
  const Part::Range everywhere = {curve.begin, all, curve.begin, all};
  for (const std::uint32_t v : remaining) {
    const std::uint32_t hint = find_hint(mesh, curve, everywhere, v);
    insert_slot(mesh, v, hint == kNone ? mesh.last_vertex : hint);
  }
}

#ifdef TERRACE_TRI_CORE
template void insert_slot(Mesh<IntKernel>&, std::uint32_t, std::uint32_t);
template void insert_in_parallel(Mesh<IntKernel>&, const Curve&, std::span<std::uint32_t>,
                                 unsigned);
#else
template void insert_slot(Mesh<DoubleKernel>&, std::uint32_t, std::uint32_t);
template void insert_slot(Mesh<EllipticalKernel>&, std::uint32_t, std::uint32_t);
template void insert_in_parallel(Mesh<DoubleKernel>&, const Curve&, std::span<std::uint32_t>,
                                 unsigned);
template void insert_in_parallel(Mesh<EllipticalKernel>&, const Curve&, std::span<std::uint32_t>,
                                 unsigned);
#endif

}  // namespace terrace::tri::spatial
