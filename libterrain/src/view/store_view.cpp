// SPDX-License-Identifier: Apache-2.0
#include "terrace/terrain/store_view.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

#include "earth/ground.hpp"
#include "terrace/terrain/store_source.hpp"

namespace terrace::terrain {
namespace {

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// From stored coordinates to metres around the middle of the store.
class ViewFrame {
 public:
  explicit ViewFrame(const stream::Store& store) {
    const stream::Box3& bounds = store.bounds();
    const stream::Placement& placement = store.schema();
    map_ = Ground(placement).map(bounds);
    if (bounds.empty()) return;
    // Heights count from 0 of the store's vertical unit, not from the sample 0.
    const stream::Channel& z = placement.coordinates[2];
    middle_ = {(bounds.min[0] + bounds.max[0]) / 2, (bounds.min[1] + bounds.max[1]) / 2,
               -z.offset / z.scale};
  }

  [[nodiscard]] stream::Point3 operator()(const stream::Point3& stored) const {
    return apply(map_, {stored[0] - middle_[0], stored[1] - middle_[1], stored[2] - middle_[2]});
  }
  [[nodiscard]] tri::Box3 box_of(const tri::Box3& stored) const {
    stream::Box3 box;
    for (unsigned corner = 0; corner < 8; ++corner) {
      box.include((*this)({(corner & 1 ? stored.max : stored.min)[0],
                           (corner & 2 ? stored.max : stored.min)[1],
                           (corner & 4 ? stored.max : stored.min)[2]}));
    }
    return {box.min, box.max};
  }

 private:
  GroundMap map_{};
  stream::Point3 middle_{};
};

/// The clusters of a store, members in stored coordinates, boxes in the view frame.
class FramedSource final : public tri::ClusterSource {
 public:
  FramedSource(const stream::Store& store, const ViewFrame& frame)
      : store_(store), inner_(store), frame_(frame) {}

  [[nodiscard]] unsigned top() const override { return inner_.top(); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return inner_.cluster_count(level);
  }
  tri::ClusterRecord record(tri::ClusterId id) override {
    tri::ClusterRecord record = inner_.record(id);
    record.box = frame_.box_of(record.box);
    return record;
  }
  tri::ClusterMembers read(tri::ClusterId id) override {
    const stream::ClusterRecord record =
        store_.record(stream::cluster_id(tri::level_of(id), tri::ordinal_of(id)));
    ++clusters_;
    points_ += record.points;
    bytes_ += record.bytes;
    return inner_.read(id);
  }

  /// Bytes read so far; may be called while another thread reads.
  [[nodiscard]] ViewTraffic traffic() const { return {clusters_, points_, bytes_}; }
  [[nodiscard]] std::vector<std::uint64_t> counts() const {
    std::vector<std::uint64_t> counts;
    for (unsigned level = 0; level < top(); ++level) counts.push_back(cluster_count(level));
    return counts;
  }

 private:
  const stream::Store& store_;
  StoreSource inner_;
  const ViewFrame& frame_;
  std::atomic<std::uint64_t> clusters_ = 0, points_ = 0, bytes_ = 0;
};

/// Reads clusters on a thread of its own.
class ReadingThread {
 public:
  explicit ReadingThread(FramedSource& source) : source_(source), thread_([this] { read(); }) {}
  ~ReadingThread() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }
  ReadingThread(const ReadingThread&) = delete;
  ReadingThread& operator=(const ReadingThread&) = delete;

  /// The clusters read since the last call. Rethrows what reading threw.
  std::vector<tri::GivenCluster>& take() {
    taken_.clear();
    const std::lock_guard lock(mutex_);
    if (failure_) std::rethrow_exception(failure_);
    taken_.swap(ready_);
    return taken_;
  }
  void ask(const std::vector<tri::ViewRequest>& requests,
           const std::vector<tri::ClusterId>& withdrawn) {
    if (requests.empty() && withdrawn.empty()) return;
    const std::lock_guard lock(mutex_);
    std::erase_if(queue_, [&](const tri::ViewRequest& request) {
      return std::binary_search(withdrawn.begin(), withdrawn.end(), request.cluster);
    });
    queue_.insert(queue_.end(), requests.begin(), requests.end());
    wake_.notify_one();
  }

