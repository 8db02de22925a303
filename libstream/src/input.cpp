// SPDX-License-Identifier: Apache-2.0
#include "input.hpp"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <map>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

constexpr std::size_t kBufferBytes = 256u << 10;

/// A pipe whose first bytes have been looked at: it cannot be opened again without losing them.
struct Head {
  int fd = -1;
  std::vector<char> bytes;
};

std::map<std::string, Head>& heads() {
  thread_local std::map<std::string, Head> kept;
  return kept;
}

std::string shown(const std::string& file) {
  return file == kStandardStream ? "standard input" : file;
}

int open_for_reading(const std::string& file) {
  if (file == kStandardStream) return STDIN_FILENO;
  const int fd = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw system_error(file, "cannot open", errno, "check the name and its permissions");
  return fd;
}

/// Returns 0 at the end. Throws: Error with the name of the input.
std::size_t read_some(int fd, char* to, std::size_t most, const std::string& name) {
  for (;;) {
    const ssize_t got = read(fd, to, most);
    if (got >= 0) return static_cast<std::size_t>(got);
    if (errno == EISDIR) {
      throw Error({.file = name,
                   .where = {},
                   .cause = "is a folder, not a file",
                   .remedy = "name the files in it"});
    }
    if (errno != EINTR) throw system_error(name, "cannot read", errno);
  }
}

}  // namespace

Input::Input(const std::string& file) : name_(shown(file)), buffer_(kBufferBytes) {
  const auto kept = heads().find(file);
  if (kept != heads().end()) {
    fd_ = kept->second.fd;
    const std::vector<char>& bytes = kept->second.bytes;
    buffer_.resize(std::max(buffer_.size(), bytes.size()));
    std::copy(bytes.begin(), bytes.end(), buffer_.begin());
    end_ = bytes.size();
    heads().erase(kept);
  } else {
    fd_ = open_for_reading(file);
  }
  owned_ = fd_ != STDIN_FILENO;
  struct stat status {};
  if (fstat(fd_, &status) == 0 && S_ISREG(status.st_mode)) {
    // Standard input that is a file may have been read before: what is left counts.
    const off_t at = owned_ ? 0 : lseek(fd_, 0, SEEK_CUR) - static_cast<off_t>(end_);
    size_ = static_cast<std::uint64_t>(std::max<off_t>(0, status.st_size - std::max<off_t>(0, at)));
    posix_fadvise(fd_, 0, 0, POSIX_FADV_SEQUENTIAL);
  }
}

Input::~Input() {
  if (owned_) close(fd_);
}

bool Input::read_more() {
  const std::size_t got = read_some(fd_, buffer_.data() + end_, buffer_.size() - end_, name_);
  end_ += got;
  ended_ = got == 0;
  return !ended_;
}

std::string_view Input::fill(std::size_t wanted) {
  if (end_ - begin_ >= wanted || ended_) return window();
  if (begin_ > 0 && (begin_ == end_ || begin_ + wanted > buffer_.size())) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
    end_ -= begin_;
    begin_ = 0;
  }
  if (begin_ + wanted > buffer_.size()) buffer_.resize(begin_ + wanted);
  while (end_ - begin_ < wanted && read_more()) {
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
    if (lseek(fd_, static_cast<off_t>(count), SEEK_CUR) < 0) {
      throw system_error(name_, "cannot seek", errno);
    }
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

bool is_rereadable(const std::string& file) {
  struct stat status {};
  return file != kStandardStream && stat(file.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

std::vector<char> peek_head(const std::string& file, std::size_t most) {
  const auto kept = heads().find(file);
  if (kept != heads().end()) return kept->second.bytes;
  Head head{open_for_reading(file), std::vector<char>(most)};
  const bool keep = !is_rereadable(file);
  std::size_t got = 0;
  try {
    while (got < most) {
      const std::size_t step = read_some(head.fd, head.bytes.data() + got, most - got, shown(file));
      if (step == 0) break;
      got += step;
    }
  } catch (...) {
    if (head.fd != STDIN_FILENO) close(head.fd);
    throw;
  }
  head.bytes.resize(got);
  if (!keep) {
    close(head.fd);
    return std::move(head.bytes);
  }
  return heads().emplace(file, std::move(head)).first->second.bytes;
}

void drop_heads() {
  for (auto& [file, head] : heads()) {
    if (head.fd != STDIN_FILENO) close(head.fd);
  }
  heads().clear();
}

}  // namespace terrace::stream
