// SPDX-License-Identifier: Apache-2.0
#include "store/read/segment_reader.hpp"

#include <algorithm>
#include <cmath>

#include "io/text.hpp"

namespace terrace::stream::store {
namespace {

constexpr const char* kRestoreStore = "restore the file or rebuild the store";
/// Index pages to keep; each takes about 0.5 KB, 2 KB for point clouds.
constexpr std::uint64_t kCachedPages = 8192;
/// Pages whose ranges to keep; those of a page take 1 KB per attribute. Few are kept, because
/// callers go from page to page.
constexpr std::uint64_t kCachedRanges = 64;
/// Decoding tables to keep; each takes about 100 KB and serves about ten million points of level 0.
constexpr std::uint64_t kCachedTables = 32;
/// Upper limit of contexts in all cached tables: with very many attributes, fewer tables are kept.
constexpr std::uint64_t kCachedContexts = 512 * kCachedTables;

Error damaged_file(const ByteSource& file, std::uint64_t offset, const std::string& cause) {
  return Error(file.name(), cause).at_byte(offset).remedy(kRestoreStore);
}

/// Returns the result of work(). Throws: error_of(cause) if work() throws Damage.
template <class Work, class ErrorOf>
auto translate_damage(Work&& work, ErrorOf&& error_of) {
  try {
    return work();
  } catch (const Damage& damage) {
    throw error_of(damage.what());
  }
}

}  // namespace

std::unique_ptr<ByteSource> open_listed(const OpenByName& files, const FileEntry& entry) {
  auto file = files(entry.name);
  if (file->size() != entry.bytes) {
    throw Error(file->name(), "the manifest says " + counted(entry.bytes, "byte") +
                                  ", the file has " + std::to_string(file->size()))
        .remedy(kRestoreStore);
  }
  return file;
}

template <class Read>
auto SegmentReader::from_directory(Read&& read) const {
  return translate_damage(read, [&](const char* cause) { return damaged_file(*index_, 0, cause); });
}

SegmentReader::SegmentReader(const OpenByName& files, const Manifest& manifest, unsigned level,
                             const SegmentEntry& segment, std::uint64_t first)
    : layout_(manifest.schema, level),
      clusters_(segment.clusters),
      first_(first),
      max_points_(std::min(layout_.max_points(), manifest.levels[level].points)),
      top_(level + 1 == manifest.levels.size()),
      store_points_(manifest.points),
      bounds_(segment.bounds),
      shift_{static_cast<double>(segment.shift[0]), static_cast<double>(segment.shift[1]),
             static_cast<double>(segment.shift[2])},
      is_shifted_(segment.shift != SegmentEntry{}.shift),
      base_(segment.base),
      data_(open_listed(files, segment.data)),
      index_(open_listed(files, segment.index)),
      page_cache_(1),
      range_cache_(1),
      tables_cache_(1) {
  for (unsigned below = 0; below < level; ++below) {
    clusters_below_.push_back(manifest.levels[below].clusters);
    is_based_ = is_based_ || base_[below] > 0;
  }
  if (segment.directory_bytes > index_->size()) {
    throw damaged_file(*index_, 0, "the index is smaller than its directory");
  }
  directory_ = from_directory([&] {
    return std::make_unique<const Directory>(*index_, segment.directory_bytes, clusters_, layout_,
                                             bounds_);
  });
  const auto slots = [](std::uint64_t wanted, std::uint64_t limit) {
    return static_cast<std::size_t>(
        std::clamp<std::uint64_t>(wanted, 1, std::max<std::uint64_t>(1, limit)));
  };
  page_cache_ = SlotCache<IndexPage>(slots(pages(), kCachedPages));
  if (!layout_.attributes.empty()) {
    range_cache_ = SlotCache<RangeColumns>(slots(pages(), kCachedRanges));
  }
  tables_cache_ = SlotCache<DecodingTables>(slots(
      directory_->tables().size(), std::min(kCachedTables, kCachedContexts / layout_.contexts())));
}

std::uint64_t SegmentReader::page_offset(std::uint64_t page) const {
  return from_directory([&] { return directory_->page_range(page).begin; });
}

Box3 SegmentReader::page_box(std::uint64_t ordinal) const {
  return in_store(
      from_directory([&] { return directory_->page_box(ordinal / layout_.page_clusters()); }));
}

BytePart SegmentReader::page_box_part(std::uint64_t ordinal) const {
  return directory_->contents_part(ordinal / layout_.page_clusters());
}

BytePart SegmentReader::page_part(std::uint64_t ordinal) const {
  const auto range =
      from_directory([&] { return directory_->page_range(ordinal / layout_.page_clusters()); });
  return {range.begin, range.end - range.begin};
}

BytePart SegmentReader::cluster_part(std::uint64_t ordinal) const {
  std::uint64_t offset = 0;
  const Entry entry = this->entry(ordinal, offset);
  check_range(ordinal, offset, entry.bytes);
  return {offset, entry.bytes};
}

std::shared_ptr<const IndexPage> SegmentReader::read_page(std::uint64_t number,
                                                          SequentialBytes* ahead) const {
  const Directory::Range range = from_directory([&] { return directory_->page_range(number); });
  const std::uint64_t start = range.begin;
  const auto size = static_cast<std::size_t>(range.end - start);
  Bytes buffer;
  ByteView bytes;
  if (ahead != nullptr) {
    bytes = ahead->at(start, size);
  } else {
    buffer.resize(size);
    index_->read(start, std::as_writable_bytes(std::span(buffer)));
    bytes = buffer;
  }
  return translate_damage(
      [&] {
        const std::uint64_t page_clusters = layout_.page_clusters(), first = number * page_clusters;
        return std::make_shared<const IndexPage>(
            bytes, static_cast<std::uint32_t>(std::min(page_clusters, clusters_ - first)), layout_,
            *tables(first));
      },
      [&](const char* cause) { return damaged_file(*index_, start, cause); });
}

std::shared_ptr<const IndexPage> SegmentReader::page(std::uint64_t number) const {
  return page_cache_.get(number, [&] { return read_page(number); });
}

Entry SegmentReader::entry(std::uint64_t ordinal, std::uint64_t& offset) const {
  const auto page = this->page(ordinal / layout_.page_clusters());
  offset = page->offset(static_cast<std::uint32_t>(ordinal % layout_.page_clusters()));
  return entry(*page, ordinal);
}

Entry SegmentReader::entry(const IndexPage& page, std::uint64_t ordinal) const {
  const std::uint64_t page_clusters = layout_.page_clusters();
  return translate_damage(
      [&] {
        const Entry entry = page.entry(static_cast<std::uint32_t>(ordinal % page_clusters));
        check_entry(entry);
        return entry;
      },
      [&](const char* cause) {
        return damaged_file(*index_, page_offset(ordinal / page_clusters), cause);
      });
}

void SegmentReader::ranges(std::uint64_t ordinal, std::vector<KeyRange>& out) const {
  out.clear();
  if (layout_.attributes.empty()) return;
  const std::uint64_t number = ordinal / layout_.page_clusters();
  const auto columns = range_cache_.get(number, [&] {
    const auto page = this->page(number);
    return translate_damage(
        [&] {
          return std::make_shared<const RangeColumns>(
              page->ranges(layout_, *tables(number * layout_.page_clusters())));
        },
        [&](const char* cause) { return damaged_file(*index_, page_offset(number), cause); });
  });
  for (std::size_t a = 0; a < layout_.attributes.size(); ++a) {
    out.push_back(columns->range(static_cast<std::uint32_t>(ordinal % layout_.page_clusters()), a));
  }
}

void SegmentReader::check_entry(const Entry& entry) const {
  if (entry.points == 0) {
    if (store_points_ > 0) throw Damage("an index entry has no points");
    return;
  }
  if (entry.points > max_points_) throw Damage("an index entry has more points than possible");
  const bool counted =
      layout_.level == 0 ? entry.descendants == 0
                         : entry.descendants >= entry.points && entry.descendants <= store_points_;
  if (!counted) throw Damage("an index entry has an impossible number of descendants");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const NumberForm form = entry.forms[axis];
    if (layout_.grid && axis < 2 && form != kIntegerForm) {
      throw Damage("an index entry of a raster has columns or rows that are not integers");
    }
    // If both ends represent finite numbers, so do all integers between them, in the same order.
    const std::int64_t low = entry.low[axis];
    const auto high =
        static_cast<std::int64_t>(static_cast<std::uint64_t>(low) + (entry.size[axis] - 1));
    const bool within = form != kFloatBits || (low >= INT32_MIN && high <= INT32_MAX);
    if (high < low || !within || !std::isfinite(to_double(low, form)) ||
        !std::isfinite(to_double(high, form))) {
      throw Damage("an index entry has an impossible box");
    }
  }
}

