// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <mutex>
#include <utility>

#include <terrace/base/thread_team.hpp>

#include "spares.hpp"
#include "store/write/block_encoder.hpp"
#include "store/write/level_writer.hpp"
#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/store.hpp"
#include "terrace/stream/stored_surface.hpp"

namespace terrace::stream {

using namespace store;

class StoreWriter::Encoded {
 public:
  unsigned level = 0;
  PreparedBlock block;
  // Totals over the block's points, for level 0.
  std::uint64_t points = 0;
  double height_sum = 0.0;
  Box3 bounds;

  /// Adds the points to the totals. Two interleaved sums in a fixed order, because a single sum
  /// would wait for each addition.
  void sum_up(std::span<const Point3> positions) {
    std::array<double, 2> sums{};
    for (std::size_t i = 0; i < positions.size(); ++i) sums[i % 2] += positions[i][2];
    height_sum = sums[0] + sums[1];
    Box3 box;
    for (const Point3& p : positions) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.min[axis] = p[axis] < box.min[axis] ? p[axis] : box.min[axis];
        box.max[axis] = p[axis] > box.max[axis] ? p[axis] : box.max[axis];
      }
    }
    bounds = box;
  }
};

void StoreWriter::EncodedDeleter::operator()(Encoded* block) const { delete block; }

namespace {

Naming naming_of(bool replace) {
  if (!replace) return {};
  return {Store::ownership_of};
}

}  // namespace

struct StoreWriter::Impl {
  Impl(const std::filesystem::path& path, StoreSchema store_schema, bool replace_old,
       unsigned threads)
      : schema(std::move(store_schema)),
        team(threads),
        staging(path, kManifestName, naming_of(replace_old)) {}

  SharedTablesPtr tables(unsigned level) {
    const std::lock_guard lock(mutex);
    return level < tables_by_level.size() ? tables_by_level[level] : nullptr;
  }
  EncodedPtr encode(const ClusteredBlock& block);
  std::uint64_t append(EncodedPtr encoded, bool root);
  /// manifest: the text that it would have without a surface.
  SurfaceEntry write_surface(const std::string& manifest, const MakeSurface& make);

  StoreSchema schema;
  base::ThreadTeam team;  ///< for training
  AtomicFolder staging;
  std::vector<std::unique_ptr<LevelWriter>> levels;
  std::uint64_t points = 0;
  double height_sum = 0.0;
  Box3 bounds;
  bool broken = false;  ///< whether append() or finish() has thrown

  // Shared between threads.
  Spares<BlockEncoder> encoders;
  std::mutex mutex;
  std::vector<SharedTablesPtr> tables_by_level;
};

StoreWriter::EncodedPtr StoreWriter::Impl::encode(const ClusteredBlock& block) {
  assert(block.first.size() == block.representatives.size() + 1);
  assert(block.payload.size() == block.positions.size() * schema.payload_size());
  assert(block.children.size() == block.positions.size() * block.level);
  EncodedPtr encoded(new Encoded);
  encoded->level = block.level;
  encoded->block.clusters = block.representatives.size();
  encoded->points = block.positions.size();
  if (block.level == 0) encoded->sum_up(block.positions);
  if (const SharedTablesPtr shared = tables(block.level)) {
    const Layout layout(schema, block.level);
    auto encoder = encoders.take();
    encoder->load(layout, block);
    encoder->encode(shared->encoding, shared->sequence, encoded->block.bytes,
                    encoded->block.entries, encoded->block.ranges);
    encoded->block.tables = shared;
    encoded->block.summaries.assign(block.summaries.begin(), block.summaries.end());
    encoders.put(std::move(encoder));
  } else {
    encoded->block.raw = std::make_unique<RawBlock>(block);
  }
  return encoded;
}

std::uint64_t StoreWriter::Impl::append(EncodedPtr encoded, bool root) {
  assert(encoded != nullptr);
  if (broken) {
    throw Error(staging.target().string(), "an earlier write failed");
  }
  broken = true;  // until this call succeeds
  const unsigned level = encoded->level;
  while (levels.size() <= level) {
    levels.push_back(
        std::make_unique<LevelWriter>(staging.folder(), staging.target(),
                                      Layout(schema, static_cast<unsigned>(levels.size())), team));
  }
  if (level == 0) {
    points += encoded->points;
    height_sum += encoded->height_sum;
    bounds.include(encoded->bounds);
  }
  LevelWriter& writer = *levels[level];
  const std::uint64_t ordinal = writer.append(std::move(encoded->block), root);
  {
    const std::lock_guard lock(mutex);
    if (tables_by_level.size() < levels.size()) tables_by_level.resize(levels.size());
    // At the end of a segment its tables are about to be replaced, so blocks are not encoded with
    // them.
    tables_by_level[level] = writer.at_segment_start() ? nullptr : writer.tables();
  }
  broken = false;
  return ordinal;
}

