// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/store.hpp"

#include <utility>

#include "store/read/segment_reader.hpp"
#include "store/read/store_impl.hpp"
#include "store/read/view.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {

using namespace store;

Store::Store(std::shared_ptr<Impl> impl) : impl_(std::move(impl)) {}

Store Store::with_stop(std::stop_token stop) const {
  Store other = *this;
  other.stop_ = std::move(stop);
  return other;
}

void Store::check_stop() const {
  if (stop_.stop_requested()) throw Stopped();
}

const Where* Store::condition() const { return view_ ? &view_->condition() : nullptr; }

Store Store::whole() const {
  Store other = *this;
  other.view_.reset();
  return other;
}

bool Store::may_match(ClusterId id) const { return !view_ || view_->may_match(*this, id); }

Store Store::open(const std::string& name, const OpenByName& files) {
  auto impl = std::make_shared<Impl>();
  impl->path = name;
  impl->manifest_file = files(kManifestName);
  const std::string text = read_manifest(*impl->manifest_file);
  impl->manifest = parse_manifest(text, impl->manifest_file->name());
  impl->bytes = text.size();
  for (unsigned l = 0; l < impl->manifest.levels.size(); ++l) {
    const LevelEntry& level = impl->manifest.levels[l];
    impl->infos.push_back({.level = l,
                           .points = level.points,
                           .members = level.members,
                           .clusters = level.clusters,
                           .bytes = level.data_bytes() + level.index_bytes(),
                           .index_bytes = level.index_bytes(),
                           .segments = level.segments.size()});
    impl->bytes += impl->infos.back().bytes;
    impl->levels.push_back(std::make_unique<LevelReader>(files, impl->manifest, l));
  }
  if (impl->manifest.surface) {
    impl->bytes += impl->manifest.surface->file.bytes;
    impl->files = files;
  }
  return Store(std::move(impl));
}

const StoreSchema& Store::schema() const { return impl_->manifest.schema; }
int Store::version() const { return impl_->manifest.version; }
const std::filesystem::path& Store::path() const { return impl_->path; }
unsigned Store::top() const { return static_cast<unsigned>(impl_->levels.size()) - 1; }
std::span<const LevelInfo> Store::levels() const { return impl_->infos; }
std::uint64_t Store::points() const { return impl_->manifest.points; }
std::optional<SurfaceInfo> Store::surface() const {
  if (!impl_->manifest.surface) return std::nullopt;
  const SurfaceEntry& surface = *impl_->manifest.surface;
  return SurfaceInfo{surface.vertices, surface.triangles, surface.file.bytes};
}
std::uint32_t Store::checksum() const { return impl_->manifest.checksum; }
std::uint64_t Store::bytes() const { return impl_->bytes; }
const Box3& Store::bounds() const { return view_ ? view_->bounds(*this) : impl_->manifest.bounds; }
double Store::mean_height() const { return impl_->manifest.mean_height; }
ClusterId Store::root() const { return cluster_id(top(), 0); }

ClusterRecord Store::record(ClusterId id) const {
  check_stop();
  const auto [segment, ordinal] = impl_->level(level_of(id)).find(ordinal_of(id));
  std::uint64_t offset = 0;
  const Entry entry = segment->entry(ordinal, offset);
  return segment->record(entry, offset);
}

Box3 Store::coarse_box(ClusterId id) const {
  const auto [segment, ordinal] = impl_->level(level_of(id)).find(ordinal_of(id));
  return segment->coarse_box(ordinal);
}

Box3 Store::page_box(ClusterId id) const {
  const auto [segment, ordinal] = impl_->level(level_of(id)).find(ordinal_of(id));
  return segment->page_box(ordinal);
}

std::vector<ValueRange> Store::attribute_ranges(ClusterId id) const {
  check_stop();
  const auto [segment, ordinal] = impl_->level(level_of(id)).find(ordinal_of(id));
  std::uint64_t offset = 0;
  static_cast<void>(segment->entry(ordinal, offset));
  std::vector<KeyRange> keys;
  segment->ranges(ordinal, keys);
  std::vector<ValueRange> ranges;
  for (std::size_t a = 0; a < keys.size(); ++a) {
    ranges.push_back(value_range(schema().attributes[a], keys[a]));
  }
  return ranges;
}

