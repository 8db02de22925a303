// SPDX-License-Identifier: GPL-3.0-or-later
/// The functions of the WebAssembly module: one store under one camera. JavaScript supplies the
/// bytes.
///
/// A call reads arguments longer than a number from input(), where JavaScript has written them. It
/// leaves longer results for text() and numbers().

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

#include "cloud_colours.hpp"
#include "sample/store_probe.hpp"
#include "scene.hpp"
#include "stored_surface.hpp"

namespace {

using namespace terrace;

enum Status : int { kDone = 0, kMissing = 1, kFailed = 2 };

/// Maximum number of ranges reported at once; more requests would not help.
constexpr std::size_t kMostRanges = 1024;

struct Module {
  std::vector<double> input;             // doubles, for their alignment
  std::vector<stream::ByteRange> files;  // whole ones, of the store
  stream::GivenBytes given;
  std::optional<stream::Store> store;
  std::unique_ptr<viewer::Scene> scene;
  viewer::SceneState state;
  std::vector<double> numbers;
  std::string text, lacking;  // lacking: bytes missing in the last frame
  std::optional<terrain::StoreProbe> probe;
};

Module& module() {
  static Module the;
  return the;
}

const char* input_text() { return reinterpret_cast<const char*>(module().input.data()); }

void list_missing(std::span<const stream::ByteRange> ranges) {
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
    list_missing(missing.ranges());
    return kMissing;
  } catch (const std::exception& error) {
    module().text = error.what();
    return kFailed;
  }
}

/// Maximum memory of a scene besides its points, and per point: caches of clusters and bytes;
/// triangulation, heights and the arrays to draw.
constexpr std::size_t kMemory = std::size_t{128} << 20;
#ifdef TERRACE_VIEWER_BODY
constexpr std::size_t kPointMemory = 700;
#else
constexpr std::size_t kPointMemory = 200;
#endif

/// Growing the memory by any amount takes the browser many milliseconds, and malloc would request
/// one page at a time. Untouched pages cost nothing.
constexpr std::size_t kWasmPage = 65536;
/// A frame reserves more memory if less than this is free.
constexpr std::size_t kLeastMemory = std::size_t{8} << 20;

std::size_t free_memory() {
  return __builtin_wasm_memory_size(0) * kWasmPage - reinterpret_cast<std::uintptr_t>(sbrk(0));
}
void reserve_memory(std::size_t bytes) {
  const std::size_t available = free_memory();
  if (available < bytes)
    __builtin_wasm_memory_grow(0, (bytes - available + kWasmPage - 1) / kWasmPage);
}

/// Returns whether the module for bodies should take over the store.
bool is_body(const stream::Store& store, const stream::LinearMap& ground) {
#ifdef TERRACE_VIEWER_BODY
  static_cast<void>(store);
  static_cast<void>(ground);
  return true;
#else
  return terrain::is_scan(store, ground);
#endif
}

#ifdef TERRACE_VIEWER_BODY
/// Throws stream::MissingBytes unless all files of the store were given.
void need_all_files() {
  std::vector<stream::ByteRange> missing;
  for (const stream::ByteRange& file : module().files) {
    if (file.bytes > 0 && !module().given.has(file)) missing.push_back(file);
  }
  if (!missing.empty()) throw stream::MissingBytes(std::move(missing));
}
#endif

stream::Point3 point_of(const double* at) { return {at[0], at[1], at[2]}; }

}  // namespace

#define TERRACE_EXPORT(name) extern "C" __attribute__((export_name(#name), visibility("default")))

/// Returns room for this many bytes of input, valid until the next call.
TERRACE_EXPORT(input) void* terrace_input(std::size_t bytes) {
  module().input.resize(bytes / sizeof(double) + 1);
  return module().input.data();
}
/// Returns the text of the last call: after kMissing, lines of file, offset and bytes; after
/// kFailed, the error.
TERRACE_EXPORT(text) const char* terrace_text() { return module().text.data(); }
TERRACE_EXPORT(text_size) std::size_t terrace_text_size() { return module().text.size(); }
/// Returns the numbers of the last call.
TERRACE_EXPORT(numbers) const double* terrace_numbers() { return module().numbers.data(); }

/// input: a name. Adds a file of the store with its size.
TERRACE_EXPORT(add_file) int terrace_add_file(std::size_t name, double bytes) {
  return guarded([&] {
    module().given.add_file({input_text(), name}, static_cast<std::uint64_t>(bytes));
    module().files.push_back({{input_text(), name}, 0, static_cast<std::uint64_t>(bytes)});
    return kDone;
  });
}
/// input: a name, followed by the bytes from `offset` on.
TERRACE_EXPORT(give) int terrace_give(std::size_t name, double offset, std::size_t bytes) {
  return guarded([&] {
    module().given.give({input_text(), name}, static_cast<std::uint64_t>(offset),
                        std::as_bytes(std::span(input_text() + name, bytes)));
    return kDone;
  });
}
/// input: a name. Discards its bytes, which were damaged and will be fetched again.
TERRACE_EXPORT(forget) int terrace_forget(std::size_t name) {
  return guarded([&] {
    module().given.forget({input_text(), name});
    return kDone;
  });
}

