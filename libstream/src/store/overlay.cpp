// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/overlay.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "store/manifest.hpp"
#include "store/overlay_page.hpp"
#include "terrace/stream/byte_source.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {

using namespace store;

namespace {

constexpr const char* kRestoreOverlay = "restore the file or write the overlay again";

std::unique_ptr<ByteSource> open_overlay(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    throw Error(path.string(), "there is no overlay here")
        .remedy("give an overlay written by terrace");
  }
  return open_file(path);
}

/// An entry of the directory.
struct PageEntry {
  std::uint64_t first_cluster = 0, offset = 0, values = 0;
};

constexpr std::size_t kNoPage = std::numeric_limits<std::size_t>::max();

}  // namespace

struct Overlay::Impl {
  std::filesystem::path path;
  std::unique_ptr<ByteSource> file;
  std::vector<LevelInfo> levels;  // of the store
  std::string channel{};
  std::uint64_t values = 0;
  std::vector<PageEntry> pages{};
  std::uint64_t pages_end = 0;
  std::size_t loaded = kNoPage;
  OverlayPage page{};

  [[nodiscard]] Error damaged(std::uint64_t offset, const std::string& cause) const {
    return Error(file->name(), cause).at_byte(offset).remedy(kRestoreOverlay);
  }

  void read_header(const Store& store);
  void read_directory(std::uint64_t count, std::uint64_t header_end, std::uint64_t max_values);
  void load_page(std::size_t number);
};

void Overlay::Impl::read_header(const Store& store) {
  try {
    Bytes bytes(std::min<std::uint64_t>(file->size(), kOverlayHeadBytes));
    file->read(0, std::as_writable_bytes(std::span(bytes)));
    if (bytes.size() < kOverlayMarkBytes + 4 ||
        !std::equal(kOverlayMark, kOverlayMark + kOverlayMarkBytes, bytes.begin())) {
      throw Damage("the file is not an overlay");
    }
    // Checked before anything that may differ in a newer version.
    const auto version = load<std::uint32_t>(bytes.data() + kOverlayMarkBytes);
    if (version > kOverlayVersion) {
      throw Error(
          file->name(),
          fmt::format(
              "overlay version {} was written by a newer terrace; this one reads up to version {}",
              version, kOverlayVersion))
          .remedy("update");
    }
    ByteReader in(ByteView(bytes).subspan(kOverlayMarkBytes + 4));
    const auto store_checksum = in.get<std::uint32_t>();
    const auto count = in.get<std::uint64_t>();
    pages_end = in.get<std::uint64_t>();
    const auto name = in.get<std::uint32_t>();
    const std::uint64_t end = kOverlayHeadBytes + std::uint64_t{name} + 4;
    if (name > kMaxOverlayNameBytes || end > file->size()) {
      throw Damage("the header has an impossible size");
    }
    Bytes rest(name + std::size_t{4});
    file->read(kOverlayHeadBytes, std::as_writable_bytes(std::span(rest)));
    const std::uint32_t checksum = crc32(crc32(bytes), rest.data(), name);
    if (checksum != load<std::uint32_t>(rest.data() + name) || version < 1) {
      throw Damage("the checksum of the header is wrong");
    }
    channel.assign(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(name));
    if (store_checksum != store.checksum()) {
      throw Error(file->name(),
                  fmt::format("was made for the store with the checksum {}, {} has {}",
                              hexadecimal(store_checksum), store.path().string(),
                              hexadecimal(store.checksum())))
          .remedy("give the store that it was made for, or write the overlay again");
    }
    read_directory(count, end, store.points());
  } catch (const Damage& damage) {
    throw damaged(0, damage.what());
  }
}

