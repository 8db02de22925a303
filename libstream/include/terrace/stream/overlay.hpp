// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "terrace/stream/atomic_file.hpp"
#include "terrace/stream/store.hpp"

/// An overlay is a file next to a store with other values for some of its points, such as smoothed
/// heights. The store is never changed. A point is identified by its cluster and its index among
/// the cluster's members, the store by its checksum. FORMAT.md describes the bytes.

namespace terrace::stream {

/// The value of member `index` of a cluster.
struct OverlayValue {
  std::uint32_t index = 0;
  double value = 0.0;

  friend bool operator==(const OverlayValue&, const OverlayValue&) = default;
};

/// Returns the names of the overlays in a folder, in ascending order.
[[nodiscard]] std::vector<std::string> overlays_in(const std::filesystem::path& folder);

/// Writes an overlay. It appears under its name, complete and synced, when finish() returns.
/// Memory: about 4096 values, the values of one cluster, and 20 bytes per 4096 values written.
class OverlayWriter {
 public:
  /// `channel` names the quantity; values are in real units, with scale and offset applied. The
  /// store must outlive the writer. Throws: Error if `path` exists and may not be replaced, or
  /// cannot be written; std::invalid_argument for a name of more than 65,535 bytes.
  OverlayWriter(const std::filesystem::path& path, const Store& store, const std::string& channel,
                Naming replace = {});
  ~OverlayWriter();
  OverlayWriter(OverlayWriter&&) noexcept;
  OverlayWriter& operator=(OverlayWriter&&) noexcept;

  /// Adds a value. Values must come in ascending order of cluster ids, and of indices within a
  /// cluster. Throws: std::invalid_argument if the value is out of order or not finite, or if the
  /// store does not have the point. Throws: Error if the file cannot be written or the store is
  /// damaged.
  void add(ClusterId cluster, std::uint32_t index, double value);
  /// Values added so far.
  [[nodiscard]] std::uint64_t values() const;

  /// Publishes the file and returns its size in bytes. Afterwards only values() may be called. A
  /// writer that is destroyed without finish() leaves no file. Throws: Error.
  std::uint64_t finish();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// An overlay opened for reading. Not thread-safe; each thread may open its own. Memory: the
/// directory, 24 bytes per page, and the last page used.
class Overlay {
 public:
  /// Throws: Error if the file is not an overlay, has a newer version or a damaged header or
  /// directory, or was made for another store (naming both checksums).
  static Overlay open(const std::filesystem::path& path, const Store& store);
  ~Overlay();
  Overlay(Overlay&&) noexcept;
  Overlay& operator=(Overlay&&) noexcept;

  [[nodiscard]] const std::filesystem::path& path() const;
  /// The name of the quantity, as passed to the writer.
  [[nodiscard]] const std::string& channel() const;
  [[nodiscard]] std::uint64_t values() const;

  /// Returns the values of a cluster in ascending order of indices, empty if it has none; valid
  /// until the next call. Cost: a binary search over the pages, and reading one page unless it is
  /// the last page used, so visiting clusters in ascending order reads every page once. Throws:
  /// Error if the overlay is damaged.
  [[nodiscard]] std::span<const OverlayValue> find(ClusterId cluster);
  /// Visits all clusters that have values, in ascending order. Throws: Error if the overlay is
  /// damaged.
  void for_each(const std::function<void(ClusterId, std::span<const OverlayValue>)>& visit);

 private:
  struct Impl;
  explicit Overlay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace terrace::stream
