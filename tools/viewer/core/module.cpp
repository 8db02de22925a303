// SPDX-License-Identifier: GPL-3.0-or-later
/// The functions of the WebAssembly module: one store under one camera. JavaScript brings the
/// bytes.
///
/// A call takes what is longer than a number from input(), where JavaScript has written it, and
/// leaves what is longer at output().

#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <terrace/stream/error.hpp>
#include <terrace/stream/given_bytes.hpp>
#include <terrace/stream/store.hpp>
#include <terrace/terrain/store_view.hpp>
#include <unistd.h>

#include "sample/store_probe.hpp"
#include "scene.hpp"

namespace {

using namespace terrace;

enum Status : int { kDone = 0, kMissing = 1, kFailed = 2 };

/// Ranges told at once; there is no sense in more requests than that.
constexpr std::size_t kMostRanges = 1024;

struct Module {
  std::vector<double> input;  // of doubles, so that it is aligned for them
  stream::GivenBytes given;
  std::optional<stream::Store> store;
  std::unique_ptr<viewer::Scene> scene;
  viewer::SceneState state;
  std::vector<double> numbers;
  std::string text, told;  // told: what the last frame lacked
  std::optional<viewer::SceneHit> hit;
  std::optional<terrain::StoreProbe> probe;
};

Module& module() {
  static Module the;
  return the;
}

const char* input_text() { return reinterpret_cast<const char*>(module().input.data()); }

void tell(std::span<const stream::ByteRange> ranges) {
  module().text.clear();
  for (const stream::ByteRange& range : ranges.first(std::min(ranges.size(), kMostRanges))) {
    module().text += range.file + '\t' + std::to_string(range.offset) + '\t' +
                     std::to_string(range.bytes) + '\n';
  }
}

template <class Work>
int guarded(const Work& work) {
  try {
    return work();
  } catch (const stream::MissingBytes& missing) {
    tell(missing.ranges());
    return kMissing;
  } catch (const std::exception& error) {
    module().text = error.what();
    return kFailed;
  }
}

/// What a scene needs at most beside its points, and what each of these takes: caches of clusters
/// and bytes; triangulation, heights and the arrays to draw.
constexpr std::size_t kMemory = std::size_t{128} << 20;
#ifdef TERRACE_VIEWER_BODY
constexpr std::size_t kPointMemory = 700;
#else
constexpr std::size_t kPointMemory = 200;
#endif

/// Growing the memory takes the browser many milliseconds, however little it is, and malloc would
/// ask for a page at a time. Pages that are not touched cost nothing.
constexpr std::size_t kWasmPage = 65536;
/// A frame that finds less than this free has more of it reserved.
constexpr std::size_t kLeastMemory = std::size_t{8} << 20;

std::size_t memory_left() {
  return __builtin_wasm_memory_size(0) * kWasmPage - reinterpret_cast<std::uintptr_t>(sbrk(0));
}
void reserve_memory(std::size_t bytes) {
  const std::size_t left = memory_left();
  if (left < bytes) __builtin_wasm_memory_grow(0, (bytes - left + kWasmPage - 1) / kWasmPage);
}

/// Whether the module for bodies should go on with the store.
bool is_body(const stream::Store& store, const stream::LinearMap& ground) {
#ifdef TERRACE_VIEWER_BODY
  static_cast<void>(store);
  static_cast<void>(ground);
  return true;
#else
  return terrain::is_scan(store, ground);
#endif
}

stream::Point3 point_of(const double* at) { return {at[0], at[1], at[2]}; }

}  // namespace

#define TERRACE_EXPORT(name) extern "C" __attribute__((export_name(#name), visibility("default")))

/// Room for this many bytes of input; valid until the next call of it.
TERRACE_EXPORT(input) void* terrace_input(std::size_t bytes) {
  module().input.resize(bytes / sizeof(double) + 1);
  return module().input.data();
}
/// Text after kMissing (lines of file, offset, bytes), after kFailed (what is wrong).
TERRACE_EXPORT(text) const char* terrace_text() { return module().text.data(); }
TERRACE_EXPORT(text_size) std::size_t terrace_text_size() { return module().text.size(); }
/// Numbers that a call has left.
TERRACE_EXPORT(numbers) const double* terrace_numbers() { return module().numbers.data(); }

