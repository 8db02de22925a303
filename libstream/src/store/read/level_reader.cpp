// SPDX-License-Identifier: Apache-2.0
#include "store/read/level_reader.hpp"

#include <algorithm>
#include <cmath>

namespace terrace::stream::store {
namespace {

constexpr const char* kRestoreStore = "restore the file or build the store anew";
/// About 2 KB each.
constexpr std::uint64_t kCachedPages = 4096;
/// About 100 KB each; one set is for about ten million points of level 0.
constexpr std::uint64_t kCachedTables = 32;
/// Stores with very many attributes keep fewer.
constexpr std::uint64_t kCachedContexts = 512 * kCachedTables;
/// A writer makes one set per 1024 blocks, and no block without a cluster.
constexpr std::uint64_t kFewestClustersOfTables = 1024;

Error damaged_file(const ByteSource& file, std::uint64_t offset, const std::string& cause) {
  return Error({.file = file.name(),
                .where = "byte " + std::to_string(offset),
                .cause = cause,
                .remedy = kRestoreStore});
}

std::unique_ptr<ByteSource> open_listed(const OpenByName& files, const FileEntry& entry) {
  auto file = files(entry.name);
  if (file->size() != entry.bytes) {
    throw Error({.file = file->name(),
                 .where = {},
                 .cause = "the manifest says " + std::to_string(entry.bytes) +
                          " bytes, the file has " + std::to_string(file->size()),
                 .remedy = kRestoreStore});
  }
  return file;
}

}  // namespace

LevelReader::LevelReader(const OpenByName& files, const Manifest& manifest, unsigned level)
    : layout_(manifest.schema, level, manifest.version),
      clusters_(manifest.levels[level].clusters),
      pages_(clusters_ / layout_.page_clusters() + (clusters_ % layout_.page_clusters() != 0)),
      most_points_(std::min(layout_.most_points(), manifest.levels[level].points)),
      top_(level + 1 == manifest.levels.size()),
      store_points_(manifest.points),
      bounds_(manifest.bounds),
      data_(open_listed(files, manifest.levels[level].data)),
      index_(open_listed(files, manifest.levels[level].index)),
      page_cache_(static_cast<std::size_t>(std::clamp<std::uint64_t>(pages_, 1, kCachedPages))),
      tables_cache_(1) {
  for (unsigned below = 0; below < level; ++below) {
    clusters_below_.push_back(manifest.levels[below].clusters);
  }
  const std::uint64_t size = manifest.levels[level].directory_bytes;
  if (size > index_->size())
    throw damaged_file(*index_, 0, "the index is smaller than its directory");
  read_directory(size);
  const std::uint64_t most_cached = std::min(kCachedTables, kCachedContexts / layout_.contexts());
  tables_cache_ = SlotCache<DecodingTables>(static_cast<std::size_t>(
      std::clamp<std::uint64_t>(tables_at_.size(), 1, std::max<std::uint64_t>(1, most_cached))));
}

void LevelReader::read_directory(std::uint64_t bytes) {
  const std::uint64_t start = index_->size() - bytes;
  const std::uint64_t most_tables = 1 + clusters_ / kFewestClustersOfTables;
  const std::uint64_t page_bytes = 8 + (layout_.version > 3 ? kPageBoxBytes : 0);
  if (bytes > page_bytes * pages_ + 8 + 8 + most_tables * (20 + Tables::most_bytes(layout_))) {
    throw damaged_file(*index_, start, "the directory is too large for the level's clusters");
  }
  try {
    const std::size_t size = memory_size(bytes);
    tail_.resize(size);
    index_->read(start, std::as_writable_bytes(std::span(tail_)));
    if (size < 4 ||
        crc32(ByteView(tail_).first(size - 4)) != load<std::uint32_t>(tail_.data() + size - 4)) {
      throw Damage("the checksum of the directory is wrong");
    }
    ByteReader in(ByteView(tail_).first(size - 4));
    if (in.left() < 8 || (in.left() - 8) / page_bytes < pages_) {
      throw Damage("the directory has too few pages");
    }
    std::uint64_t previous = 0;
    for (std::uint64_t p = 0; p < pages_; ++p) {
      directory_.push_back(in.get<std::uint64_t>());
      if (directory_.back() < previous ||
          directory_.back() - previous > most_page_bytes(layout_.ranges()) ||
          directory_.back() > start || (p == 0 && directory_[0] != 0)) {
        throw Damage("the pages of the directory do not follow one another");
      }
      previous = directory_.back();
    }
    directory_.push_back(in.get<std::uint64_t>());
    if (directory_.back() != start || start - previous > most_page_bytes(layout_.ranges())) {
      throw Damage("the pages do not end where the directory begins");
    }
    for (std::uint64_t p = 0; layout_.version > 3 && p < pages_; ++p) {
      PageBox box;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        box.low[axis] = in.get<std::uint16_t>();
        box.high[axis] = in.get<std::uint16_t>();
      }
      boxes_.push_back(box.in(bounds_));
    }
    const auto count = in.get<std::uint32_t>();
    for (std::uint32_t t = 0; t < count; ++t) {
      TablesAt at;
      at.first = in.varint();
      at.size = memory_size(in.varint());
      at.offset = in.offset();
      in.take(at.size);
      if (tables_at_.empty() ? at.first != 0 : at.first <= tables_at_.back().first) {
        throw Damage("the tables do not follow one another");
      }
      if (at.first >= clusters_) throw Damage("tables are for clusters that do not exist");
      tables_at_.push_back(at);
    }
    if (in.left() != 0) throw Damage("bytes follow the directory");
    if (tables_at_.empty() && clusters_ > 0) throw Damage("the level has no tables");
  } catch (const Damage& damage) {
    throw damaged_file(*index_, start, damage.what());
  }
}

