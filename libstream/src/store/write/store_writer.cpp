// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cassert>
#include <mutex>
#include <tuple>
#include <utility>

#include <terrace/base/thread_team.hpp>

#include "io/output_placement.hpp"
#include "spares.hpp"
#include "store/read/store_impl.hpp"
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

/// Returns how a store takes the name of the part that it extends. Sets `changed` if that is not
/// the part any more.
Naming naming_after(const Store& part, const std::shared_ptr<bool>& changed) {
  return {[checksum = part.checksum(), changed](const std::filesystem::path& path) -> Ownership {
    const Ownership ownership = Store::ownership_of(path);
    *changed = ownership.ours && Store::open(path).checksum() != checksum;
    return *changed ? Ownership(false) : ownership;
  }};
}

/// Throws: Error if the name is taken by what may not be replaced.
void check_target(const std::filesystem::path& path, bool replace) {
  std::error_code error;
  if (!std::filesystem::exists(std::filesystem::status(path, error))) return;
  if (!replace) {
    throw Error(path.string(), "exists already").remedy("choose another name or remove it");
  }
  if (const Ownership ownership = Store::ownership_of(path); !ownership.ours) {
    throw not_replaced(path.string(), ownership);
  }
}

}  // namespace

struct StoreWriter::Impl {
  Impl(const std::filesystem::path& path, StoreSchema store_schema, Naming naming, unsigned threads)
      : schema(std::move(store_schema)),
        team(threads),
        staging(path, kManifestName, std::move(naming)) {
    if (schema.attributes.size() > kMaxAttributes) {
      throw Error(path.string(), "there are too many attributes");
    }
  }

  void publish() {
    try {
      staging.commit();
    } catch (const Error&) {
      if (!*changed) throw;
      throw Error(staging.target().string(), "another process changed the store meanwhile")
          .remedy("run this again");
    }
  }

  /// Takes over the clusters of a store below its root.
  void adopt(const StorePart& part);
  /// Creates a file of the new store with the contents of one of the part's.
  void adopt_file(const Store& store, const ByteSource& from, const FileEntry& entry,
                  const std::string& name) const;
  /// Renames the files of a new segment, so that its names are not those of another run's. A store
  /// that extends this one has the same files under the same names, for readers that open them
  /// late.
  void name_by_contents(unsigned level, SegmentEntry& segment) const;
  [[nodiscard]] std::uint64_t adopted_clusters(std::size_t level) const {
    return level < adopted.size() ? adopted[level].clusters : 0;
  }

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
  /// By level: what was taken over from other stores, and the writer, null if no block was
  /// appended.
  std::vector<LevelEntry> adopted;
  std::vector<std::unique_ptr<LevelWriter>> levels;
  std::uint64_t points = 0;
  double height_sum = 0.0;
  Box3 bounds;
  bool broken = false;  ///< whether append() or finish() has thrown
  /// Whether the part that the store extends is not what it was.
  std::shared_ptr<bool> changed = std::make_shared<bool>(false);

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
  if (levels.size() <= level) levels.resize(level + 1);
  if (levels[level] == nullptr) {
    levels[level] = std::make_unique<LevelWriter>(
        staging.folder(), staging.target(), Layout(schema, level), team, adopted_clusters(level));
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
    // Tables that are about to be replaced are not used any more.
    tables_by_level[level] = writer.needs_new_tables() ? nullptr : writer.tables();
  }
  broken = false;
  return ordinal;
}

void StoreWriter::Impl::adopt(const StorePart& part) {
  const Manifest& manifest = part.store.impl_->manifest;
  const unsigned top = part.store.top();
  if (top == 0) return;
  std::vector<std::uint64_t> offsets;  // of the part's ordinals in those of the new store
  for (unsigned l = 0; l < top; ++l) offsets.push_back(adopted_clusters(l));
  if (adopted.size() < top) adopted.resize(top);
  for (unsigned l = 0; l < top; ++l) {
    const LevelEntry& level = manifest.levels[l];
    for (std::size_t s = 0; s < level.segments.size(); ++s) {
      SegmentEntry segment = level.segments[s];
      const LevelReader::Handle open = part.store.impl_->levels[l]->segment(s);
      for (auto [file, from, kind] : {std::tuple(&segment.data, &open->data(), "clusters"),
                                      std::tuple(&segment.index, &open->index(), "index")}) {
        const std::string name = segment_file_name(l, segment, kind);
        adopt_file(part.store, *from, *file, name);
        file->name = name;
      }
      for (unsigned below = 0; below < l; ++below) segment.base[below] += offsets[below];
      for (std::size_t axis = 0; axis < 3; ++axis) segment.shift[axis] += part.shift[axis];
      adopted[l].segments.push_back(std::move(segment));
    }
    adopted[l].members += level.members;
    adopted[l].clusters += level.clusters;
  }
  points += manifest.points;
  height_sum += (manifest.mean_height + static_cast<double>(part.shift[2])) *
                static_cast<double>(manifest.points);
  bounds.include(shifted(manifest.bounds, part.shift));
}