std::shared_ptr<const DecodingTables> SegmentReader::tables(std::uint64_t ordinal) const {
  const std::vector<Directory::TablesPosition>& positions = directory_->tables();
  const auto after =
      std::upper_bound(positions.begin(), positions.end(), ordinal,
                       [](std::uint64_t value, const auto& p) { return value < p.first; });
  const Directory::TablesPosition& position = *(after - 1);
  return tables_cache_.get(static_cast<std::uint64_t>(after - 1 - positions.begin()), [&] {
    return translate_damage(
        [&] {
          return std::make_shared<const DecodingTables>(
              Tables::read(directory_->read_tables(position), layout_));
        },
        [&](const char* cause) { return damaged_file(*index_, position.offset, cause); });
  });
}

void SegmentReader::check_range(std::uint64_t ordinal, std::uint64_t offset,
                                std::uint64_t size) const {
  if (offset > data_->size() || size > data_->size() - offset) {
    throw damaged(ordinal, "its bytes are beyond the end of the file");
  }
}

Error SegmentReader::damaged(std::uint64_t ordinal, const std::string& cause) const {
  return Error(data_->name(), cause)
      .at("cluster " + std::to_string(layout_.level) + "/" + std::to_string(first_ + ordinal))
      .remedy(kRestoreStore);
}