/// input: a name. A file of the store and its size.
TERRACE_EXPORT(add_file) int terrace_add_file(std::size_t name, double bytes) {
  return guarded([&] {
    module().given.add_file({input_text(), name}, static_cast<std::uint64_t>(bytes));
    return kDone;
  });
}
/// input: a name and behind it the bytes from `offset` on.
TERRACE_EXPORT(give) int terrace_give(std::size_t name, double offset, std::size_t bytes) {
  return guarded([&] {
    module().given.give({input_text(), name}, static_cast<std::uint64_t>(offset),
                        std::as_bytes(std::span(input_text() + name, bytes)));
    return kDone;
  });
}
/// input: a name. Its bytes were damaged and will be brought again.
TERRACE_EXPORT(forget) int terrace_forget(std::size_t name) {
  return guarded([&] {
    module().given.forget({input_text(), name});
    return kDone;
  });
}

/// input: the nine numbers of the map from stored coordinates to metres. numbers: the box of the
/// scene; 1 for a raster; 1 for the scan of a body; of points whether they have colours, classes,
/// intensities; how many classes, and these.
TERRACE_EXPORT(open) int terrace_open(double max_points) {
  return guarded([&] {
    Module& m = module();
    stream::LinearMap ground{};
    std::memcpy(ground.data(), m.input.data(), sizeof ground);
    if (!m.store) m.store = stream::Store::open("store", m.given.open());
    m.probe.emplace(*m.store, ground);
    reserve_memory(kMemory + kPointMemory * static_cast<std::size_t>(max_points));
    m.scene =
        viewer::Scene::open(*m.store, ground, static_cast<std::size_t>(max_points),
                            [&m](const stream::ByteRange& range) { return m.given.has(range); });
    const stream::Box3 box = m.scene->box();
    m.numbers = {box.min[0],
                 box.min[1],
                 box.min[2],
                 box.max[0],
                 box.max[1],
                 box.max[2],
                 m.store->schema().grid ? 1.0 : 0.0,
                 is_body(*m.store, ground) ? 1.0 : 0.0};
    const viewer::CloudColours& colours = m.scene->colours();
    for (const bool has : {colours.has_rgb(), colours.has_group(), colours.has_intensity()}) {
      m.numbers.push_back(has ? 1 : 0);
    }
    m.numbers.push_back(static_cast<double>(colours.groups().size()));
    m.numbers.insert(m.numbers.end(), colours.groups().begin(), colours.groups().end());
    return kDone;
  });
}

/// input: eye, direction, up; field of view in degrees, aspect, height in pixels; pixels of error;
/// seconds to spend; the time; the level that is wanted everywhere, whatever the error (255: none).
/// numbers: points, triangles, expanded clusters, slots of vertices and
/// of triangles, whether it is settled, the worst demand, clusters and bytes read, whether what has
/// gone is still drawn, whether the same is missing as after the last frame. text: what is missing.
TERRACE_EXPORT(frame) int terrace_frame() {
  return guarded([&] {
    Module& m = module();
    const double* in = m.input.data();
    tri::View view;
    view.camera = tri::perspective_camera({point_of(in), point_of(in + 3), point_of(in + 6)}, in[9],
                                          in[10], in[11]);
    view.pixel_error = in[12];
    if (in[15] < tri::Detail::kTop) {
      constexpr double kFar = 1e30;
      view.focuses = {{{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}}, static_cast<unsigned>(in[15])}};
    }
    if (memory_left() < kLeastMemory) reserve_memory(8 * kLeastMemory);
    const viewer::SceneState s = m.scene->frame(view, in[13], in[14]);
    m.numbers = {static_cast<double>(s.points),
                 static_cast<double>(s.triangles),
                 static_cast<double>(s.expanded),
                 static_cast<double>(s.vertex_slots),
                 static_cast<double>(s.triangle_slots),
                 s.settled ? 1.0 : 0.0,
                 s.worst,
                 static_cast<double>(s.clusters),
                 static_cast<double>(s.stored_bytes),
                 s.waiting ? 1.0 : 0.0};
    tell(m.scene->missing());
    m.numbers.push_back(m.text == m.told ? 1.0 : 0.0);
    m.told = m.text;
    return kDone;
  });
}

/// numbers: blocks of vertices, their addresses, that of the vertices; the same of triangles.
TERRACE_EXPORT(changes) int terrace_changes() {
  return guarded([&] {
    const viewer::SceneChanges& c = module().scene->take_changes();
    const auto address = [](const void* at) {
      return static_cast<double>(reinterpret_cast<std::uintptr_t>(at));
    };
    module().numbers = {static_cast<double>(c.vertex_blocks.size()),
                        address(c.vertex_blocks.data()),
                        address(c.vertices.data()),
                        static_cast<double>(c.triangle_blocks.size()),
                        address(c.triangle_blocks.data()),
                        address(c.triangles.data())};
    return kDone;
  });
}

