// SPDX-License-Identifier: Apache-2.0
#include "net/remote_folder.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include <fmt/core.h>

#include "io/text.hpp"
#include "net/byte_parts.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream::net {
namespace {

/// A file of at most this size may arrive as a whole from a server that ignores ranges.
constexpr std::uint64_t kMaxWhole = std::uint64_t{1} << 20;
/// Bytes that are requested of a file whose size is not known.
constexpr std::uint64_t kFirstBytes = std::uint64_t{64} << 10;
constexpr std::uint64_t kMaxAhead = std::uint64_t{8} << 20;
/// The share of the cache for a read ahead: several threads may each have one.
constexpr std::uint64_t kAheadShare = 8;
constexpr std::uint64_t kMinCache = std::uint64_t{4} << 20;

bool overlap(const ByteRange& a, const ByteRange& b) {
  return a.file == b.file && a.offset < b.offset + b.bytes && b.offset < a.offset + a.bytes;
}

/// A file of a RemoteFolder.
class RemoteFile final : public ByteSource {
 public:
  RemoteFile(std::shared_ptr<RemoteFolder> folder, std::string file, std::uint64_t size)
      : folder_(std::move(folder)),
        file_(std::move(file)),
        name_(folder_->shown(file_)),
        size_(size) {}

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::uint64_t size() const override { return size_; }
  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    if (!out.empty()) folder_->read(file_, offset, out);
  }
  [[nodiscard]] std::uint64_t prefetch_bytes() const override { return folder_->prefetch_bytes(); }
  void prefetch(std::span<const BytePart> parts) const override {
    std::vector<ByteRange> ranges;
    for (const BytePart& part : parts) ranges.push_back({file_, part.offset, part.bytes});
    folder_->prefetch(ranges);
  }

 private:
  std::shared_ptr<RemoteFolder> folder_;
  std::string file_, name_;
  std::uint64_t size_;
};

}  // namespace

RemoteFolder::RemoteFolder(const std::string& url, const NetworkOptions& options)
    : origin_(url, client_, options),
      deadline_(options.deadline),
      cache_bytes_(std::max(kMinCache, options.cache_bytes)),
      held_(cache_bytes_),
      open_held_(held_.open()) {}

void RemoteFolder::expect(const std::string& file, std::uint64_t bytes) {
  const Lock lock(mutex_);
  File& state = files_[file];
  if (state.size) return;
  state.size = bytes;
  held_.add_file(file, bytes);
}

std::unique_ptr<ByteSource> RemoteFolder::open(const std::string& file) {
  Lock lock(mutex_);
  if (!files_[file].size) {
    wait_for_others(lock, {{{file, 0, kFirstBytes}}});
    if (!files_[file].size) request(lock, {{file, 0, kFirstBytes}});
  }
  return std::make_unique<RemoteFile>(shared_from_this(), file, *files_[file].size);
}

void RemoteFolder::wait_for_others(Lock& lock, std::span<const ByteRange> ranges) {
  arrived_.wait(lock, [&] {
    return std::none_of(requested_.begin(), requested_.end(), [&](const ByteRange& other) {
      return std::any_of(ranges.begin(), ranges.end(),
                         [&](const ByteRange& range) { return overlap(range, other); });
    });
  });
}

ByteRange RemoteFolder::with_read_ahead(File& file, ByteRange range) {
  const std::uint64_t end = range.offset + range.bytes;
  const auto continues = [&](const Stream& stream) {
    return stream.next > 0 && range.offset <= stream.next && end > stream.next;
  };
  const auto found = std::find_if(file.streams.begin(), file.streams.end(), continues);
  if (found == file.streams.end()) {
    file.streams[file.oldest_stream] = {.next = end, .ahead = range.bytes};
    file.oldest_stream = (file.oldest_stream + 1) % file.streams.size();
    return range;
  }
  const std::uint64_t most = std::min(kMaxAhead, cache_bytes_ / kAheadShare);
  found->ahead = std::min(2 * found->ahead, most);
  // The bytes before the end of the last request are mostly held.
  const ByteRange before{range.file, range.offset, found->next - range.offset};
  if (held_.has(before)) range.offset = found->next;
  range.bytes = std::min(std::max(end - range.offset, found->ahead), *file.size - range.offset);
  found->next = range.offset + range.bytes;
  return range;
}

void RemoteFolder::read(const std::string& file, std::uint64_t offset, std::span<std::byte> out) {
  while (!out.empty()) {
    const auto part = out.first(std::min(out.size(), static_cast<std::size_t>(prefetch_bytes())));
    read_part({file, offset, part.size()}, part);
    offset += part.size();
    out = out.subspan(part.size());
  }
}

void RemoteFolder::read_part(const ByteRange& range, std::span<std::byte> out) {
  Lock lock(mutex_);
  wait_for_others(lock, {&range, 1});
  const auto get = [&](const ByteRange& needed) {
    std::vector<ByteRange> ranges;
    for (const BytePart& part : joined_parts({{needed.offset, needed.bytes}})) {
      ranges.push_back({needed.file, part.offset, part.bytes});
    }
    request(lock, ranges);
  };
  if (!held_.has(range)) get(with_read_ahead(files_.at(range.file), range));
  if (!held_.has(range)) {
    // New bytes have replaced held ones of the same range. Without those, all fit.
    held_.forget(range.file);
    get(range);
  }
  open_held_(range.file)->read(range.offset, out);
}