void Overlay::Impl::read_directory(std::uint64_t count, std::uint64_t header_end,
                                   std::uint64_t max_values) {
  if (pages_end < header_end || pages_end > file->size() - 4 ||
      count != (file->size() - 4 - pages_end) / kOverlayEntryBytes ||
      count * kOverlayEntryBytes != file->size() - 4 - pages_end) {
    throw Damage("the directory does not have the size stated in the header");
  }
  try {
    // Read in pieces, of which only the entries are kept.
    std::uint32_t checksum = 0;
    Bytes bytes;
    std::uint64_t at = pages_end;
    for (std::uint64_t remaining = count; remaining > 0;) {
      const std::uint64_t piece = std::min<std::uint64_t>(remaining, 4096);
      bytes.resize(piece * kOverlayEntryBytes);
      file->read(at, std::as_writable_bytes(std::span(bytes)));
      checksum = crc32(checksum, bytes.data(), bytes.size());
      ByteReader in(bytes);
      for (std::uint64_t i = 0; i < piece; ++i) {
        PageEntry entry;
        entry.first_cluster = in.get<std::uint64_t>();
        entry.offset = in.get<std::uint64_t>();
        entry.values = in.get<std::uint32_t>();
        const bool first = pages.empty();
        if (entry.values == 0 || entry.values > max_values - values) {
          throw Damage("a page has an impossible number of values");
        }
        if (entry.offset >= pages_end ||
            (first ? entry.offset != header_end
                   : entry.offset <= pages.back().offset ||
                         entry.first_cluster <= pages.back().first_cluster)) {
          throw Damage("the pages are not in ascending order");
        }
        values += entry.values;
        pages.push_back(entry);
      }
      at += bytes.size();
      remaining -= piece;
    }
    bytes.resize(4);
    file->read(at, std::as_writable_bytes(std::span(bytes)));
    if (checksum != load<std::uint32_t>(bytes.data())) {
      throw Damage("the checksum of the directory is wrong");
    }
    if (pages.empty() && pages_end != header_end) {
      throw Damage("an overlay without pages has bytes between its header and its directory");
    }
  } catch (const Damage& damage) {
    throw damaged(pages_end, damage.what());
  }
}

void Overlay::Impl::load_page(std::size_t number) {
  if (number == loaded) return;
  loaded = kNoPage;
  const PageEntry& entry = pages[number];
  const bool last = number + 1 == pages.size();
  const std::uint64_t size = (last ? pages_end : pages[number + 1].offset) - entry.offset;
  try {
    if (size > max_overlay_page_bytes(entry.values)) {
      throw Damage("the page is too long for its values");
    }
    Bytes bytes(size);
    file->read(entry.offset, std::as_writable_bytes(std::span(bytes)));
    decode_overlay_page(bytes, entry.values, levels, page);
    if (static_cast<std::uint64_t>(page.clusters.front()) != entry.first_cluster ||
        (!last &&
         static_cast<std::uint64_t>(page.clusters.back()) >= pages[number + 1].first_cluster)) {
      throw Damage("the page does not have the clusters stated in the directory");
    }
  } catch (const Damage& damage) {
    throw damaged(entry.offset, damage.what());
  }
  loaded = number;
}

Overlay::Overlay(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Overlay::~Overlay() = default;
Overlay::Overlay(Overlay&&) noexcept = default;
Overlay& Overlay::operator=(Overlay&&) noexcept = default;

Overlay Overlay::open(const std::filesystem::path& path, const Store& store) {
  auto impl =
      std::make_unique<Impl>(Impl{.path = path,
                                  .file = open_overlay(path),
                                  .levels = {store.levels().begin(), store.levels().end()}});
  impl->read_header(store);
  return Overlay(std::move(impl));
}

const std::filesystem::path& Overlay::path() const { return impl_->path; }
const std::string& Overlay::channel() const { return impl_->channel; }
std::uint64_t Overlay::values() const { return impl_->values; }

std::span<const OverlayValue> Overlay::find(ClusterId cluster) {
  const auto id = static_cast<std::uint64_t>(cluster);
  const auto& pages = impl_->pages;
  const auto next = std::upper_bound(
      pages.begin(), pages.end(), id,
      [](std::uint64_t value, const PageEntry& entry) { return value < entry.first_cluster; });
  if (next == pages.begin()) return {};
  impl_->load_page(static_cast<std::size_t>(next - pages.begin()) - 1);
  const auto& clusters = impl_->page.clusters;
  const auto entry = std::lower_bound(clusters.begin(), clusters.end(), cluster);
  if (entry == clusters.end() || *entry != cluster) return {};
  return impl_->page.of(static_cast<std::size_t>(entry - clusters.begin()));
}

void Overlay::for_each(const std::function<void(ClusterId, std::span<const OverlayValue>)>& visit) {
  for (std::size_t p = 0; p < impl_->pages.size(); ++p) {
    impl_->load_page(p);
    for (std::size_t c = 0; c < impl_->page.clusters.size(); ++c) {
      visit(impl_->page.clusters[c], impl_->page.of(c));
    }
  }
}

}  // namespace terrace::stream
