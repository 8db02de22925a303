// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <type_traits>

#include <fmt/core.h>
#include <terrace/base/random.hpp>
#include <terrace/base/thread_team.hpp>

#include "store/codec/bytes.hpp"
#include "store/read/level_reader.hpp"
#include "store/read/segment_reader.hpp"
#include "store/read/store_impl.hpp"
#include "terrace/stream/stored_surface.hpp"
#include "with_type.hpp"

namespace terrace::stream::store {
namespace {

/// Returns a hash of the point that heads cluster `ordinal`. children: the clusters that it heads
/// on the levels below.
std::uint64_t hash_of(std::uint64_t ordinal, const Point3& p, std::span<const std::byte> payload,
                      std::span<const std::uint64_t> children) {
  std::uint64_t h = base::splitmix64(ordinal);
  for (const double c : p) h = base::mix64(h ^ std::bit_cast<std::uint64_t>(c));
  for (const std::uint64_t child : children) h = base::mix64(h ^ (child + base::kGoldenGamma));
  return base::mix64(h ^ crc32(0, payload.data(), payload.size()));
}

/// Pages that a thread checks before results are merged.
constexpr unsigned kPagesPerThread = 4;

/// Sums over the clusters of a level.
struct LevelSums {
  std::uint64_t members = 0;
  std::vector<bool> headed;  ///< whether the head of each cluster has been found above
  // Sums of the hashes of the representatives, and of the points that head clusters. They are equal
  // if every point that heads a cluster equals the cluster's representative in all values.
  std::uint64_t representatives = 0, heads = 0;
};

/// Returns the key of the value at `bytes`.
std::uint64_t key_of(ScalarType type, const std::byte* bytes) {
  return with_type(type, [bytes](auto value) {
    std::memcpy(&value, bytes, sizeof value);
    if constexpr (std::is_floating_point_v<decltype(value)>) {
      return attribute_key(static_cast<double>(value));
    } else if constexpr (std::is_same_v<decltype(value), std::uint64_t>) {
      return value;
    } else {
      return attribute_key(static_cast<std::int64_t>(value));
    }
  });
}

/// Whether `outer` contains `inner`, the box of a cluster with points.
bool holds(const Box3& outer, const Box3& inner) {
  return outer.contains(inner.min) && outer.contains(inner.max);
}

/// Checks a store: its manifest, the checksums of its files, its levels, and then the hierarchy.
class Verification {
 public:
  Verification(const Store& store, const ByteSource& manifest_file, const Manifest& manifest,
               const std::vector<std::unique_ptr<LevelReader>>& levels, const std::stop_token& stop,
               unsigned threads, const std::function<void(const Problem&)>& report)
      : store_(store),
        manifest_file_(manifest_file),
        manifest_(manifest),
        levels_(levels),
        stop_(stop),
        report_(report),
        team_(threads) {}

  bool run() {
    check_manifest();
    sums_.resize(levels_.size());
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      sums_[l].headed.resize(memory_size(levels_[l]->clusters()));
      max_clusters_read_ += levels_.size() * levels_[l]->clusters();
    }
    check_files();
    for (unsigned l = 0; l < levels_.size(); ++l) check_level(l);
    for (std::size_t l = 0; l + 1 < levels_.size(); ++l) check_heads(l);
    check_totals();
    if (manifest_.surface) check_surface();
    return good_;
  }

 private:
  /// The results of checking a page of the index.
  struct Page {
    std::shared_ptr<const IndexPage> index;  ///< null if it could not be read
    std::vector<Problem> problems;
    std::uint64_t members = 0, representatives = 0;  ///< see LevelSums
    Box3 bounds;
    double height_sum = 0.0;

    void problem(const std::string& file, std::uint64_t offset, std::string what) {
      problems.push_back({.file = file, .offset = offset, .what = std::move(what)});
    }
    void enter_height(const Point3& p) {
      bounds.include(p);
      height_sum += p[2];
    }
  };
  /// State of a thread that reads clusters.
  struct ReaderState {
    explicit ReaderState(const SegmentReader& segment) : ahead(segment.data()) {}

    SequentialBytes ahead;
    ClusterDecoder decoder;
    ClusterPoints points;
    std::vector<KeyRange> ranges;
  };

  void problem(const std::string& file, std::uint64_t offset, std::string what) {
    report({.file = file, .offset = offset, .what = std::move(what)});
  }
  void report(const Problem& problem) {
    good_ = false;
    if (report_) report_(problem);
  }
  std::string about_cluster(unsigned level, std::uint64_t ordinal, const std::string& what) const {
    return fmt::format("cluster {}/{}: {}", level, ordinal, what);
  }

