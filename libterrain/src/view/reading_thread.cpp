// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>
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

  void bring(double, const Give& give, const GiveRecord&) override {
    taken_.clear();
    {
      const std::lock_guard lock(mutex_);
      if (failure_) std::rethrow_exception(failure_);
      taken_.swap(ready_);
    }
    for (tri::GivenCluster& cluster : taken_) give(std::move(cluster));
  }
  void ask(const std::vector<tri::ViewRequest>&, const std::vector<tri::ViewRequest>& requests,
           const std::vector<tri::ClusterId>& withdrawn) override {
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
        tri::GivenCluster cluster = source_.load(request);
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
  std::mutex mutex_;  ///< of what follows
  std::condition_variable wake_;
  std::deque<tri::ViewRequest> queue_;
  std::vector<tri::GivenCluster> ready_;
  std::exception_ptr failure_;
  bool stop_ = false;
  std::thread thread_;  ///< last: it uses all of these
};

}  // namespace

std::unique_ptr<ClusterReader> make_reading_thread(FramedSource& source) {
  return std::make_unique<ReadingThread>(source);
}

}  // namespace terrace::terrain