std::shared_ptr<const IndexPage> LevelReader::read_page(std::uint64_t number) const {
  const std::uint64_t start = page_offset(number);
  Bytes bytes(static_cast<std::size_t>(page_offset(number + 1) - start));
  index_->read(start, std::as_writable_bytes(std::span(bytes)));
  try {
    const std::uint64_t most = layout_.page_clusters(), first = number * most;
    return std::make_shared<const IndexPage>(
        bytes, static_cast<std::uint32_t>(std::min(most, clusters_ - first)), layout_,
        layout_.version > 3 ? tables(first).get() : nullptr);
  } catch (const Damage& damage) {
    throw damaged_file(*index_, start, damage.what());
  }
}

std::shared_ptr<const IndexPage> LevelReader::page(std::uint64_t number) const {
  return page_cache_.get(number, [&] { return read_page(number); });
}

Entry LevelReader::entry(std::uint64_t ordinal, std::uint64_t& offset) const {
  if (ordinal >= clusters_) {
    throw Error({.file = index_->name(),
                 .where = {},
                 .cause = "there is no cluster " + std::to_string(layout_.level) + "/" +
                          std::to_string(ordinal) + ", the level has " + std::to_string(clusters_),
                 .remedy = {}});
  }
  const auto page = this->page(ordinal / layout_.page_clusters());
  const auto i = static_cast<std::uint32_t>(ordinal % layout_.page_clusters());
  try {
    offset = page->offset(i);
    return entry(*page, i);
  } catch (const Damage& damage) {
    throw damaged_file(*index_, page_offset(ordinal / layout_.page_clusters()), damage.what());
  }
}

void LevelReader::ranges(std::uint64_t ordinal, std::vector<KeyRange>& out) const {
  const auto page = this->page(ordinal / layout_.page_clusters());
  out.clear();
  for (std::size_t a = 0; a < layout_.ranges(); ++a) {
    out.push_back(page->range(static_cast<std::uint32_t>(ordinal % layout_.page_clusters()), a));
  }
}

Entry LevelReader::entry(const IndexPage& page, std::uint32_t i) const {
  const Entry entry = page.entry(i);
  if (entry.points == 0) {
    if (store_points_ > 0) throw Damage("an index entry has no points");
    return entry;
  }
  if (entry.points > most_points_) throw Damage("an index entry has more points than possible");
  const bool counted =
      layout_.level == 0 ? entry.descendants == 0
                         : entry.descendants >= entry.points && entry.descendants <= store_points_;
  if (!counted) throw Damage("an index entry has an impossible number of descendants");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const NumberForm form = entry.forms[axis];
    if (layout_.grid && axis < 2 && form != kIntegerForm) {
      throw Damage("an index entry of a raster has columns or rows that are not integers");
    }
    // Between two ends that are numbers lie numbers only, in the same order.
    const std::int64_t low = entry.low[axis];
    const auto high =
        static_cast<std::int64_t>(static_cast<std::uint64_t>(low) + (entry.size[axis] - 1));
    const bool within = form != kFloatBits || (low >= INT32_MIN && high <= INT32_MAX);
    if (high < low || !within || !std::isfinite(to_double(low, form)) ||
        !std::isfinite(to_double(high, form))) {
      throw Damage("an index entry has an impossible box");
    }
  }
  return entry;
}

