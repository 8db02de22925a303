// SPDX-License-Identifier: Apache-2.0
#include "view/cluster_reader.hpp"

#include <chrono>
#include <unordered_map>
#include <utility>

namespace terrace::terrain {
namespace {

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Share of a frame's time that the calling thread spends reading.
constexpr double kReadingShare = 0.4;
/// And how much of it when it looks for bytes that turn out to be missing.
constexpr double kMissingShare = 0.25;
/// More missing ranges are not looked for in a frame: requests for these take longer than it does.
constexpr std::size_t kMostMissing = 512;

class FrameReader final : public ClusterReader {
 public:
  FrameReader(FramedSource& source, std::function<bool(const stream::ByteRange&)> given)
      : source_(source), given_(std::move(given)) {}

  void bring(double seconds, const Give& give) override {
    const tri::StepBudget budget{.seconds = kReadingShare * seconds, .clock = steady_seconds};
    meter_.start(budget);
    missing_.clear();
    if (!given_ || lacking_.size() > 8 * kMostMissing) lacking_.clear();
    const double end = steady_seconds() + kMissingShare * seconds;
    for (const tri::ViewRequest& request : wanted_) {
      const auto members = static_cast<std::size_t>(request.members);
      // Above level 0 the records of the clusters below come with it, which takes far longer.
      const std::size_t kind = tri::level_of(request.cluster) > 0 ? 1 : 0;
      if (!meter_.has(members, kind) || missing_.size() >= kMostMissing) break;
      auto lacking = lacking_.find(request.cluster);
      if (lacking == lacking_.end() || given_(lacking->second.front())) {
        try {
          give(source_.load(request));
          meter_.spend(members, kind);
          continue;
        } catch (const stream::MissingBytes& missing) {
          lacking = lacking_.insert_or_assign(request.cluster, missing.ranges()).first;
        }
        // An exception takes longer than anything else here.
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
  FramedSource& source_;
  std::function<bool(const stream::ByteRange&)> given_;
  std::vector<tri::ViewRequest> wanted_;  ///< by the step before
  std::vector<stream::ByteRange> missing_;
  /// What clusters lacked when they were last looked for.
  std::unordered_map<tri::ClusterId, std::vector<stream::ByteRange>> lacking_;
  tri::StepMeter meter_;
};

}  // namespace

tri::ClusterRecord FramedSource::record(tri::ClusterId id) {
  try {
    tri::ClusterRecord record = inner_.record(id);
    record.box = frame_.box_of(record.box);
    return record;
  } catch (const stream::MissingBytes& missing) {
    // Neighbours are often in the same page of the index.
    for (const stream::ByteRange& range : missing.ranges()) {
      if (missing_.empty() || missing_.back() != range) missing_.push_back(range);
    }
    return {};
  }
}

tri::ClusterMembers FramedSource::read(tri::ClusterId id) {
  const stream::ClusterRecord record =
      store_.record(stream::cluster_id(tri::level_of(id), tri::ordinal_of(id)));
  tri::ClusterMembers members = inner_.read(id);
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

tri::GivenCluster FramedSource::whole(const std::function<tri::GivenCluster()>& load) {
  missing_.clear();
  tri::GivenCluster cluster = load();
  if (!missing_.empty()) throw stream::MissingBytes(missing_);
  return cluster;
}

tri::GivenCluster FramedSource::load(const tri::ViewRequest& request) {
  return whole([&] { return tri::load(*this, request); });
}

tri::GivenCluster FramedSource::load_root() {
  return whole([&] { return tri::load_root(*this); });
}

std::vector<std::uint64_t> FramedSource::counts() const {
  std::vector<std::uint64_t> counts;
  for (unsigned level = 0; level < top(); ++level) counts.push_back(cluster_count(level));
  return counts;
}

std::unique_ptr<ClusterReader> make_frame_reader(
    FramedSource& source, std::function<bool(const stream::ByteRange&)> given) {
  return std::make_unique<FrameReader>(source, std::move(given));
}

}  // namespace terrace::terrain