void RemoteFolder::prefetch(std::span<const ByteRange> ranges) {
  Lock lock(mutex_);
  wait_for_others(lock, ranges);
  std::map<std::string, std::vector<BytePart>> missing;
  for (const ByteRange& range : ranges) {
    if (!held_.has(range)) missing[range.file].push_back({range.offset, range.bytes});
  }
  std::vector<ByteRange> needed;
  for (auto& [file, parts] : missing) {
    for (const BytePart& part : joined_parts(std::move(parts))) {
      needed.push_back({file, part.offset, part.bytes});
    }
  }
  if (!needed.empty()) request(lock, needed);
}

HttpTask RemoteFolder::task_for(const ByteRange& range) {
  const File& file = files_.at(range.file);
  std::map<std::string, std::string> headers{
      {"range", fmt::format("bytes={}-{}", range.offset, range.offset + range.bytes - 1)}};
  if (!file.etag.empty()) headers["if-match"] = file.etag;
  return {.make = [this, name = range.file, headers] { return origin_.get(name, headers); },
          .max_bytes = static_cast<std::size_t>(std::max(range.bytes, kMaxWhole))};
}

void RemoteFolder::request(Lock& lock, const std::vector<ByteRange>& ranges) {
  std::vector<HttpTask> tasks;
  for (const ByteRange& range : ranges) tasks.push_back(task_for(range));
  requested_.insert(requested_.end(), ranges.begin(), ranges.end());
  lock.unlock();
  std::exception_ptr failure;
  try {
    client_.send(tasks, deadline_);
  } catch (...) {
    failure = std::current_exception();
  }
  lock.lock();
  for (const ByteRange& range : ranges) {
    requested_.erase(std::find(requested_.begin(), requested_.end(), range));
  }
  arrived_.notify_all();
  if (failure) std::rethrow_exception(failure);
  for (std::size_t i = 0; i < ranges.size(); ++i) take(ranges[i], tasks[i].answer);
}

Error RemoteFolder::changed(const std::string& file) const {
  return Error(shown(file), "the file has changed on the server since it was opened")
      .remedy("open it again");
}

void RemoteFolder::check_validators(const std::string& name, std::uint64_t size,
                                    const HttpAnswer& answer) {
  File& file = files_.at(name);
  const std::string& etag = answer.header("etag");
  const std::string strong = etag.starts_with('"') ? etag : std::string();
  const std::string& modified = answer.header("last-modified");
  if (file.connected) {
    const bool same = file.etag.empty() ? modified == file.last_modified : strong == file.etag;
    if (!same || size != *file.size) throw changed(name);
    return;
  }
  if (file.size && size != *file.size) {
    throw Error(shown(name), fmt::format("the manifest says {}, the file has {}",
                                         counted(*file.size, "byte"), size))
        .remedy("copy the store to the server again");
  }
  if (!file.size) held_.add_file(name, size);
  file.size = size;
  file.connected = true;
  file.etag = strong;
  file.last_modified = modified;
}

void RemoteFolder::take(const ByteRange& range, HttpAnswer& answer) {
  const bool connected = files_.at(range.file).connected;
  const std::string& coding = answer.header("content-encoding");
  if ((answer.status == 206 || answer.status == 200) && !coding.empty() && coding != "identity") {
    throw Error(shown(range.file), "the server sends the file compressed")
        .remedy("store it there without Content-Encoding");
  }
  const auto given = ContentRange::parse(answer.header("content-range"));
  if (answer.status == 206 && answer.failure.empty() && !answer.too_long && given) {
    check_validators(range.file, given->total, answer);
    const std::uint64_t end = std::min(range.offset + range.bytes, given->total);
    if (given->first == range.offset && given->end == end &&
        answer.body.size() == end - range.offset) {
      held_.give(range.file, range.offset, answer.body);
      return;
    }
  }
  if (answer.status == 206 && answer.failure.empty()) {
    throw Error(shown(range.file), "the server answers with other bytes than were requested")
        .remedy("copy the files to another server, or to this machine");
  }
  if (answer.status == 200 && answer.failure.empty()) {
    if (answer.too_long) {
      throw Error(shown(range.file),
                  "the server sends the whole file instead of the range that was requested")
          .remedy("use a server that supports range requests, or copy the files to this machine");
    }
    check_validators(range.file, answer.body.size(), answer);
    held_.give(range.file, 0, answer.body);
    return;
  }
  if (answer.status == 416 && given && !connected) {
    check_validators(range.file, given->total, answer);
    if (given->total == 0) return;
  }
  if (answer.status == 412 || (answer.status == 416 && connected)) throw changed(range.file);
  throw origin_.refusal(range.file, answer, connected);
}

}  // namespace terrace::stream::net
