// SPDX-License-Identifier: Apache-2.0
#include "view/cluster_reader.hpp"

#include <algorithm>
#include <chrono>
#include <limits>
#include <unordered_map>
#include <utility>

namespace terrace::terrain {
namespace {

/// Share of a frame's time that the calling thread may spend looking for missing bytes.
constexpr double kMissingShare = 0.25;
/// A frame stops looking after this many missing ranges; requesting them takes longer than a frame.
constexpr std::size_t kMaxMissing = 1024;

class FrameReader final : public ClusterReader {
 public:
  FrameReader(FramedSource& source, std::function<bool(const stream::ByteRange&)> has_arrived)
      : source_(source), has_arrived_(std::move(has_arrived)) {}

  void bring(double seconds, const Give& give, const GiveRecord& give_record) override {
    const tri::StepBudget budget{.seconds = kReadingShare * seconds, .clock = steady_seconds};
    meter_.start(budget);
    missing_.clear();
    if (!has_arrived_ || lacking_.size() > 8 * kMaxMissing) lacking_.clear();
    if (!has_arrived_ || lacking_pages_.size() > 8 * kMaxMissing) lacking_pages_.clear();
    ++number_;
    const double end = steady_seconds() + kMissingShare * seconds;
    for (const tri::ViewRequest& request : wanted_) {
      if (request.members == tri::ClusterRecord::kUnread) {
        if (missing_.size() >= kMaxMissing || !bring_record(request.cluster, end, give_record))
          break;
        continue;
      }
      const auto members = static_cast<std::size_t>(request.members);
      // Above level 0, reading includes the records of the clusters below, which takes far longer.
      const std::size_t kind = tri::level_of(request.cluster) > 0 ? 1 : 0;
      if (!meter_.has_time(members, kind) || missing_.size() >= kMaxMissing) break;
      auto lacking = lacking_.find(request.cluster);
      if (lacking == lacking_.end() || has_come(lacking->second.front())) {
        try {
          const std::optional<stream::ByteRange> bytes =
              has_arrived_ ? source_.bytes_of(request.cluster) : std::nullopt;
          if (!bytes || has_arrived_(*bytes)) {
            give(source_.load(request));
            meter_.spend(members, kind);
            continue;
          }
          lacking = lacking_.insert_or_assign(request.cluster, std::vector{*bytes}).first;
        } catch (const stream::MissingBytes& missing) {
          lacking = lacking_.insert_or_assign(request.cluster, missing.ranges()).first;
        }
        // Exceptions take longer than anything else here.
        if (steady_seconds() > end) break;
      }
      missing_.insert(missing_.end(), lacking->second.begin(), lacking->second.end());
    }
  }
  void ask(const std::vector<tri::ViewRequest>& wanted, const std::vector<tri::ViewRequest>&,
           const std::vector<tri::ClusterId>&) override {
    wanted_ = wanted;
  }
  [[nodiscard]] std::span<const stream::ByteRange> missing() const override { return missing_; }

 private:
  struct LackingPage {
    stream::ByteRange range;
    std::uint64_t listed = 0;  ///< the last frame that added it to missing_
  };

  /// Whether missing bytes have arrived. Without `has_arrived`, every frame tries to read them.
  [[nodiscard]] bool has_come(const stream::ByteRange& range) const {
    return has_arrived_ && has_arrived_(range);
  }

  /// Returns false when the time is over.
  bool bring_record(tri::ClusterId id, double end, const GiveRecord& give_record) {
    const tri::ClusterId page = FramedSource::page_of(id);
    const bool same = page == page_;
    page_ = page;
    auto lacking = lacking_pages_.find(page);
    if (lacking == lacking_pages_.end() || has_come(lacking->second.range)) {
      // Further records of the same page take almost no time.
      if (!same && steady_seconds() > end) return false;
      try {
        give_record(id, source_.exact_record(id));
        return true;
      } catch (const stream::MissingBytes& missing) {
        lacking =
            lacking_pages_.insert_or_assign(page, LackingPage{missing.ranges().front()}).first;
      }
    }
    if (std::exchange(lacking->second.listed, number_) != number_) {
      missing_.push_back(lacking->second.range);
    }
    return true;
  }

