// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "cuda/device_band.hpp"
#include "terrace/cluster/point.hpp"

/// Complete linkage in rounds on a device (see device_primitives.hpp). Everything except the loop
/// over the rounds runs there. Two counters come back per round, and the links at the end.

namespace terrace::cluster::device {

/// Returns whether so few clusters are left that the band is rebuilt for them, in one sequential
/// pass over memory, instead of being updated in place, column by column. The new band then has at
/// most 0.64 times the previous size.
[[nodiscard]] constexpr bool worth_compacting(std::uint32_t clusters, std::uint32_t slots) {
  return 5 * std::uint64_t{clusters} <= 4 * std::uint64_t{slots};
}

/// Returns the maximum memory that complete_rounds() takes on the device, in bytes.
template <class Entry>
[[nodiscard]] std::uint64_t complete_rounds_bytes(std::uint64_t points) {
  const std::uint64_t slots = points | 1;
  const std::uint64_t band = slots * (slots / 2) * sizeof(Entry);
  const std::uint64_t parts = NearestOfRows<Entry>::max_parts(static_cast<std::uint32_t>(slots));
  const std::uint64_t per_slot = parts * (4 + sizeof(Entry)) + 80 + 4 * sizeof(Entry);
  return band + band / 25 * 16 + slots * per_slot + kSmallMemory;
}

template <class Entry, class Device>
class CompleteRounds {
 public:
  CompleteRounds(Device& device, std::span<const Point3> points)
      : device_(device),
        points_(static_cast<std::uint32_t>(points.size())),
        clusters_(points_),
        now_(device, points_ | 1),
        next_(device, points_ | 1),
        counts_(device.template allocate<RoundCounts>(1)),
        scan_(device.template allocate<std::uint32_t>(kScanCounts)),
        new_of_old_(device.template allocate<std::uint32_t>(points_ | 1)),
        old_of_new_(device.template allocate<std::uint32_t>(points_ | 1)),
        link_other_(device.template allocate<std::uint32_t>(points_)),
        link_round_(device.template allocate<std::uint32_t>(points_)),
        link_square_(device.template allocate<Entry>(points_)) {
    const std::uint32_t slots = points_ | 1;
    const std::size_t parts = std::size_t{NearestOfRows<Entry>::max_parts(slots)} * slots;
    part_value_ = device.template allocate<Entry>(parts);
    part_index_ = device.template allocate<std::uint32_t>(parts);
    band_ = device.template allocate<Entry>(band_size(slots));
    fill(points, slots);
  }

  /// Returns the links in the order of rounds. Within a round they are independent of each other.
  std::vector<RoundLink> run() {
    nearest_of_all();
    std::uint32_t round = 0;
    while (clusters_ > 1) {
      device_.clear(counts_.data(), 1);
      device_.each(s_.slots, MatchPairs<Entry>{s_, counts_.data(), round, link_other_.data(),
                                               link_round_.data(), link_square_.data()});
      device_.each(s_.slots, MarkStale<Entry>{s_, counts_.data()});
      RoundCounts counts{};
      device_.download(&counts, counts_.data(), 1);
      // The globally nearest pair always exists, so this is an error of the device.
      if (counts.pairs == 0 || counts.pairs >= clusters_) {
        throw std::runtime_error("the device found no pair to merge, or too many");
      }
      clusters_ -= counts.pairs;
      ++round;
      if (clusters_ == 1) break;
      if (worth_compacting(clusters_, s_.slots)) {
        compact();
      } else {
        device_.lanes(s_.slots, UpdateBand<Entry>{s_});
      }
      // Finding one neighbour alone reads its columns one by one, which is eight times as expensive
      // as finding all together.
      if (4 * std::uint64_t{counts.stale} >= clusters_) {
        nearest_of_all();
      } else {
        device_.reduce(s_.slots, NearestOfStale<Entry>{s_});
      }
    }
    return links(round);
  }

 private:
  template <class T>
  using Memory = typename Device::template Memory<T>;

  struct Columns {
    Columns(Device& device, std::uint32_t slots)
        : alive(device.template allocate<std::uint32_t>(slots)),
          stale(device.template allocate<std::uint32_t>(slots)),
          nearest(device.template allocate<std::uint32_t>(slots)),
          partner(device.template allocate<std::uint32_t>(slots)),
          original(device.template allocate<std::uint32_t>(slots)),
          distance(device.template allocate<Entry>(slots)) {}
    Memory<std::uint32_t> alive, stale, nearest, partner, original;
    Memory<Entry> distance;
  };

