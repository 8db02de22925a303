// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>

#include <terrace/stream/message.hpp>
#include <terrace/stream/source.hpp>

namespace terrace::terrain {

/// Counts heights that are probably nodata values that the file does not declare: impossible
/// heights such as -3.4e38, and common nodata values such as -9999 far below all other heights.
/// They are kept, and a note reports them.
class UndeclaredVoids {
 public:
  /// info: of the source; must outlive this object.
  explicit UndeclaredVoids(const stream::SourceInfo& info) : info_(info) {}

  /// Adds a block with heights in stored coordinates. Thread-safe.
  void add(const stream::PointBlock& block);
  /// Returns the note; empty if no such height was added.
  [[nodiscard]] stream::Message note() const;

 private:
  static constexpr std::size_t kUsual = 8;
  struct Tally {
    std::uint64_t beyond = 0;  ///< impossible heights
    double value = 0;          ///< one of them, stored
    std::array<std::uint64_t, kUsual> usual{};
    double least = 1e300;  ///< least of all other heights
  };

  [[nodiscard]] double height(double stored) const {
    return stored * info_.coordinates[2].scale + info_.coordinates[2].offset;
  }
  [[nodiscard]] stream::Message note_of(std::uint64_t count, double stored,
                                        const std::string& heights) const;

  const stream::SourceInfo& info_;
  std::mutex mutex_;
  Tally tally_;
};

}  // namespace terrace::terrain
