// SPDX-License-Identifier: GPL-3.0-or-later
// Insertion of many vertices by two threads. Vertices are numbered along a Hilbert curve, so the
// first half of the numbers lies on one side of space and the second on the other. Each thread
// inserts the vertices of one half as long as it meets tetrahedra of that half only; others are put
// off. A second round cuts the circle of numbers elsewhere, so that most of these are far from its
// border; what is left is inserted one by one.
#include "parts_insert.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <thread>

#include "cavity_insert.hpp"
#include "double_kernel.hpp"
#include "elliptical_kernel.hpp"
#include "insert.hpp"
#include "int_kernel.hpp"
#include "part.hpp"
#include "walk.hpp"

namespace terrace::tri::spatial {
namespace {

constexpr std::uint32_t kParts = 2;

/// A thread that has this one's metric.
template <class Kernel, class Work>
std::thread in_thread(const Work& work) {
  if constexpr (std::is_same_v<Kernel, EllipticalKernel>) {
    return std::thread([work, &metric = EllipticalKernel::metric()] {
      const EllipticalKernel::Scope scope(metric);
      work();
    });
  } else {
    return std::thread(work);
  }
}

/// What one thread does.
template <class Kernel>
class Worker {
 public:
  Worker(Mesh<Kernel>& mesh, const Part& its_part, std::uint32_t hint)
      : part(its_part), mesh_(mesh), insertion_(mesh, cavity_, part), hint_(hint) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void run(std::span<const std::uint32_t> going) {
    try {
      for (; tried < going.size(); ++tried) {
        if (insert(going[tried])) continue;
        if (out_of_room_) return;
        put_off.push_back(going[tried]);
      }
    } catch (...) {
      failure = std::current_exception();
    }
  }

  Part part;
  std::vector<std::uint32_t> put_off;
  std::size_t tried = 0;  ///< all, but for want of slots
  std::exception_ptr failure;

 private:
  bool insert(std::uint32_t v) {
    const auto& p = mesh_.vertex[v].point;
    if (hint_ == kNone) return false;
    const WalkEnd end = walk(mesh_, p, mesh_.vertex[hint_].incident, part);
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
    hint_ = v;
    return true;
  }

  Mesh<Kernel>& mesh_;
  Cavity cavity_;
  CavityInsertion<Kernel, Part> insertion_;
  std::uint32_t hint_;
  bool out_of_room_ = false;
};

template <class Kernel>
class Round {
 public:
  /// Parts of the circle of vertices begin, ..., end - 1, the first from number `cut` on.
  Round(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end, std::uint32_t cut)
      : mesh_(mesh) {
    const std::uint32_t all = end - begin;
    const std::uint32_t half = all / 2;
    ranges_ = {Part::Range{begin, all, begin + cut, half},
               Part::Range{begin, all, begin + (cut + half) % all, all - half}};
  }

  /// Turns `going` (sorted) round to begin with the first part. Returns what could not be inserted,
  /// sorted.
  std::vector<std::uint32_t> run(std::span<std::uint32_t> going, unsigned threads) {
    std::rotate(going.begin(), std::lower_bound(going.begin(), going.end(), ranges_[0].first),
                going.end());
    const auto split = std::partition_point(going.begin(), going.end(),
                                            [&](std::uint32_t v) { return ranges_[0].has(v); });
    std::array<std::span<std::uint32_t>, kParts> lists = {std::span(going.begin(), split),
                                                          std::span(split, going.end())};
    std::vector<std::uint32_t> put_off;
    while (!lists[0].empty() || !lists[1].empty()) {
      const std::uint32_t base = mesh_.tetrahedron.size();
      make_room(lists[0].size() + lists[1].size());
      const std::uint32_t blocks = (mesh_.tetrahedron.size() - base) / (kParts * Part::kBlock);
      Worker<Kernel> first(mesh_, Part(ranges_[0], base, kParts, 0, blocks, mesh_.free_tetrahedron),
                           hint(0));
      Worker<Kernel> second(mesh_, Part(ranges_[1], base, kParts, 1, blocks, kNone), hint(1));
      if (threads > 1) {
        std::thread other = in_thread<Kernel>([&] { second.run(lists[1]); });
        first.run(lists[0]);
        other.join();
      } else {
        first.run(lists[0]);
        second.run(lists[1]);
      }
      for (const auto* worker : {&first, &second}) {
        if (worker->failure) std::rethrow_exception(worker->failure);
        mesh_.finite_count = static_cast<std::uint32_t>(mesh_.finite_count + worker->part.finite());
        put_off.insert(put_off.end(), worker->put_off.begin(), worker->put_off.end());
      }
      close_gaps(base, first.part, second.part);
      lists = {lists[0].subspan(first.tried), lists[1].subspan(second.tried)};
      if (first.tried + second.tried > 0) continue;
      // A cavity that is larger than all the room.
      for (const auto& list : lists) put_off.insert(put_off.end(), list.begin(), list.end());
      break;
    }
    std::sort(put_off.begin(), put_off.end());
    return put_off;
  }