  static std::size_t band_size(std::uint32_t slots) { return std::size_t{slots} * (slots / 2); }

  static Slots<Entry> view(std::uint32_t slots, Columns& columns, Memory<Entry>& band) {
    return {slots,
            slots / 2,
            band.data(),
            columns.alive.data(),
            columns.stale.data(),
            columns.nearest.data(),
            columns.distance.data(),
            columns.partner.data(),
            columns.original.data()};
  }

  void fill(std::span<const Point3> points, std::uint32_t slots) {
    std::vector<double> host(points.size());
    Memory<double> axes[3];
    for (unsigned axis = 0; axis < 3; ++axis) {
      for (std::size_t i = 0; i < points.size(); ++i) host[i] = points[i][axis];
      axes[axis] = device_.template allocate<double>(points.size());
      device_.upload(axes[axis].data(), host.data(), host.size());
    }
    s_ = view(slots, now_, band_);
    device_.each(slots, FillSlots<Entry>{s_, points_});
    device_.lanes(slots,
                  FillBand<Entry>{s_, axes[0].data(), axes[1].data(), axes[2].data(), points_});
    device_.wait();  // the coordinates are freed next
  }

  void nearest_of_all() {
    const std::uint32_t rows = NearestOfRows<Entry>::rows_of(s_.slots);
    const std::uint32_t parts = (s_.slots + rows - 1) / rows;
    device_.reduce(s_.slots, NearestOfRow<Entry>{s_});
    device_.each(std::size_t{parts} * s_.slots,
                 NearestOfRows<Entry>{s_, part_value_.data(), part_index_.data(), rows});
    device_.each(s_.slots,
                 NearestOfParts<Entry>{s_, part_value_.data(), part_index_.data(), parts});
  }

  void compact() {
    const std::uint32_t slots = clusters_ | 1;
    if (spare_.size() < band_size(slots)) {
      spare_ = device_.template allocate<Entry>(band_size(slots));
    }
    const Slots<Entry> to = view(slots, next_, spare_);
    device_.clear(scan_.data(), kScanCounts);
    device_.each(kScanParts, CountAlive<Entry>{s_, scan_.data()});
    device_.each(kScanParts,
                 NumberAlive<Entry>{s_, scan_.data(), new_of_old_.data(), old_of_new_.data()});
    device_.lanes(slots, MergeBand<Entry>{s_, to, old_of_new_.data(), clusters_});
    device_.each(slots,
                 MergeSlots<Entry>{s_, to, new_of_old_.data(), old_of_new_.data(), clusters_});
    s_ = to;
    std::swap(now_, next_);
    std::swap(band_, spare_);
  }

  std::vector<RoundLink> links(std::uint32_t rounds) {
    std::vector<std::uint32_t> other(points_);
    std::vector<std::uint32_t> round(points_);
    std::vector<Entry> square(points_);
    // Point 0 is always in the lowest slot, so its cluster never disappears.
    device_.download(other.data(), link_other_.data(), points_);
    device_.download(round.data(), link_round_.data(), points_);
    device_.download(square.data(), link_square_.data(), points_);
    std::vector<std::size_t> place(rounds + 1, 0);
    for (std::uint32_t j = 1; j < points_; ++j) ++place[round[j] + 1];
    for (std::size_t r = 1; r <= rounds; ++r) place[r] += place[r - 1];
    std::vector<RoundLink> result(points_ - 1);
    for (std::uint32_t j = 1; j < points_; ++j) {
      result[place[round[j]]++] = {other[j], j, static_cast<double>(square[j]), round[j]};
    }
    return result;
  }

  Device& device_;
  std::uint32_t points_;
  std::uint32_t clusters_;
  Columns now_, next_;
  Memory<RoundCounts> counts_;
  Memory<std::uint32_t> scan_, new_of_old_, old_of_new_, link_other_, link_round_, part_index_;
  Memory<Entry> link_square_, part_value_, band_, spare_;
  Slots<Entry> s_;
};

/// Returns the links of all merges.
/// points: at least two, fewer than 2^31, as scaled by LinkagePoints.
/// Throws: whatever the device throws.
template <class Entry, class Device>
std::vector<RoundLink> complete_rounds(Device& device, std::span<const Point3> points) {
  return CompleteRounds<Entry, Device>(device, points).run();
}

}  // namespace terrace::cluster::device