/// input: the nine numbers of the map from stored coordinates to metres. numbers: the box of the
/// scene; 1 for a raster; 1 for the scan of a body; for points whether they have colours, classes,
/// intensities; the number of classes, and the classes.
TERRACE_EXPORT(open) int terrace_open(double max_points) {
  return guarded([&] {
    Module& m = module();
    stream::LinearMap ground{};
    std::memcpy(ground.data(), m.input.data(), sizeof ground);
    if (!m.store) m.store = stream::Store::open("store", m.given.open());
#ifdef TERRACE_VIEWER_BODY
    if (viewer::shows_stored_surface(*m.store)) need_all_files();
#endif
    m.probe.emplace(*m.store, ground);
    m.scene.reset();  // first, because its memory serves the next one
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

/// input: eye, direction, up; field of view in degrees, aspect, height in pixels; error in pixels;
/// seconds to spend; the time; the minimum level everywhere, whatever the error (255: none), and
/// that of a box; both corners of the box.
/// numbers: points, triangles, expanded clusters, slots of vertices and of triangles, whether it is
/// settled, the worst demand, clusters and bytes read, whether removed parts are still drawn,
/// whether the same bytes are missing as after the last frame. text: the missing bytes.
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
    if (in[16] < tri::Detail::kTop) {
      view.focuses.push_back(
          {{point_of(in + 17), point_of(in + 20)}, static_cast<unsigned>(in[16])});
    }
    if (free_memory() < kLeastMemory) reserve_memory(8 * kLeastMemory);
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
    list_missing(m.scene->missing());
    m.numbers.push_back(m.text == m.lacking ? 1.0 : 0.0);
    m.lacking = m.text;
    return kDone;
  });
}

/// numbers: the number of vertex blocks, their address, the address of the vertices; the same for
/// triangles.
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

/// Recomputes the surface of a scan; the next changes() include the result.
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

/// input: origin, direction, angle. numbers: 1 for a hit or 0; stored place; place in the view
/// frame; level; level and ordinal of the cluster; reach; level and ordinal of the cluster to
/// expand (255: none); the number of known attributes, and their values.
TERRACE_EXPORT(pick) int terrace_pick() {
  return guarded([&] {
    Module& m = module();
    const double* in = m.input.data();
    const auto hit = m.scene->pick(point_of(in), point_of(in + 3), in[6]);
    m.numbers = {0};
    if (hit) {
      m.numbers = {1,
                   hit->stored[0],
                   hit->stored[1],
                   hit->stored[2],
                   hit->place[0],
                   hit->place[1],
                   hit->place[2],
                   static_cast<double>(hit->level),
                   static_cast<double>(tri::level_of(hit->cluster)),
                   static_cast<double>(tri::ordinal_of(hit->cluster)),
                   hit->corner_distance,
                   hit->expandable ? static_cast<double>(tri::level_of(*hit->expandable)) : 255.0,
                   hit->expandable ? static_cast<double>(tri::ordinal_of(*hit->expandable)) : 0.0,
                   static_cast<double>(hit->attributes.size())};
      m.numbers.insert(m.numbers.end(), hit->attributes.begin(), hit->attributes.end());
    }
    return kDone;
  });
}

#ifndef TERRACE_VIEWER_BODY
/// input: a stored place, the reach. Reads the store there at full resolution, independent of what
/// is drawn: a raster's surface, or the nearest point within reach. numbers: 1 if found or 0;
/// stored place; place in the view frame; level; the number of attributes, and their values.
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

/// input: two stored places, the upward axis. numbers: metres over ground; level; 1 if a raster is
/// sampled; the number of points of the profile, and share of the distance and height of each.
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

/// Takes level and ordinal of a cluster. numbers: the number of lines of its outline, and both ends
/// of each.
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

/// Takes level and ordinal of a cluster. 1 keeps it expanded, 0 keeps it collapsed, -1 releases
/// every pinned cluster.
TERRACE_EXPORT(pin) int terrace_pin(unsigned level, double ordinal, int pin) {
  return guarded([&] {
    Module& m = module();
    if (pin < 0) {
      m.scene->release();
    } else {
      m.scene->pin(tri::cluster_id(level, static_cast<std::uint64_t>(ordinal)),
                   pin > 0 ? tri::ViewPin::expanded : tri::ViewPin::collapsed);
    }
    return kDone;
  });
}