 private:
  /// Slots for tetrahedra of so many new vertices, whole blocks. What is reserved anyway is taken
  /// where it is nearly enough.
  void make_room(std::size_t vertices) {
    constexpr std::size_t kUnit = kParts * std::size_t{Part::kBlock};
    const std::size_t size = mesh_.tetrahedron.size();
    const std::size_t reserved = mesh_.tetrahedron.bytes() / sizeof(Tetrahedron) - size;
    const std::size_t wanted = 7 * vertices + 16 * kUnit;
    const std::size_t taken =
        reserved >= 6 * vertices + 8 * kUnit ? std::min(reserved, wanted) : wanted;
    const std::size_t after = size + taken / kUnit * kUnit;
    if (after > kMaxTetrahedra)
      throw std::length_error("a triangulation holds at most 2^30 - 2 tetrahedra");
    mesh_.tetrahedron.resize(static_cast<std::uint32_t>(after));
    mesh_.mark.resize(static_cast<std::uint32_t>(after));
    std::fill(mesh_.mark.data() + size, mesh_.mark.data() + after, kUnknown);
  }

  /// Some vertex of the part that has tetrahedra, or kNone. Vertices of coarser passes are spread
  /// over every part.
  std::uint32_t hint(std::size_t number) const {
    const Part::Range& range = ranges_[number];
    for (std::uint32_t i = 0; i < range.size; ++i) {
      std::uint32_t v = range.first + i;
      if (v >= range.begin + range.all) v -= range.all;
      if (mesh_.vertex[v].incident < kLocalBit) return v;
    }
    return kNone;
  }

  /// Gives the slots that the parts have not used back.
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
  std::array<Part::Range, kParts> ranges_;
};

}  // namespace

template <class Kernel>
void insert_slot(Mesh<Kernel>& mesh, std::uint32_t vertex) {
  const auto& p = mesh.vertex[vertex].point;
  const WalkEnd end = walk(mesh, p, mesh.vertex[mesh.last_vertex].incident);
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
void insert_in_parts(Mesh<Kernel>& mesh, std::uint32_t begin, std::uint32_t end,
                     std::span<std::uint32_t> going, unsigned threads) {
  // A Hilbert curve goes through the halves of space one after the other, and so do its two middle
  // quarters and its two outer ones, with the cut across.
  std::vector<std::uint32_t> left = Round<Kernel>(mesh, begin, end, 0).run(going, threads);
  left = Round<Kernel>(mesh, begin, end, (end - begin) / 4).run(left, threads);
  for (const std::uint32_t v : left) insert_slot(mesh, v);
}

template void insert_slot(Mesh<IntKernel>&, std::uint32_t);
template void insert_slot(Mesh<DoubleKernel>&, std::uint32_t);
template void insert_slot(Mesh<EllipticalKernel>&, std::uint32_t);
template void insert_in_parts(Mesh<IntKernel>&, std::uint32_t, std::uint32_t,
                              std::span<std::uint32_t>, unsigned);
template void insert_in_parts(Mesh<DoubleKernel>&, std::uint32_t, std::uint32_t,
                              std::span<std::uint32_t>, unsigned);
template void insert_in_parts(Mesh<EllipticalKernel>&, std::uint32_t, std::uint32_t,
                              std::span<std::uint32_t>, unsigned);

}  // namespace terrace::tri::spatial