  FramedSource& source_;
  std::function<bool(const stream::ByteRange&)> has_arrived_;
  std::vector<tri::ViewRequest> wanted_;  ///< by the previous step
  std::vector<stream::ByteRange> missing_;
  /// The ranges that each cluster lacked in the last attempt to read it.
  std::unordered_map<tri::ClusterId, std::vector<stream::ByteRange>> lacking_;
  std::unordered_map<tri::ClusterId, LackingPage> lacking_pages_;
  std::uint64_t number_ = 0;  ///< number of the frame
  tri::ClusterId page_{~std::uint64_t{0}};
  tri::StepMeter meter_;
};

}  // namespace

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

tri::ClusterRecord FramedSource::exact_record(tri::ClusterId id) {
  tri::ClusterRecord record = inner_.record(id);
  record.box = frame_.box_of(record.box);
  if (vertical_) record.error = record.box.max[2] - record.box.min[2];
  return record;
}

tri::ClusterRecord FramedSource::record(tri::ClusterId id) {
  const tri::ClusterId page = page_of(id);
  if (std::find(missing_pages_.begin(), missing_pages_.end(), page) == missing_pages_.end()) {
    try {
      return exact_record(id);
    } catch (const stream::MissingBytes& missing) {
      missing_pages_.push_back(page);
      missing_.insert(missing_.end(), missing.ranges().begin(), missing.ranges().end());
    }
  }
  const stream::Box3 box = store_.coarse_box(id);
  return {.box = frame_.box_of(box),
          .error = std::numeric_limits<double>::infinity(),
          .members = tri::ClusterRecord::kUnread};
}

tri::ClusterMembers FramedSource::read(tri::ClusterId id) {
  const stream::ClusterRecord record = store_.record(id);
  const auto read_members = [&] {
    try {
      return inner_.read(id);
    } catch (const stream::MissingBytes& missing) {
      const stream::ByteRange& first = missing.ranges().front();
      if (tri::level_of(id) == 0 && first.offset == record.offset && first.bytes == record.bytes) {
        members_file_ = first.file;
      }
      throw;
    }
  };
  tri::ClusterMembers members = read_members();
  if (lattice_ != nullptr) {
    nodes_.clear();
    for (const stream::Point3& p : members.positions) nodes_.push_back(lattice_->node(frame_(p)));
    members.positions = nodes_;
  }
  ++clusters_;
  points_ += record.points;
  bytes_ += record.bytes;
  return members;
}

std::optional<stream::ByteRange> FramedSource::bytes_of(tri::ClusterId id) const {
  if (tri::level_of(id) > 0 || members_file_.empty() || store_.levels()[0].segments > 1) return {};
  const stream::ClusterRecord record = store_.record(id);
  return stream::ByteRange{members_file_, record.offset, record.bytes};
}

tri::LoadedCluster FramedSource::retry(const std::function<tri::LoadedCluster()>& load) {
  tri::LoadedCluster cluster = load();
  if (!missing_.empty()) throw stream::MissingBytes(missing_);
  return cluster;
}

tri::LoadedCluster FramedSource::load(const tri::ViewRequest& request) {
  missing_pages_.clear();
  missing_.clear();
  if (bounds_) return tri::load(*this, request);
  return retry([&] { return tri::load(*this, request); });
}

tri::LoadedCluster FramedSource::load_root() {
  missing_pages_.clear();
  missing_.clear();
  return retry([&] { return tri::load_root(*this); });
}

std::vector<std::uint64_t> FramedSource::counts() const {
  std::vector<std::uint64_t> counts;
  for (unsigned level = 0; level < top(); ++level) counts.push_back(cluster_count(level));
  return counts;
}

std::unique_ptr<ClusterReader> make_frame_reader(
    FramedSource& source, std::function<bool(const stream::ByteRange&)> has_arrived) {
  return std::make_unique<FrameReader>(source, std::move(has_arrived));
}

}  // namespace terrace::terrain
