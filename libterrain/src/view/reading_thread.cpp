// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
#include <unordered_set>
#include <utility>
#include <vector>

#include "view/cluster_reader.hpp"

namespace terrace::terrain {
namespace {

class ReadingThread final : public ClusterReader {
 public:
  explicit ReadingThread(FramedSource& source) : source_(source), thread_([this] { read(); }) {}
  ~ReadingThread() override {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }
  ReadingThread(const ReadingThread&) = delete;
  ReadingThread& operator=(const ReadingThread&) = delete;

  // Neither bring() nor ask() waits for the thread: if it holds the lock, the next frame tries
  // again.
  void bring(double seconds, const Give& give, const GiveRecord&) override {
    if (next_ == delivered_.size()) {
      delivered_.clear();
      next_ = 0;
      const std::unique_lock lock(mutex_, std::try_to_lock);
      if (!lock) return;
      if (failure_) std::rethrow_exception(failure_);
      delivered_.swap(ready_);
    }
    const double end = steady_seconds() + kReadingShare * seconds;
    while (next_ < delivered_.size() && steady_seconds() < end)
      give(std::move(delivered_[next_++]));
  }
  void ask(const std::vector<tri::ViewRequest>&, const std::vector<tri::ViewRequest>& requests,
           const std::vector<tri::ClusterId>& withdrawn) override {
    std::erase_if(requested_, [&](const tri::ViewRequest& request) {
      return std::binary_search(withdrawn.begin(), withdrawn.end(), request.cluster);
    });
    requested_.insert(requested_.end(), requests.begin(), requests.end());
    withdrawn_.insert(withdrawn.begin(), withdrawn.end());
    for (const tri::ViewRequest& request : requests) withdrawn_.erase(request.cluster);
    if (requested_.empty() && withdrawn_.empty()) return;
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    if (!withdrawn_.empty()) {
      std::erase_if(queue_, [&](const auto& request) { return withdrawn_.count(request.cluster); });
    }
    queue_.insert(queue_.end(), requested_.begin(), requested_.end());
    requested_.clear();
    withdrawn_.clear();
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
        tri::LoadedCluster cluster = source_.load(request);
        lock.lock();
        ready_.push_back(std::move(cluster));
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failure_ = std::current_exception();
    }
  }

  FramedSource& source_;
  std::vector<tri::LoadedCluster> delivered_;
  std::size_t next_ = 0;                          ///< the next of delivered_ to pass on
  std::vector<tri::ViewRequest> requested_;       ///< not yet in queue_
  std::unordered_set<tri::ClusterId> withdrawn_;  ///< may still be in queue_
  std::mutex mutex_;                              ///< protects the members below
  std::condition_variable wake_;
  std::deque<tri::ViewRequest> queue_;
  std::vector<tri::LoadedCluster> ready_;
  std::exception_ptr failure_;
  bool stop_ = false;
  std::thread thread_;  ///< last, because it uses all other members
};

}  // namespace

std::unique_ptr<ClusterReader> make_reading_thread(FramedSource& source) {
  return std::make_unique<ReadingThread>(source);
}

}  // namespace terrace::terrain