bool Store::is_remote() const {
  return impl_->levels.front()->segment(0)->data().prefetch_bytes() > 0;
}

std::size_t Store::prefetch(Part part, unsigned number,
                            std::span<const std::uint64_t> ordinals) const {
  if (!is_remote() || ordinals.empty()) return ordinals.size();
  check_stop();
  const LevelReader::Handle segment = impl_->level(number).find(ordinals.front()).segment;
  const ByteSource& file = part == Part::cluster ? segment->data() : segment->index();
  std::vector<BytePart> parts;
  std::uint64_t bytes = 0;
  std::size_t taken = 0;
  for (; taken < ordinals.size(); ++taken) {
    const std::uint64_t id = ordinals[taken];
    if (id < segment->first() || id - segment->first() >= segment->clusters()) break;
    const std::uint64_t ordinal = id - segment->first();
    if (part == Part::cluster && number == 0 && !may_match(cluster_id(number, id))) continue;
    const BytePart next = part == Part::cluster  ? segment->cluster_part(ordinal)
                          : part == Part::record ? segment->page_part(ordinal)
                                                 : segment->page_box_part(ordinal);
    // Many clusters share a page.
    if (!parts.empty() && parts.back().offset == next.offset) continue;
    if (!parts.empty() && bytes + next.bytes > file.prefetch_bytes()) break;
    bytes += next.bytes;
    parts.push_back(next);
  }
  file.prefetch(parts);
  return taken;
}

void Store::read(ClusterId id, ClusterPoints& out) const {
  check_stop();
  const auto [segment, ordinal] = impl_->level(level_of(id)).find(ordinal_of(id));
  auto space = impl_->spaces.take();
  segment->read(ordinal, *space, out);
  impl_->spaces.put(std::move(space));
  mark(out);
}

void Store::mark(ClusterPoints& points) const {
  points.matches.clear();
  if (view_) view_->mark(points);
}

void Store::for_each(unsigned number, const VisitCluster& visit) const {
  const std::uint64_t members = impl_->infos[number].members;
  std::uint64_t visited = 0;
  const auto count = [&](ClusterId id, const ClusterRecord& record, const ClusterPoints& points) {
    visited += record.points;
    if (visited > members) throw miscounted(number);
    visit(id, record, points);
  };
  if (for_each(number, 0, impl_->level(number).clusters(), count) != members) {
    throw miscounted(number);
  }
}

std::uint64_t Store::for_each(unsigned number, std::uint64_t first, std::uint64_t end,
                              const VisitCluster& visit) const {
  auto space = impl_->spaces.take();
  ClusterPoints points;
  std::uint64_t members = 0;
  impl_->level(number).for_each_segment(
      first, end,
      [&](const SegmentReader& segment, std::uint64_t segment_first, std::uint64_t segment_end) {
        SequentialBytes ahead(segment.data());
        const auto visit_page = [&](const IndexPage& page, std::uint64_t page_first,
                                    std::uint64_t page_end) {
          for (std::uint64_t ordinal = page_first; ordinal < page_end; ++ordinal) {
            check_stop();
            const std::uint64_t offset =
                page.offset(static_cast<std::uint32_t>(ordinal % segment.layout().page_clusters()));
            const ClusterId id = cluster_id(number, segment.first() + ordinal);
            const Entry entry = segment.entry(page, ordinal);
            const ClusterRecord record = segment.record(entry, offset);
            members += record.points;
            if (number == 0 && !may_match(id)) continue;
            segment.read(ordinal, entry, offset, ahead, space->decoder, points);
            mark(points);
            visit(id, record, points);
          }
        };
        segment.for_each_page(segment_first, segment_end, visit_page);
      });
  impl_->spaces.put(std::move(space));
  return members;
}

Error Store::miscounted(unsigned level) const {
  return Error(impl_->level(level).segment(0)->data().name(),
               "the clusters do not have the " + std::to_string(impl_->infos[level].members) +
                   " members that the manifest lists")
      .remedy("restore the file or rebuild the store");
}

}  // namespace terrace::stream