  void check_stop() const {
    if (stop_.stop_requested()) throw Stopped();
  }

  void check_manifest() {
    try {
      if (!is_as_written(read_manifest(manifest_file_), manifest_)) {
        problem(manifest_file_.name(), 0, "the manifest's keys or their order are wrong");
      }
    } catch (const Error& error) {
      problem(manifest_file_.name(), 0, error.what());
    }
  }

  void check_files() {
    struct File {
      std::size_t level = 0, segment = 0;
      bool is_index = false;
    };
    std::vector<File> files;
    for (std::size_t l = 0; l < levels_.size(); ++l) {
      for (std::size_t s = 0; s < levels_[l]->segments(); ++s) {
        files.push_back({l, s, false});
        files.push_back({l, s, true});
      }
    }
    std::vector<std::vector<Problem>> problems(files.size());
    team_.run(problems.size(), [&](std::size_t i, std::size_t) {
      const auto& [l, s, is_index] = files[i];
      const SegmentEntry& expected = manifest_.levels[l].segments[s];
      try {
        const LevelReader::Handle segment = levels_[l]->segment(s);
        check_file(is_index ? segment->index() : segment->data(),
                   (is_index ? expected.index : expected.data).checksum, problems[i]);
      } catch (const Error& error) {
        problems[i].push_back({.file = (is_index ? expected.index : expected.data).name,
                               .offset = 0,
                               .what = error.what()});
      }
    });
    for (const std::vector<Problem>& found : problems) {
      for (const Problem& problem : found) report(problem);
    }
  }