std::shared_ptr<const DecodingTables> LevelReader::tables(std::uint64_t ordinal) const {
  const auto next =
      std::upper_bound(tables_at_.begin(), tables_at_.end(), ordinal,
                       [](std::uint64_t value, const TablesAt& at) { return value < at.first; });
  const TablesAt& at = *(next - 1);
  return tables_cache_.get(static_cast<std::uint64_t>(next - 1 - tables_at_.begin()), [&] {
    try {
      return std::make_shared<const DecodingTables>(
          Tables::read(ByteView(tail_).subspan(at.offset, at.size), layout_));
    } catch (const Damage& damage) {
      throw damaged_file(*index_, index_->size() - tail_.size() + at.offset, damage.what());
    }
  });
}

void LevelReader::check_range(std::uint64_t ordinal, std::uint64_t offset,
                              std::uint64_t size) const {
  if (offset > data_->size() || size > data_->size() - offset) {
    throw damaged(ordinal, "its bytes are said to lie behind the end of the file");
  }
}

Error LevelReader::damaged(std::uint64_t ordinal, const std::string& cause) const {
  return Error({.file = data_->name(),
                .where = "cluster " + std::to_string(layout_.level) + "/" + std::to_string(ordinal),
                .cause = cause,
                .remedy = kRestoreStore});
}

void LevelReader::decode(std::uint64_t ordinal, const Entry& entry, std::uint64_t offset,
                         ByteView bytes, ClusterDecoder& decoder, ClusterPoints& out) const {
  try {
    if (crc16(bytes) != entry.checksum) {
      throw Damage("the checksum of the bytes from " + std::to_string(offset) + " on is wrong");
    }
    decoder.decode(layout_, *tables(ordinal), entry, bytes, top_, out);
    check_points(entry, out);
  } catch (const Damage& damage) {
    throw damaged(ordinal, damage.what());
  }
}

void LevelReader::check_points(const Entry& entry, const ClusterPoints& points) const {
  if (entry.points == 0) return;
  // The decoder leaves no point outside of the entry's box. What lies inside of the store's bounds
  // as a whole, most clusters do, needs no look at its points.
  const Box3 box = record_of(entry, layout_.level, 0, top_).summary.box;
  if (!bounds_.contains(box.min) || !bounds_.contains(box.max)) {
    bool inside = !points.has_representative || bounds_.contains(points.representative);
    for (const Point3& p : points.positions) inside &= bounds_.contains(p);
    if (!inside) throw Damage("a point lies outside of the bounds of the store");
  }
  const auto exist = [&](const std::vector<std::uint64_t>& children) {
    bool good = true;
    for (std::size_t i = 0; i < children.size(); i += layout_.level) {
      for (std::size_t below = 0; below < layout_.level; ++below) {
        good &= children[i + below] < clusters_below_[below];
      }
    }
    return good;
  };
  if (layout_.level > 0 && !(exist(points.children) && exist(points.representative_children))) {
    throw Damage("a point heads a cluster that does not exist");
  }
}

void LevelReader::read(std::uint64_t ordinal, ReadSpace& space, ClusterPoints& out) const {
  std::uint64_t offset = 0;
  const Entry entry = this->entry(ordinal, offset);
  check_range(ordinal, offset, entry.bytes);
  space.bytes.resize(entry.bytes + 2 * kPadding);
  data_->read(offset,
              std::as_writable_bytes(std::span(space.bytes).subspan(kPadding, entry.bytes)));
  decode(ordinal, entry, offset, ByteView(space.bytes).subspan(kPadding, entry.bytes),
         space.decoder, out);
}

}  // namespace terrace::stream::store
