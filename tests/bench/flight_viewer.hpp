// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include <terrace/stream/store.hpp>
#include <terrace/tri/view_control.hpp>
#include <terrace/tri/view_meter.hpp>

#include "earth/world.hpp"
#include "terrace/terrain/store_source.hpp"

/// What stands between a store and the view control: who reads, and when.

namespace terrace::tests {

using Control = tri::ViewControl2<std::int32_t>;

inline double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Clusters of a store of a raster. Members are in column and row, as the triangulation wants them;
/// boxes are in the CRS, in metres like the errors, as the camera wants them.
class GroundSource final : public tri::ClusterSource {
 public:
  explicit GroundSource(const stream::Store& store)
      : inner_(store), placement_(terrain::placement_of(store.schema())) {}

  [[nodiscard]] unsigned top() const override { return inner_.top(); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return inner_.cluster_count(level);
  }
  tri::ClusterRecord record(tri::ClusterId id) override {
    tri::ClusterRecord record = inner_.record(id);
    const stream::Box3 box = terrain::world_box(placement_, {record.box.min, record.box.max});
    record.box = {box.min, box.max};
    return record;
  }
  tri::ClusterMembers read(tri::ClusterId id) override { return inner_.read(id); }

 private:
  terrain::StoreSource inner_;
  terrain::Placement placement_;
};

/// The view control, fed from a store.
class Viewer {
 public:
  Viewer(const stream::Store& store, const tri::ViewOptions& options)
      : source_(store), control_(counts(source_), tri::load_root(source_), options) {}
  virtual ~Viewer() = default;
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  /// What a frame costs the thread that draws, which is what this takes: at most about `seconds`.
  virtual const Control::Step& frame(const tri::View& view, double seconds) = 0;
  /// Whether frames wait for something that another thread does.
  [[nodiscard]] virtual bool waits() const { return false; }
  [[nodiscard]] const Control& control() const { return control_; }
  /// What was read, in order.
  [[nodiscard]] const std::vector<tri::ClusterId>& loaded() const { return loaded_; }

 protected:
  static std::vector<std::uint64_t> counts(const tri::ClusterSource& source) {
    std::vector<std::uint64_t> counts;
    for (unsigned level = 0; level < source.top(); ++level) {
      counts.push_back(source.cluster_count(level));
    }
    return counts;
  }
  void give(tri::GivenCluster cluster) {
    loaded_.push_back(cluster.cluster);
    control_.give(std::move(cluster));
  }
  const Control::Step& step(const tri::View& view, double seconds) {
    return control_.step(view, {.seconds = seconds, .clock = now});
  }

  GroundSource source_;

 private:
  Control control_;
  std::vector<tri::ClusterId> loaded_;
};

/// One thread does all. What the step before asked for is read first, as far as a part of the time
/// goes; the rest is the step's.
class OneThread final : public Viewer {
 public:
  using Viewer::Viewer;

  const Control::Step& frame(const tri::View& view, double seconds) override {
    const tri::StepBudget reading{.seconds = kShare * seconds, .clock = now};
    const double begin = now();
    meter_.start(reading);
    for (const tri::ViewRequest& request : wanted_) {
      if (!meter_.has(request.members)) break;
      give(tri::load(source_, request));
      meter_.spend(request.members);
    }
    const Control::Step& result = step(view, seconds - (now() - begin));
    wanted_ = result.wanted;
    return result;
  }

 private:
  static constexpr double kShare = 0.4;

  std::vector<tri::ViewRequest> wanted_;
  tri::StepMeter meter_;
};

/// A second thread reads and decodes what a step asks for; a frame takes what is there.
class ReaderThread final : public Viewer {
 public:
  ReaderThread(const stream::Store& store, const tri::ViewOptions& options)
      : Viewer(store, options), thread_([this] { read(); }) {}
  ~ReaderThread() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }

  [[nodiscard]] bool waits() const override { return true; }
  const Control::Step& frame(const tri::View& view, double seconds) override {
    const double begin = now();
    {
      const std::lock_guard lock(mutex_);
      if (failure_) std::rethrow_exception(failure_);
      taken_.swap(ready_);
    }
    for (tri::GivenCluster& cluster : taken_) give(std::move(cluster));
    taken_.clear();
    const Control::Step& result = step(view, seconds - (now() - begin));
    if (!result.requests.empty() || !result.withdrawn.empty()) {
      const std::lock_guard lock(mutex_);
      const auto& gone = result.withdrawn;
      std::erase_if(queue_, [&](const tri::ViewRequest& request) {
        return std::binary_search(gone.begin(), gone.end(), request.cluster);
      });
      queue_.insert(queue_.end(), result.requests.begin(), result.requests.end());
      wake_.notify_one();
    }
    return result;
  }

 private:
  void read() try {
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

  std::mutex mutex_;  // for what follows but `taken_`
  std::condition_variable wake_;
  std::deque<tri::ViewRequest> queue_;
  std::vector<tri::GivenCluster> ready_;
  std::exception_ptr failure_;
  bool stop_ = false;
  std::vector<tri::GivenCluster> taken_;
  std::thread thread_;
};

}  // namespace terrace::tests