  void check_file(const ByteSource& file, std::uint32_t expected,
                  std::vector<Problem>& problems) const {
    const auto problem = [&](std::string what) {
      problems.push_back({.file = file.name(), .offset = 0, .what = std::move(what)});
    };
    try {
      Bytes bytes(1u << 20);
      std::uint32_t checksum = 0;
      for (std::uint64_t offset = 0; offset < file.size(); offset += bytes.size()) {
        check_stop();
        bytes.resize(
            static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), file.size() - offset)));
        file.read(offset, std::as_writable_bytes(std::span(bytes)));
        checksum = crc32(checksum, bytes.data(), bytes.size());
      }
      if (checksum != expected) problem("the checksum of the file is wrong");
    } catch (const Error& error) {
      problem(error.what());
    }
  }

  void check_surface() {
    try {
      static_cast<void>(store_.read_surface(cluster_order(store_)));
    } catch (const Error& error) {
      problem(manifest_.surface->file.name, 0, error.what());
    }
  }

  /// The pages of level 0, which has nearly all clusters and none below, are checked in parallel.
  /// Those of other levels, which determine the heads of clusters below, are checked one after
  /// another.
  void check_level(unsigned l) {
    for (std::size_t s = 0; s < levels_[l]->segments(); ++s) {
      try {
        check_segment(l, *levels_[l]->segment(s));
      } catch (const Error& error) {
        problem(manifest_.levels[l].segments[s].index.name, 0, error.what());
      }
    }
    if (sums_[l].members != manifest_.levels[l].members) {
      problem(manifest_file_.name(), 0,
              fmt::format("level {} has {} members, not {}", l, sums_[l].members,
                          manifest_.levels[l].members));
    }
  }

  void check_segment(unsigned l, const SegmentReader& segment) {
    std::vector<ReaderState> readers;
    for (unsigned worker = 0; worker < team_.threads(); ++worker) readers.emplace_back(segment);
    std::vector<Page> pages(l == 0 ? std::size_t{kPagesPerThread} * team_.threads() : 1);
    std::uint64_t data_end = 0;
    for (std::uint64_t first = 0; first < segment.pages(); first += pages.size()) {
      const std::uint64_t count = std::min<std::uint64_t>(pages.size(), segment.pages() - first);
      team_.run(static_cast<std::size_t>(count), [&](std::size_t i, std::size_t worker) {
        pages[i] = {};
        check_page(l, segment, first + i, readers[worker], pages[i]);
      });
      for (std::uint64_t i = 0; i < count; ++i) add_page(l, segment, first + i, pages[i], data_end);
    }
    if (data_end != segment.data().size()) {
      problem(segment.data().name(), data_end, "the clusters do not end where the file does");
    }
  }

  void add_page(unsigned l, const SegmentReader& segment, std::uint64_t number, const Page& page,
                std::uint64_t& data_end) {
    if (page.index) {
      for (std::uint32_t i = 0; i < page.index->clusters(); ++i) {
        // A cluster may have bytes of earlier clusters; otherwise clusters are contiguous.
        const std::uint64_t offset = page.index->offset(i), end = page.index->end(i);
        if (offset != data_end && !(segment.layout().small() && end <= data_end)) {
          const std::uint64_t ordinal = number * segment.layout().page_clusters() + i;
          problem(segment.data().name(), offset,
                  about_cluster(l, segment.first() + ordinal, "its bytes are not contiguous"));
        }
        data_end = std::max(data_end, end);
      }
    }
    for (const Problem& problem : page.problems) report(problem);
    sums_[l].members += page.members;
    sums_[l].representatives += page.representatives;
    bounds_.include(page.bounds);
    height_sum_ += page.height_sum;
  }

  void check_page(unsigned l, const SegmentReader& segment, std::uint64_t number,
                  ReaderState& reader, Page& page) {
    check_stop();
    std::uint64_t page_offset = 0;
    try {
      page_offset = segment.page_offset(number);
      page.index = segment.page(number);
    } catch (const Error& error) {
      return page.problem(segment.index().name(), page_offset, error.what());
    } catch (const Damage& damage) {
      return page.problem(segment.index().name(), page_offset, damage.what());
    }
    for (std::uint32_t i = 0; i < page.index->clusters(); ++i) {
      const std::uint64_t ordinal = number * segment.layout().page_clusters() + i;
      const std::uint64_t offset = page.index->offset(i);
      try {
        const Entry entry = segment.entry(*page.index, ordinal);
        segment.read(ordinal, entry, offset, reader.ahead, reader.decoder, reader.points);
        check_cluster(l, segment, ordinal, segment.record(entry, offset), reader.points, page);
        check_ranges(l, segment, ordinal, offset, reader, page);
      } catch (const Error& error) {
        page.problem(segment.data().name(), offset, error.what());
      }
    }
  }

  void check_ranges(unsigned l, const SegmentReader& segment, std::uint64_t ordinal,
                    std::uint64_t offset, ReaderState& reader, Page& page) const {
    const ClusterPoints& points = reader.points;
    segment.ranges(ordinal, reader.ranges);
    const std::size_t stride = segment.layout().payload_size;
    std::size_t at = 0;
    for (std::size_t a = 0; a < reader.ranges.size(); ++a) {
      const ScalarType type = segment.layout().attributes[a];
      const auto inside = [&](const std::byte* record) {
        const std::uint64_t key = key_of(type, record + at);
        return reader.ranges[a].low <= key && key <= reader.ranges[a].high;
      };
      bool all_inside = !points.has_representative || inside(points.representative_payload.data());
      for (std::size_t i = 0; i < points.size(); ++i) {
        all_inside &= inside(points.payload.data() + i * stride);
      }
      if (!all_inside) {
        page.problem(
            segment.data().name(), offset,
            about_cluster(l, segment.first() + ordinal,
                          fmt::format("values of attribute {} are outside their range", a)));
      }
      at += size_of(type);
    }
  }

  void check_cluster(unsigned l, const SegmentReader& segment, std::uint64_t number,
                     const ClusterRecord& record, const ClusterPoints& points, Page& page) {
    const std::uint64_t ordinal = segment.first() + number;
    const auto problem = [&](const std::string& what) {
      page.problem(segment.data().name(), record.offset, about_cluster(l, ordinal, what));
    };
    page.members += points.size();
    const ClusterSummary& summary = record.summary;
    bool inside = true;
    for (const Point3& p : points.positions) inside &= summary.box.contains(p);
    if (points.has_representative) inside &= summary.box.contains(points.representative);
    if (!inside) problem("a point is outside its box");
    Box3 clipped = summary.box;
    const Box3 bounds = segment.bounds();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      clipped.min[axis] = std::max(clipped.min[axis], bounds.min[axis]);
      clipped.max[axis] = std::min(clipped.max[axis], bounds.max[axis]);
    }
    if (points.size() + points.has_representative > 0 &&
        !holds(segment.page_box(number), clipped)) {
      problem("the box exceeds its page's");
    }
    if (!(summary.error >= 0)) {
      problem("the error is negative or NaN");
    }
    if (points.has_representative) {
      page.representatives += hash_of(ordinal, points.representative, points.representative_payload,
                                      points.representative_children);
    }
    if (l == 0) {
      for (const Point3& p : points.positions) page.enter_height(p);
      if (points.has_representative) page.enter_height(points.representative);
      return;
    }
    check_children(l, record, points, problem);
  }

  /// Checks the clusters below one of level l > 0, and enters them into the sums of their levels.
  template <class OnProblem>
  void check_children(unsigned l, const ClusterRecord& record, const ClusterPoints& points,
                      const OnProblem& problem) {
    const auto& summary = record.summary;
    const std::size_t stride = levels_[l]->layout().payload_size;
    std::uint64_t descendants = 0;
    std::vector<std::uint64_t> uncertain;  // clusters below whose boxes exceed this one's
    const auto check_child = [&](std::uint64_t child) {
      const ClusterSummary below = store_.record(cluster_id(l - 1, child)).summary;
      descendants += below.descendants;
      if (!holds(summary.box, below.box)) uncertain.push_back(child);
    };
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::span<const std::byte> payload(points.payload.data() + i * stride, stride);
      for (unsigned j = 0; j < l; ++j) {
        const std::uint64_t child = points.children[i * l + j];
        std::vector<bool>::reference headed = sums_[j].headed[static_cast<std::size_t>(child)];
        if (headed) {
          problem(fmt::format("cluster {}/{} has two parent points", j, child));
        }
        headed = true;
        sums_[j].heads += hash_of(child, points.positions[i], payload,
                                  std::span(points.children).subspan(i * l, j));
      }
      check_child(points.children[i * l + l - 1]);
    }
    if (points.has_representative) check_child(points.representative_children[l - 1]);
    if (descendants != summary.descendants) {
      problem("the descendants do not add up");
    }
    if (!std::all_of(uncertain.begin(), uncertain.end(), [&](std::uint64_t child) {
          return contains_descendants(summary.box, l - 1, child);
        })) {
      problem("a cluster below exceeds its box");
    }
  }

  /// Checks the points of the few clusters whose boxes were enlarged beyond that of the cluster
  /// above. Children have not been checked yet and may form cycles, so for each level above at most
  /// as many clusters are read as the store has.
  bool contains_descendants(const Box3& box, unsigned l, std::uint64_t ordinal) {
    if (++clusters_read_ > max_clusters_read_) return false;
    ClusterPoints points;
    store_.read(cluster_id(l, ordinal), points);
    const auto inside = [&](const Point3& p, const std::uint64_t* children) {
      if (!box.contains(p)) return false;
      return l == 0 || holds(box, store_.record(cluster_id(l - 1, children[l - 1])).summary.box) ||
             contains_descendants(box, l - 1, children[l - 1]);
    };
    if (!inside(points.representative, points.representative_children.data())) return false;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!inside(points.positions[i], points.children.data() + i * l)) return false;
    }
    return true;
  }

  void check_heads(std::size_t l) {
    const LevelSums& sums = sums_[l];
    const auto orphan = std::find(sums.headed.begin(), sums.headed.end(), false);
    if (orphan != sums.headed.end()) {
      problem(name_of(l), 0,
              about_cluster(static_cast<unsigned>(l),
                            static_cast<std::uint64_t>(orphan - sums.headed.begin()),
                            "has no parent point"));
    } else if (sums.heads != sums.representatives) {
      problem(name_of(l), 0,
              fmt::format("the representatives of level {} differ from their parent points", l));
    }
  }

  /// Returns the name of the file of a level's first clusters.
  [[nodiscard]] std::string name_of(std::size_t level) const {
    return levels_[level]->segment(0)->data().name();
  }

  void check_totals() {
    const auto manifest = manifest_file_.name();
    if (bounds_ != manifest_.bounds) problem(manifest, 0, "the bounds are not those of the points");
    if (manifest_.points == 0) return;
    const double mean = height_sum_ / static_cast<double>(manifest_.points);
    const double size = std::max({std::abs(bounds_.min[2]), std::abs(bounds_.max[2]), 1e-300});
    // The sums were computed in different orders.
    if (std::isfinite(mean) && !(std::abs(mean - manifest_.mean_height) <= 1e-9 * size)) {
      problem(manifest, 0, "the mean height is not that of the points");
    }
  }

  const Store& store_;
  const ByteSource& manifest_file_;
  const Manifest& manifest_;
  const std::vector<std::unique_ptr<LevelReader>>& levels_;
  const std::stop_token& stop_;
  const std::function<void(const Problem&)>& report_;
  std::vector<LevelSums> sums_;
  base::ThreadTeam team_;
  Box3 bounds_;
  double height_sum_ = 0.0;
  std::uint64_t clusters_read_ = 0, max_clusters_read_ = 0;
  bool good_ = true;
};

}  // namespace

}  // namespace terrace::stream::store

namespace terrace::stream {

/// Memory: two bits per cluster, some buffers per thread, and the surface, if there is one.
bool Store::verify(const std::function<void(const Problem&)>& report, unsigned threads) const {
  return store::Verification(*this, *impl_->manifest_file, impl_->manifest, impl_->levels, stop_,
                             threads, report)
      .run();
}

}  // namespace terrace::stream