 private:
  void read() {
    try {
      std::unique_lock lock(mutex_);
      for (;;) {
        wake_.wait(lock, [&] { return stop_ || !queue_.empty(); });
        if (stop_) return;
        const tri::ViewRequest request = queue_.front();
        queue_.pop_front();
        lock.unlock();
        tri::GivenCluster cluster = tri::load(source_, request);
        lock.lock();
        ready_.push_back(std::move(cluster));
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
  }

  FramedSource& source_;
  std::vector<tri::GivenCluster> taken_;
  std::mutex mutex_;  ///< guards the members below
  std::condition_variable wake_;
  std::deque<tri::ViewRequest> queue_;
  std::vector<tri::GivenCluster> ready_;
  std::exception_ptr failure_;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all of these
};

/// Share of a frame's time that the calling thread spends reading.
constexpr double kReadingShare = 0.4;

}  // namespace

template <class Coord>
struct StoreView<Coord>::Impl {
  Impl(const stream::Store& given, const tri::ViewOptions& options, Reader reader)
      : store(given),
        frame(store),
        source(store, frame),
        control(source.counts(), tri::load_root(source), options) {
    if (reader == Reader::thread) thread = std::make_unique<ReadingThread>(source);
  }

  /// Reads what the last step asked for, within a share of the frame's time.
  void read_within(double seconds) {
    const tri::StepBudget budget{.seconds = seconds, .clock = steady_seconds};
    meter.start(budget);
    for (const tri::ViewRequest& request : wanted) {
      if (!meter.has(request.members)) break;
      control.give(tri::load(source, request));
      meter.spend(request.members);
    }
  }

  stream::Store store;
  ViewFrame frame;
  FramedSource source;
  Control control;
  bool settled = false;
  std::vector<tri::ViewRequest> wanted;  ///< by the last step, without a reading thread
  tri::StepMeter meter;
  std::unique_ptr<ReadingThread> thread;
};

template <class Coord>
StoreView<Coord>::StoreView(const stream::Store& store, const tri::ViewOptions& options,
                            Reader reader)
    : impl_(std::make_unique<Impl>(store, options, reader)) {
  assert((!std::is_integral_v<Coord> || store.schema().grid));
}

template <class Coord>
StoreView<Coord>::~StoreView() = default;

template <class Coord>
const typename StoreView<Coord>::Step& StoreView<Coord>::frame(const tri::View& view,
                                                               double seconds) {
  const double begin = steady_seconds();
  if (impl_->thread) {
    for (tri::GivenCluster& cluster : impl_->thread->take()) {
      impl_->control.give(std::move(cluster));
    }
  } else {
    impl_->read_within(kReadingShare * seconds);
  }
  const double left = seconds - (steady_seconds() - begin);
  const Step& step = impl_->control.step(view, {.seconds = left, .clock = steady_seconds});
  if (impl_->thread) {
    impl_->thread->ask(step.requests, step.withdrawn);
  } else {
    impl_->wanted = step.wanted;
  }
  impl_->settled = step.settled && step.wanted.empty();
  return step;
}

template <class Coord>
bool StoreView<Coord>::settled() const {
  return impl_->settled;
}

template <class Coord>
const typename StoreView<Coord>::Control& StoreView<Coord>::control() const {
  return impl_->control;
}

template <class Coord>
stream::Point3 StoreView<Coord>::in_view_frame(const stream::Point3& stored) const {
  return impl_->frame(stored);
}

template <class Coord>
stream::Point3 StoreView<Coord>::in_view_frame(tri::VertexId vertex) const {
  const auto p = model().triangulation().point(vertex);
  return impl_->frame(
      {static_cast<double>(p[0]), static_cast<double>(p[1]), model().height(vertex)});
}

template <class Coord>
ViewTraffic StoreView<Coord>::traffic() const {
  return impl_->source.traffic();
}

template class StoreView<std::int32_t>;
template class StoreView<double>;

}  // namespace terrace::terrain
