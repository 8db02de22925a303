// SPDX-License-Identifier: Apache-2.0
#include "format/las/laz_encoders.hpp"

#include <optional>
#include <system_error>
#include <utility>

namespace terrace::stream {

LazEncoders::LazEncoders(const laz::Vlr& vlr, unsigned threads, Write write)
    : vlr_(vlr), wanted_threads_(threads), write_(std::move(write)) {}

LazEncoders::~LazEncoders() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  work_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void LazEncoders::encode(std::span<const std::byte> records) {
  if (!started_) start();
  if (own_) {
    coded_.clear();
    own_->encode_chunk(records, coded_);
    write_(coded_);
    return;
  }
  while (jobs_.size() > threads_.size()) pass_on();
  std::unique_ptr<Job> job;
  if (free_.empty()) {
    job = std::make_unique<Job>();
  } else {
    job = std::move(free_.back());
    free_.pop_back();
  }
  job->records.assign(records.begin(), records.end());
  job->coded.clear();
  job->done = false;
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  work_.notify_one();
}

void LazEncoders::finish() {
  while (!jobs_.empty()) pass_on();
}

void LazEncoders::start() {
  started_ = true;
  try {
    for (unsigned i = 0; i < wanted_threads_ && wanted_threads_ > 1; ++i) {
      threads_.emplace_back([this] { run(); });
    }
  } catch (const std::system_error&) {
    // The system has no more threads.
  }
  if (threads_.empty()) own_ = std::make_unique<laz::Encoder>(vlr_);
}

void LazEncoders::pass_on() {
  std::unique_ptr<Job> job;
  {
    std::unique_lock lock(mutex_);
    news_.wait(lock, [this] { return jobs_.front()->done; });
    job = std::move(jobs_.front());
    jobs_.pop_front();
    --next_;
  }
  if (job->error) std::rethrow_exception(job->error);
  write_(job->coded);
  free_.push_back(std::move(job));
}

void LazEncoders::run() {
  std::optional<laz::Encoder> encoder;
  for (;;) {
    Job* job = nullptr;
    {
      std::unique_lock lock(mutex_);
      work_.wait(lock, [this] { return stop_ || next_ < jobs_.size(); });
      if (stop_) return;
      job = jobs_[next_++].get();
    }
    try {
      if (!encoder) encoder.emplace(vlr_);
      encoder->encode_chunk(job->records, job->coded);
    } catch (...) {
      job->error = std::current_exception();
    }
    {
      const std::lock_guard lock(mutex_);
      job->done = true;
    }
    news_.notify_one();
  }
}

}  // namespace terrace::stream
