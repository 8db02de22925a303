// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include <fmt/core.h>

#include "io/text.hpp"
#include "store/overlay_page.hpp"
#include "terrace/stream/atomic_file.hpp"

namespace terrace::stream {

using namespace store;

namespace {

std::span<const std::byte> as_bytes(const Bytes& bytes) {
  return std::as_bytes(std::span(bytes.data(), bytes.size()));
}

}  // namespace

struct OverlayWriter::Impl {
  AtomicFile file;
  const Store& store;
  std::string channel;
  OverlayPage page{};
  std::uint64_t pages = 0, values = 0;
  Bytes directory{};
  std::uint64_t last_cluster = 0;
  std::uint32_t last_index = 0;
  std::optional<ClusterId> current_cluster{};  // the cluster to which `members` refers
  std::uint32_t members = 0;

  [[nodiscard]] Bytes header() const {
    Bytes out(kOverlayMark, kOverlayMark + kOverlayMarkBytes);
    put(out, kOverlayVersion);
    put(out, store.checksum());
    put(out, pages);
    put(out, file.size());
    put(out, static_cast<std::uint32_t>(channel.size()));
    out.insert(out.end(), channel.begin(), channel.end());
    put(out, crc32(out));
    return out;
  }

  void write_page() {
    put(directory, static_cast<std::uint64_t>(page.clusters.front()));
    put(directory, file.size());
    put(directory, static_cast<std::uint32_t>(page.values.size()));
    file.write(as_bytes(encode_overlay_page(page)));
    ++pages;
    page.clear();
  }

  [[noreturn]] void refuse(ClusterId cluster, std::uint32_t index, const std::string& cause) const {
    throw std::invalid_argument(fmt::format("value {} of the overlay, cluster {}/{}, point {}: {}",
                                            values, level_of(cluster), ordinal_of(cluster), index,
                                            cause));
  }

  void look_up(ClusterId cluster, std::uint32_t index) {
    if (current_cluster == cluster) return;
    const unsigned level = level_of(cluster);
    if (level > store.top() || ordinal_of(cluster) >= store.levels()[level].clusters) {
      refuse(cluster, index, "the store has no such cluster");
    }
    members = store.record(cluster).points;
    current_cluster = cluster;
  }
};

OverlayWriter::OverlayWriter(const std::filesystem::path& path, const Store& store,
                             const std::string& channel, Naming replace) {
  if (channel.size() > kMaxOverlayNameBytes) {
    throw std::invalid_argument("the name of an overlay's channel has " +
                                counted(channel.size(), "byte") + ", more than the limit of 65535");
  }
  impl_ = std::make_unique<Impl>(
      Impl{.file = AtomicFile(path, std::move(replace)), .store = store, .channel = channel});
  // The counts are written when they are known.
  impl_->file.write(as_bytes(impl_->header()));
}

OverlayWriter::~OverlayWriter() = default;
OverlayWriter::OverlayWriter(OverlayWriter&&) noexcept = default;
OverlayWriter& OverlayWriter::operator=(OverlayWriter&&) noexcept = default;

void OverlayWriter::add(ClusterId cluster, std::uint32_t index, double value) {
  Impl& impl = *impl_;
  const auto id = static_cast<std::uint64_t>(cluster);
  const bool first = impl.values == 0;
  if (!first && (id < impl.last_cluster || (id == impl.last_cluster && index <= impl.last_index))) {
    impl.refuse(cluster, index, "does not come after the previous value");
  }
  if (!std::isfinite(value)) impl.refuse(cluster, index, "is not a finite number");
  impl.look_up(cluster, index);
  if (index >= impl.members) {
    impl.refuse(cluster, index, "the cluster has " + counted(impl.members, "point"));
  }
  if (id != impl.last_cluster && impl.page.values.size() >= kOverlayPageValues) impl.write_page();
  impl.page.add(cluster, {index, value});
  impl.last_cluster = id;
  impl.last_index = index;
  ++impl.values;
}

std::uint64_t OverlayWriter::values() const { return impl_->values; }

std::uint64_t OverlayWriter::finish() {
  Impl& impl = *impl_;
  if (!impl.page.values.empty()) impl.write_page();
  impl.file.write_at(0, as_bytes(impl.header()));
  put(impl.directory, crc32(impl.directory));
  impl.file.write(as_bytes(impl.directory));
  const std::uint64_t bytes = impl.file.size();
  impl.file.commit();
  return bytes;
}

}  // namespace terrace::stream
