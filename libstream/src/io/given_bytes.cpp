// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/given_bytes.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <list>
#include <map>
#include <utility>

#include "io/text.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

std::string text_of(const std::vector<ByteRange>& ranges) {
  if (ranges.empty()) return "nothing is missing";
  return ranges.front().file + ": bytes from " + std::to_string(ranges.front().offset) +
         " on have not been given";
}

Error fault(const std::string& file, const std::string& cause) { return Error(file, cause); }

}  // namespace

MissingBytes::MissingBytes(std::vector<ByteRange> ranges)
    : std::runtime_error(text_of(ranges)), ranges_(std::move(ranges)) {}

struct GivenBytes::Impl {
  struct Part;
  using Uses = std::list<Part>;
  struct File {
    std::uint64_t size = 0;
    std::map<std::uint64_t, Uses::iterator> parts;  // by offset; they do not overlap
  };
  struct Part {
    File* file = nullptr;
    std::uint64_t offset = 0;
    std::vector<std::byte> bytes;

    [[nodiscard]] std::uint64_t end() const { return offset + bytes.size(); }
  };

  std::map<std::string, File> files;
  Uses uses;  // least recently used first
  std::uint64_t max_bytes = 0, bytes = 0;

  void drop(Uses::iterator part) {
    bytes -= part->bytes.size();
    part->file->parts.erase(part->offset);
    uses.erase(part);
  }
  /// Returns the part that contains this byte, or the next part, or the end.
  static auto part_at(File& file, std::uint64_t offset) {
    auto at = file.parts.upper_bound(offset);
    if (at != file.parts.begin() && std::prev(at)->second->end() > offset) --at;
    return at;
  }
  void give(File& file, std::uint64_t offset, std::span<const std::byte> source) {
    const std::uint64_t end = offset + source.size();
    for (std::uint64_t next = offset; next < end;) {
      const auto at = part_at(file, next);
      if (at != file.parts.end() && at->first <= next) {
        next = at->second->end();
        continue;
      }
      const std::uint64_t stop = at == file.parts.end() ? end : std::min(end, at->first);
      const auto piece = source.subspan(static_cast<std::size_t>(next - offset),
                                        static_cast<std::size_t>(stop - next));
      uses.push_back({&file, next, {piece.begin(), piece.end()}});
      file.parts.emplace(next, std::prev(uses.end()));
      bytes += piece.size();
      next = stop;
    }
    while (bytes > max_bytes && uses.size() > 1) drop(uses.begin());
  }
  void read(const std::string& name, File& file, std::uint64_t offset, std::span<std::byte> out) {
    for (std::size_t position = 0; position < out.size();) {
      const std::uint64_t next = offset + position;
      const auto at = part_at(file, next);
      // Requests all of the range: parts of it that are held may be dropped before the rest
      // arrives.
      if (at == file.parts.end() || at->first > next) {
        throw MissingBytes({{name, offset, out.size()}});
      }
      Part& part = *at->second;
      const std::size_t skip = static_cast<std::size_t>(next - part.offset);
      const std::size_t size = std::min(part.bytes.size() - skip, out.size() - position);
      std::memcpy(out.data() + position, part.bytes.data() + skip, size);
      uses.splice(uses.end(), uses, at->second);
      position += size;
    }
  }
};

GivenBytes::GivenBytes(std::uint64_t max_bytes) : impl_(std::make_shared<Impl>()) {
  impl_->max_bytes = max_bytes;
}
GivenBytes::~GivenBytes() = default;
GivenBytes::GivenBytes(GivenBytes&&) noexcept = default;
GivenBytes& GivenBytes::operator=(GivenBytes&&) noexcept = default;

void GivenBytes::add_file(const std::string& name, std::uint64_t size) {
  const auto [at, added] = impl_->files.try_emplace(name);
  if (added) {
    at->second.size = size;
  } else if (at->second.size != size) {
    throw fault(name, "was added with " + counted(at->second.size, "byte") + " and now has " +
                          std::to_string(size));
  }
}

void GivenBytes::give(const std::string& name, std::uint64_t offset,
                      std::span<const std::byte> bytes) {
  const auto at = impl_->files.find(name);
  if (at == impl_->files.end()) throw fault(name, "unknown file: call add() first");
  if (offset > at->second.size || bytes.size() > at->second.size - offset) {
    throw fault(name, "the given bytes extend beyond the end of the file");
  }
  impl_->give(at->second, offset, bytes);
}

void GivenBytes::forget(const std::string& name) {
  const auto at = impl_->files.find(name);
  if (at == impl_->files.end()) return;
  while (!at->second.parts.empty()) impl_->drop(at->second.parts.begin()->second);
}

OpenByName GivenBytes::open() const {
  return [impl = impl_](const std::string& name) {
    const auto at = impl->files.find(name);
    if (at == impl->files.end()) throw fault(name, "unknown file: call add() first");
    Impl::File& file = at->second;
    return bytes_by_function(name, file.size,
                             [impl, name, &file](std::uint64_t offset, std::span<std::byte> out) {
                               impl->read(name, file, offset, out);
                             });
  };
}

bool GivenBytes::has(const ByteRange& range) const {
  const auto file = impl_->files.find(range.file);
  if (file == impl_->files.end()) return false;
  for (std::uint64_t next = range.offset; next < range.offset + range.bytes;) {
    const auto at = Impl::part_at(file->second, next);
    if (at == file->second.parts.end() || at->first > next) return false;
    next = at->second->end();
  }
  return true;
}

std::uint64_t GivenBytes::bytes() const { return impl_->bytes; }

}  // namespace terrace::stream