SurfaceEntry StoreWriter::Impl::write_surface(const std::string& manifest,
                                              const MakeSurface& make) {
  const auto files = [&](const std::string& name) {
    if (name != kManifestName) return open_file(staging.folder() / name);
    const auto text = std::as_bytes(std::span(manifest));
    return bytes_in_memory(name, {text.begin(), text.end()});
  };
  const Store store = Store::open(staging.target().string(), files);
  const ClusterOrder order = cluster_order(store);
  const StoredSurface surface = make(store, order);
  const std::vector<std::byte> bytes = encode_surface(order, surface);
  SurfaceEntry entry;
  entry.triangles = surface.triangles.size();
  const std::vector<bool> used = surface.on_surface();
  entry.vertices = static_cast<std::uint64_t>(std::count(used.begin(), used.end(), true));
  OutputFile file(staging.folder() / kSurfaceName, staging.target());
  file.write({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  file.finish();
  entry.file = {kSurfaceName, file.size(), file.checksum()};
  return entry;
}

StoreWriter::StoreWriter(const std::filesystem::path& path, StoreSchema schema, bool replace,
                         unsigned threads) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::exists(status)) {
    if (!replace) {
      throw Error(path.string(), "exists already").remedy("choose another name or remove it");
    }
    if (const Ownership ownership = Store::ownership_of(path); !ownership.ours) {
      throw not_replaced(path.string(), ownership);
    }
  }
  if (schema.attributes.size() > kMaxAttributes) {
    throw Error(path.string(), "there are too many attributes");
  }
  impl_ = std::make_unique<Impl>(path, std::move(schema), replace, threads);
}

StoreWriter::~StoreWriter() = default;

StoreWriter::EncodedPtr StoreWriter::encode(const ClusteredBlock& block) const {
  return impl_->encode(block);
}

std::uint64_t StoreWriter::append(EncodedPtr block) {
  return impl_->append(std::move(block), /*root=*/false);
}

std::uint64_t StoreWriter::clusters(unsigned level) const {
  return level < impl_->levels.size() ? impl_->levels[level]->clusters() : 0;
}

const StoreSchema& StoreWriter::schema() const { return impl_->schema; }

void StoreWriter::set_nodata(std::uint64_t cells) { impl_->schema.nodata = cells; }

std::uint64_t StoreWriter::finish(const ClusteredBlock& root, bool publish,
                                  const MakeSurface& surface) {
  Impl& w = *impl_;
  assert(root.representatives.size() == 1 && root.representatives[0] == kNoRepresentative);
  assert(w.levels.size() == root.level && "all levels below the top have clusters, no other has");
  if (w.points > 0 && !is_finite_in_crs(w.schema, w.bounds)) {
    throw Error(
        w.staging.target().string(),
        "its coordinates are not finite in the CRS: scale or offset of the input are too large")
        .remedy("correct the scale and the offset of the input");
  }

  const std::uint64_t top_points = root.positions.size();
  RawBlock block(root);
  if (block.summaries.empty() && root.level > 0) {
    block.summaries.push_back({.box = w.bounds, .error = 0.0, .descendants = w.points});
  }
  w.append(w.encode(block.view()), /*root=*/true);
  w.broken = true;

  Manifest manifest;
  manifest.points = w.points;
  manifest.bounds = w.bounds;
  manifest.mean_height = w.points == 0 ? 0.0 : w.height_sum / static_cast<double>(w.points);
  std::uint64_t bytes = 0;
  for (std::size_t l = 0; l < w.levels.size(); ++l) {
    const bool top = l == root.level;
    manifest.levels.push_back(w.levels[l]->finish(top, w.bounds));
    bytes += manifest.levels[l].data.bytes + manifest.levels[l].index.bytes;
  }
  for (std::size_t l = manifest.levels.size(); l-- > 0;) {
    manifest.levels[l].points =
        manifest.levels[l].members +
        (l + 1 < manifest.levels.size() ? manifest.levels[l + 1].points : 0);
  }
  assert(manifest.levels.back().points == top_points);
  static_cast<void>(top_points);
  manifest.schema = std::move(w.schema);
  std::string text = to_text(manifest);
  if (surface) {
    manifest.surface = w.write_surface(text, surface);
    bytes += manifest.surface->file.bytes;
    text = to_text(manifest);
  }
  w.schema = std::move(manifest.schema);
  // Checks that the manifest can be read, which also finds wrong counts of the caller.
  const auto path = w.staging.folder() / kManifestName;
  static_cast<void>(parse_manifest(text, w.staging.target().string()));
  OutputFile file(path, w.staging.target());
  file.write({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  file.finish();
  if (publish) w.staging.commit();
  return bytes + text.size();
}

}  // namespace terrace::stream