/// Computes the surface of a scan from scratch; what that changes is among the next changes().
TERRACE_EXPORT(restore) int terrace_restore(double time) {
  return guarded([&] {
    module().scene->restore(time);
    return kDone;
  });
}

/// text: sixteen hexadecimal digits.
TERRACE_EXPORT(hash) int terrace_hash() {
  return guarded([&] {
    std::uint64_t hash = module().scene->hash();
    module().text.assign(16, '0');
    for (std::size_t i = 16; i-- > 0; hash >>= 4) module().text[i] = "0123456789abcdef"[hash & 15];
    return kDone;
  });
}

/// input: origin, direction, the angle. numbers: nothing met (0) or 1; stored place; place in the
/// view frame; level; level and ordinal of the cluster; reach; how many attributes are known, and
/// these.
TERRACE_EXPORT(pick) int terrace_pick() {
  return guarded([&] {
    Module& m = module();
    const double* in = m.input.data();
    m.hit = m.scene->pick(point_of(in), point_of(in + 3), in[6]);
    m.numbers = {0};
    if (m.hit) {
      m.numbers = {1,
                   m.hit->stored[0],
                   m.hit->stored[1],
                   m.hit->stored[2],
                   m.hit->place[0],
                   m.hit->place[1],
                   m.hit->place[2],
                   static_cast<double>(m.hit->level),
                   static_cast<double>(tri::level_of(m.hit->cluster)),
                   static_cast<double>(tri::ordinal_of(m.hit->cluster)),
                   m.hit->reach,
                   static_cast<double>(m.hit->attributes.size())};
      m.numbers.insert(m.numbers.end(), m.hit->attributes.begin(), m.hit->attributes.end());
    }
    return kDone;
  });
}

#ifndef TERRACE_VIEWER_BODY
/// input: a stored place, the reach. What the store holds there at full resolution, which depends
/// on nothing that is drawn: of a raster its surface, else the nearest point within reach. numbers:
/// nothing (0) or 1; stored place; place in the view frame; level; how many attributes, and these.
TERRACE_EXPORT(probe) int terrace_probe() {
  return guarded([&] {
    Module& m = module();
    const double* in = m.input.data();
    const auto found = m.store->schema().grid ? m.probe->on_raster(in[0], in[1])
                                              : m.probe->nearest(point_of(in), in[3]);
    m.numbers = {0};
    if (found) {
      m.numbers = {1,
                   found->stored[0],
                   found->stored[1],
                   found->stored[2],
                   found->place[0],
                   found->place[1],
                   found->place[2],
                   static_cast<double>(found->level),
                   static_cast<double>(found->attributes.size())};
      m.numbers.insert(m.numbers.end(), found->attributes.begin(), found->attributes.end());
    }
    return kDone;
  });
}

/// input: two stored places, the axis upward. numbers: metres over ground; level; 1 if a raster is
/// sampled; how many points the profile has, and share of the way and height of each.
TERRACE_EXPORT(profile) int terrace_profile() {
  return guarded([&] {
    Module& m = module();
    const double* in = m.input.data();
    const auto profile =
        m.probe->profile(point_of(in), point_of(in + 3), static_cast<std::size_t>(in[6]));
    m.numbers = {profile.metres, static_cast<double>(profile.level), profile.sampled ? 1.0 : 0.0,
                 static_cast<double>(profile.points.size())};
    for (const auto& [share, height] : profile.points) {
      m.numbers.insert(m.numbers.end(), {share, height});
    }
    return kDone;
  });
}
#endif

/// Level and ordinal of a cluster. numbers: how many lines its outline has, and both ends of each.
TERRACE_EXPORT(outline) int terrace_outline(unsigned level, double ordinal) {
  return guarded([&] {
    Module& m = module();
    const auto lines =
        m.scene->outline(tri::cluster_id(level, static_cast<std::uint64_t>(ordinal)));
    m.numbers = {static_cast<double>(lines.size())};
    for (const auto& [a, b] : lines) {
      m.numbers.insert(m.numbers.end(), {static_cast<double>(a), static_cast<double>(b)});
    }
    return kDone;
  });
}

/// Pins the cluster picked last: 1 expands it, 0 collapses it, -1 releases every pin.
TERRACE_EXPORT(pin) int terrace_pin(int how) {
  return guarded([&] {
    Module& m = module();
    if (how < 0) {
      m.scene->release();
    } else if (m.hit) {
      m.scene->pin(*m.hit, how > 0 ? tri::ViewPin::expanded : tri::ViewPin::collapsed);
    }
    return kDone;
  });
}