void StoreWriter::Impl::adopt_file(const Store& store, const ByteSource& from,
                                   const FileEntry& entry, const std::string& name) const {
  namespace fs = std::filesystem;
  const fs::path path = staging.folder() / name;
  std::error_code error;
  if (fs::exists(path, error)) return;  // another part has the same file
  const fs::path original = fs::canonical(store.path() / entry.name, error);
  if (!error) fs::create_hard_link(original, path, error);
  if (!error) return;
  // The part is on another file system, or not in a folder.
  OutputFile file(path, staging.target());
  Bytes bytes(std::size_t{1} << 20);
  for (std::uint64_t offset = 0; offset < from.size(); offset += bytes.size()) {
    store.check_stop();
    bytes.resize(
        static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), from.size() - offset)));
    from.read(offset, std::as_writable_bytes(std::span(bytes)));
    file.write(bytes);
  }
  file.finish();
  if (file.checksum() != entry.checksum) {
    throw Error(from.name(), "the checksum of the file is wrong")
        .remedy("restore the file or rebuild the store");
  }
}

void StoreWriter::Impl::name_by_contents(unsigned level, SegmentEntry& segment) const {
  for (auto [file, kind] :
       {std::pair(&segment.data, "clusters"), std::pair(&segment.index, "index")}) {
    const std::string name = segment_file_name(level, segment, kind);
    std::error_code error;
    std::filesystem::rename(staging.folder() / file->name, staging.folder() / name, error);
    if (error) {
      throw system_error(staging.target().string(), "cannot be renamed", error.value(),
                         remedy_for(error.value()));
    }
    file->name = name;
  }
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

StoreWriter::StoreWriter(const std::filesystem::path& path, StoreSchema schema,
                         std::span<const StorePart> parts, bool replace, unsigned threads) {
  const auto extended = std::find_if(parts.begin(), parts.end(), [&](const StorePart& part) {
    std::error_code ignored;
    return std::filesystem::equivalent(part.store.path(), path, ignored);
  });
  if (extended == parts.end()) {
    check_target(path, replace);
    impl_ = std::make_unique<Impl>(path, std::move(schema), naming_of(replace), threads);
  } else {
    const auto changed = std::make_shared<bool>(false);
    impl_ = std::make_unique<Impl>(path, std::move(schema), naming_after(extended->store, changed),
                                   threads);
    impl_->changed = changed;
  }
  for (const StorePart& part : parts) impl_->adopt(part);
}

StoreWriter::StoreWriter(const std::filesystem::path& path, StoreSchema schema, bool replace,
                         unsigned threads)
    : StoreWriter(path, std::move(schema), {}, replace, threads) {}

StoreWriter::~StoreWriter() = default;

StoreWriter::EncodedPtr StoreWriter::encode(const ClusteredBlock& block) const {
  return impl_->encode(block);
}

std::uint64_t StoreWriter::append(EncodedPtr block) {
  return impl_->append(std::move(block), /*root=*/false);
}

std::uint64_t StoreWriter::clusters(unsigned level) const {
  const bool is_open = level < impl_->levels.size() && impl_->levels[level] != nullptr;
  return impl_->adopted_clusters(level) + (is_open ? impl_->levels[level]->clusters() : 0);
}

const StoreSchema& StoreWriter::schema() const { return impl_->schema; }

void StoreWriter::set_nodata(std::uint64_t cells) { impl_->schema.nodata = cells; }

std::uint64_t StoreWriter::finish(const ClusteredBlock& root, bool publish,
                                  const MakeSurface& surface) {
  Impl& w = *impl_;
  assert(root.representatives.size() == 1 && root.representatives[0] == kNoRepresentative);
  assert(std::max(w.levels.size(), w.adopted.size()) == root.level &&
         "all levels below the top have clusters, no other has");
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
    LevelEntry level = l < w.adopted.size() ? w.adopted[l] : LevelEntry();
    if (w.levels[l] != nullptr) {
      LevelWriter::Written written = w.levels[l]->finish(top, w.bounds);
      if (!w.adopted.empty()) w.name_by_contents(static_cast<unsigned>(l), written.segment);
      level.members += written.members;
      level.clusters += written.segment.clusters;
      level.segments.push_back(std::move(written.segment));
    }
    bytes += level.data_bytes() + level.index_bytes();
    manifest.levels.push_back(std::move(level));
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
  if (publish) w.publish();
  return bytes + text.size();
}

}  // namespace terrace::stream
