// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/input.hpp"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <map>
#include <span>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "io/gzip_stream.hpp"
#include "io/peek.hpp"
#include "io/stop_waiter.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"
#include "terrace/stream/gzip.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kMinBuffer = 4096;

/// Pipes whose first bytes have been read; reopening them would lose these bytes.
std::map<std::string, std::unique_ptr<Input>>& heads() {
  thread_local std::map<std::string, std::unique_ptr<Input>> pipe;
  return pipe;
}

int open_for_reading(const std::string& file) {
  if (file == kStandardStream) return STDIN_FILENO;
  // Opening a pipe without O_NONBLOCK would wait for its writer and ignore a stop request. poll()
  // waits for the writer too.
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | (reads_once(file) ? O_NONBLOCK : 0));
  if (fd < 0) throw system_error(file, "cannot open", errno, "check the name and its permissions");
  return fd;
}

}  // namespace

bool reads_once(const std::string& file) {
  struct stat status {};
  return file == kStandardStream ||
         (::stat(file.c_str(), &status) == 0 && S_ISFIFO(status.st_mode));
}

/// An open file, closed with the object.
class Input::Descriptor {
 public:
  Descriptor(const std::string& file, const std::stop_token& stop)
      : fd_(open_for_reading(file)), owned_(file != kStandardStream) {
    struct stat status {};
    if (::fstat(fd_, &status) == 0 && S_ISREG(status.st_mode)) {
      // A file on standard input may already have been read in part; only the rest counts.
      const off_t at = owned_ ? 0 : std::max<off_t>(0, ::lseek(fd_, 0, SEEK_CUR));
      size_ = static_cast<std::uint64_t>(std::max<off_t>(0, status.st_size - at));
      ::posix_fadvise(fd_, 0, 0, POSIX_FADV_SEQUENTIAL);
      return;
    }
    try {
      waiter_.emplace(stop);
    } catch (...) {
      if (owned_) ::close(fd_);
      throw;
    }
  }
  ~Descriptor() {
    if (owned_) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  /// Returns the number of bytes read, 0 at the end. Throws: Error with the name of the input,
  /// Stopped.
  [[nodiscard]] std::size_t read(char* out, std::size_t max_bytes, const std::string& name) const {
    for (;;) {
      if (waiter_) waiter_->wait(fd_, POLLIN);
      const ssize_t got = ::read(fd_, out, max_bytes);
      if (got >= 0) return static_cast<std::size_t>(got);
      if (errno == EISDIR) {
        throw Error(name, "is a folder, not a file").remedy("name the files in it");
      }
      if (errno == EBADF) {
        throw Error(name, "is closed").remedy("give the name of a file, or redirect one to it");
      }
      // EAGAIN means that another reader of the same pipe was faster.
      if (errno != EINTR && errno != EAGAIN) throw system_error(name, "cannot read", errno);
    }
  }
  /// For regular files only. Does not change the position.
  [[nodiscard]] bool begins_as_gzip() const {
    std::byte head[2];
    const off_t at = ::lseek(fd_, 0, SEEK_CUR);
    return at >= 0 && ::pread(fd_, head, sizeof head, at) == sizeof head && is_gzip(head);
  }
  [[nodiscard]] bool skip(std::uint64_t count) const {
    return ::lseek(fd_, static_cast<off_t>(count), SEEK_CUR) >= 0;
  }
  /// Returns the size of a regular file; otherwise nullopt.
  [[nodiscard]] std::optional<std::uint64_t> size() const { return size_; }

 private:
  int fd_;
  bool owned_;
  std::optional<std::uint64_t> size_;
  std::optional<StopWaiter> waiter_;  ///< nullopt for regular files, which never block
};

Input::Input(const std::string& file, const std::stop_token& stop, std::size_t at_once,
             Packed packed) {
  const auto pipe = heads().find(file);
  if (pipe != heads().end()) {
    *this = std::move(*pipe->second);
    heads().erase(pipe);
    buffer_.resize(std::max(buffer_.size(), at_once));
    return;
  }
  name_ = shown_name(file);
  descriptor_ = std::make_unique<Descriptor>(file, stop);
  size_ = descriptor_->size();
  buffer_.resize(at_once);
  gzip_checked_ = packed == Packed::as_it_is;
  if (gzip_checked_ || !size_)
    return;  // checked at the first read, because a pipe may have no writer yet
  gzip_checked_ = true;
  if (descriptor_->begins_as_gzip()) {
    size_.reset();
    gzip_ = std::make_unique<GzipStream>(name_);
  }
}

Input::~Input() = default;
Input& Input::operator=(Input&&) noexcept = default;

bool Input::read_more() {
  const auto read = [this](char* out, std::size_t max_bytes) {
    return descriptor_->read(out, max_bytes, name_);
  };
  if (!gzip_checked_) {
    gzip_checked_ = true;
    constexpr std::size_t kMarkBytes = 2;
    buffer_.resize(std::max(buffer_.size(), kMarkBytes));
    for (std::size_t got = 1; end_ < kMarkBytes && got > 0; end_ += got) {
      got = read(buffer_.data() + end_, buffer_.size() - end_);
    }
    const std::string_view head(buffer_.data(), end_);
    if (!is_gzip(std::as_bytes(std::span(head)))) {
      ended_ = head.empty();
      return !ended_;
    }
    gzip_ = std::make_unique<GzipStream>(name_, head);
    end_ = 0;
  }
  char* const out = buffer_.data() + end_;
  const std::size_t room = buffer_.size() - end_;
  const std::size_t got = gzip_ ? gzip_->read(out, room, read) : read(out, room);
  end_ += got;
  ended_ = got == 0;
  return !ended_;
}

std::string_view Input::fill(std::size_t min_bytes) {
  if (end_ - begin_ >= min_bytes || ended_) return window();
  if (begin_ > 0 && (begin_ == end_ || begin_ + min_bytes > buffer_.size())) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  while (end_ - begin_ < min_bytes) {
    // Grows with the bytes read, because most inputs are shorter than callers may request.
    if (end_ == buffer_.size()) {
      buffer_.resize(std::min(begin_ + min_bytes, std::max(2 * end_, kMinBuffer)));
    }
    if (!read_more()) break;
  }
  return window();
}

void Input::consume(std::size_t count) {
  assert(count <= end_ - begin_);
  begin_ += count;
  offset_ += count;
}

bool Input::skip(std::uint64_t count) {
  const auto in_window = static_cast<std::size_t>(std::min<std::uint64_t>(count, end_ - begin_));
  consume(in_window);
  count -= in_window;
  if (count == 0) return true;
  if (size_) {
    if (count > *size_ - std::min(*size_, offset_)) return false;
    if (!descriptor_->skip(count)) throw system_error(name_, "cannot seek", errno);
    offset_ += count;
    return true;
  }
  while (count > 0) {
    if (fill(1).empty()) return false;
    const auto step = static_cast<std::size_t>(std::min<std::uint64_t>(count, end_ - begin_));
    consume(step);
    count -= step;
  }
  return true;
}

std::string shown_name(const std::string& file) {
  return file == kStandardStream ? "standard input" : file;
}

bool is_rereadable(const std::string& file) {
  struct stat status {};
  return file != kStandardStream && ::stat(file.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

bool is_seekable(const std::string& file) {
  if (!is_rereadable(file)) return false;
  std::vector<std::byte> head(2);
  const auto bytes = open_file(file);
  if (bytes->size() < head.size()) return true;
  bytes->read(0, head);
  return !is_gzip(head);
}

std::vector<char> peek_head(const std::string& file, std::size_t max_bytes,
                            const std::stop_token& stop) {
  auto pipe = heads().find(file);
  if (pipe == heads().end()) {
    auto input = std::make_unique<Input>(file, stop, max_bytes);
    if (is_rereadable(file)) {
      const std::string_view head = input->fill(max_bytes).substr(0, max_bytes);
      return {head.begin(), head.end()};
    }
    pipe = heads().emplace(file, std::move(input)).first;
  }
  const std::string_view head = pipe->second->fill(max_bytes).substr(0, max_bytes);
  return {head.begin(), head.end()};
}

void drop_heads() { heads().clear(); }

}  // namespace terrace::stream