void SegmentReader::decode(std::uint64_t ordinal, const Entry& entry, std::uint64_t offset,
                           ByteView bytes, ClusterDecoder& decoder, ClusterPoints& out) const {
  translate_damage(
      [&] {
        if (layout_.checksum(bytes) != entry.checksum) {
          throw Damage("the checksum of the bytes from " + std::to_string(offset) + " on is wrong");
        }
        decoder.decode(layout_, *tables(ordinal), entry, bytes, top_, out);
        check_points(entry, out);
        if (is_shifted_ || is_based_) move_into_store(out);
      },
      [&](const char* cause) { return damaged(ordinal, cause); });
}

void SegmentReader::check_points(const Entry& entry, const ClusterPoints& points) const {
  if (entry.points == 0) return;
  // The decoder ensures that all points are in the entry's box. If the box is inside the store's
  // bounds, as for most clusters, points need not be checked.
  const Box3 box = record_of(entry, layout_.level, 0, top_).summary.box;
  if (!bounds_.contains(box.min) || !bounds_.contains(box.max)) {
    bool inside = !points.has_representative || bounds_.contains(points.representative);
    for (const Point3& p : points.positions) inside &= bounds_.contains(p);
    if (!inside) throw Damage("a point is outside the bounds of the store");
  }
  const auto exist = [&](const std::vector<std::uint64_t>& children) {
    bool good = true;
    for (std::size_t i = 0; i < children.size(); i += layout_.level) {
      for (std::size_t below = 0; below < layout_.level; ++below) {
        // The base is not above the number of clusters.
        good &= children[i + below] < clusters_below_[below] - base_[below];
      }
    }
    return good;
  };
  if (layout_.level > 0 && !(exist(points.children) && exist(points.representative_children))) {
    throw Damage("a point heads a cluster that does not exist");
  }
}

/// Converts checked points from the segment's coordinates and ordinals to the store's.
void SegmentReader::move_into_store(ClusterPoints& points) const {
  const auto move = [this](Point3& p) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (shift_[axis] != 0.0) p[axis] += shift_[axis];  // a sum would lose the sign of zero
    }
  };
  for (Point3& p : points.positions) move(p);
  if (points.has_representative) move(points.representative);
  const auto number = [this](std::vector<std::uint64_t>& children) {
    for (std::size_t i = 0; i < children.size(); i += layout_.level) {
      for (std::size_t below = 0; below < layout_.level; ++below) {
        children[i + below] += base_[below];
      }
    }
  };
  if (layout_.level == 0) return;
  number(points.children);
  number(points.representative_children);
}

void SegmentReader::read(std::uint64_t ordinal, ReadSpace& space, ClusterPoints& out) const {
  std::uint64_t offset = 0;
  const Entry entry = this->entry(ordinal, offset);
  check_range(ordinal, offset, entry.bytes);
  space.bytes.resize(entry.bytes + 2 * kPadding);
  data_->read(offset,
              std::as_writable_bytes(std::span(space.bytes).subspan(kPadding, entry.bytes)));
  decode(ordinal, entry, offset, ByteView(space.bytes).subspan(kPadding, entry.bytes),
         space.decoder, out);
}

void SegmentReader::read(std::uint64_t ordinal, const Entry& entry, std::uint64_t offset,
                         SequentialBytes& ahead, ClusterDecoder& decoder,
                         ClusterPoints& out) const {
  check_range(ordinal, offset, entry.bytes);
  decode(ordinal, entry, offset, ahead.at(offset, entry.bytes), decoder, out);
}

}  // namespace terrace::stream::store
