// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/byte_source.hpp"

#include <cassert>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// A regular file, read with pread(2).
class FileSource final : public ByteSource {
 public:
  explicit FileSource(const std::filesystem::path& path)
      : name_(path.string()), descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    if (descriptor_ < 0) throw system_error(name_, "cannot open", errno, {});
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) {
      const int number = errno;
      ::close(descriptor_);
      throw system_error(name_, "cannot inspect", number, {});
    }
    if (!S_ISREG(status.st_mode)) {
      ::close(descriptor_);
      throw Error(name_, "is not a regular file");
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
  }
  ~FileSource() override { ::close(descriptor_); }
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::uint64_t size() const override { return size_; }

  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    assert(offset + out.size() <= size_);
    for (std::size_t position = 0; position < out.size();) {
      const ssize_t count = ::pread(descriptor_, out.data() + position, out.size() - position,
                                    static_cast<off_t>(offset + position));
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) throw system_error(name_, "cannot read", errno, {});
      if (count == 0) {
        throw Error(name_, "the file ends too early")
            .at_byte(offset + position)
            .remedy("it was truncated while being read: restore it");
      }
      position += static_cast<std::size_t>(count);
    }
  }

 private:
  std::string name_;
  int descriptor_;
  std::uint64_t size_ = 0;
};

class MemorySource final : public ByteSource {
 public:
  MemorySource(std::string name, std::vector<std::byte> bytes)
      : name_(std::move(name)), bytes_(std::move(bytes)) {}

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }

  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    assert(offset + out.size() <= bytes_.size());
    if (!out.empty()) std::memcpy(out.data(), bytes_.data() + offset, out.size());
  }

 private:
  std::string name_;
  std::vector<std::byte> bytes_;
};

class FunctionSource final : public ByteSource {
 public:
  using Read = std::function<void(std::uint64_t, std::span<std::byte>)>;

  FunctionSource(std::string name, std::uint64_t size, Read read)
      : name_(std::move(name)), size_(size), read_(std::move(read)) {}

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::uint64_t size() const override { return size_; }

  void read(std::uint64_t offset, std::span<std::byte> out) const override {
    assert(offset + out.size() <= size_);
    if (!out.empty()) read_(offset, out);
  }

 private:
  std::string name_;
  std::uint64_t size_;
  Read read_;
};

}  // namespace

std::unique_ptr<ByteSource> open_file(const std::filesystem::path& path) {
  return std::make_unique<FileSource>(path);
}

std::unique_ptr<ByteSource> bytes_in_memory(std::string name, std::vector<std::byte> bytes) {
  return std::make_unique<MemorySource>(std::move(name), std::move(bytes));
}

std::unique_ptr<ByteSource> bytes_by_function(
    std::string name, std::uint64_t size,
    std::function<void(std::uint64_t offset, std::span<std::byte> out)> read) {
  return std::make_unique<FunctionSource>(std::move(name), size, std::move(read));
}

}  // namespace terrace::stream
