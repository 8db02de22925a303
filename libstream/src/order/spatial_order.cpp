// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/spatial_order.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <future>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <terrace/base/thread_team.hpp>

#include "order/kd_cut.hpp"
#include "order/point_buckets.hpp"
#include "order/record_packer.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Points of a window, which are judged together.
constexpr std::size_t kWindowPoints = 1u << 18;
/// A window is judged by every fourth of its points. In a stream that is in order, every fourth
/// window is judged.
constexpr std::size_t kSampleStep = 4;
constexpr std::size_t kWindowStep = 4;
/// Blocks are not compact if they are wider than a k-d tree's by more than this factor.
constexpr double kMaxSpread = 2.0;
/// Buckets are the leaves of a k-d tree of this depth.
constexpr unsigned kDepth = 8;
/// Maximum number of points that are put in order at once.
constexpr std::uint64_t kMaxRegionPoints = 1u << 18;

std::size_t blocks_of(std::size_t points, std::size_t block_points) {
  return (points + block_points - 1) / block_points;
}

/// Returns the sum of the widths over all axes of the blocks that start at `begins`. lengths: of
/// the axes' units.
double widths_of(std::span<const NumberedPoint> points, std::span<const std::size_t> begins,
                 const std::array<double, 3>& lengths) {
  double widths = 0;
  for (std::size_t i = 0; i + 1 < begins.size(); ++i) {
    Box3 box;
    for (std::size_t p = begins[i]; p < begins[i + 1]; ++p) box.include(points[p].place);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      widths += (box.max[axis] - box.min[axis]) * lengths[axis];
    }
  }
  return widths;
}

/// A window whose box has a greater share of the source's box represents all of it.
constexpr double kRepresentativeShare = 0.25;
/// Points that go to the buckets together, in about kSharesOfBucket shares if they come from one
/// bucket.
constexpr std::size_t kSharedPoints = 1u << 16;
constexpr std::size_t kSharesOfBucket = 16;
/// Number of buckets that a thread fills at a time.
constexpr std::size_t kBucketsPerTask = 4;

/// Returns the memory in bytes of the points that are held to be judged or to be delivered next,
/// and of the ends of all buckets.
std::uint64_t bytes_to_order(const SourceInfo& info, unsigned parts_ahead) {
  static_assert(kWindowPoints <= kMaxRegionPoints);
  const std::uint64_t point = sizeof(Point3) + info.payload_size() + sizeof(NumberedPoint);
  return std::max(kMaxRegionPoints + kSharedPoints, (1 + parts_ahead) * kMaxRegionPoints) * point +
         (std::uint64_t{kBucketBytes} << kDepth);
}

/// Implements in_spatial_order(). State describes what the next call of next() does.
class SpatialSource final : public OrderedSource {
 public:
  SpatialSource(std::unique_ptr<PointSource> source, SpatialOrderOptions options)
      : source_(std::move(source)),
        options_(std::move(options)),
        state_(options_.order == Order::stream || source_->info().grid ? State::unordered
                                                                       : State::opening),
        ordering_bytes_(
            state_ == State::unordered ? 0 : bytes_to_order(source_->info(), options_.parts_ahead)),
        team_(options_.threads) {}

  [[nodiscard]] const SourceInfo& info() const override { return source_->info(); }
  [[nodiscard]] std::uint64_t reading_bytes() const override {
    return source_->reading_bytes() + ordering_bytes_;
  }
  void refine(double cell_aspect, std::uint64_t memory_bytes) override {
    source_->refine(cell_aspect, memory_bytes);
  }
  [[nodiscard]] Report report() const override { return report_; }

  [[nodiscard]] Progress progress() const override {
    Progress progress = source_->progress();
    progress.points = delivered_;
    if (total_ > 0)
      progress.fraction = static_cast<double>(delivered_) / static_cast<double>(total_);
    return progress;
  }

  bool next(PointBlock& block) override {
    if (options_.stop.stop_requested()) throw Stopped();
    if (state_ == State::opening) open();
    if (state_ == State::gathering) gather();
    if (state_ == State::delivering) {
      deliver(block);
    } else if (!window_.empty()) {
      block = std::move(window_.front());
      window_.pop_front();
    } else if (next_block(block) && state_ == State::judging) {
      judge(block);
    }
    delivered_ += block.size();
    return !block.empty();
  }

 private:
  enum class State : std::uint8_t { opening, unordered, judging, gathering, delivering };

  /// Reads the next block of the source.
  bool next_block(PointBlock& block) {
    if (lookahead_.empty()) return source_->next(block);
    std::swap(block, lookahead_);
    lookahead_.clear();
    return true;
  }

  /// Reads as many blocks of the source as fit into one. Thousands of files may have one point
  /// each, and memory must not grow with the number of blocks.
  bool next_full_block(PointBlock& block) {
    block.clear();
    for (; !ended_; lookahead_.clear()) {
      if (lookahead_.empty() && !source_->next(lookahead_)) {
        ended_ = true;
      } else if (block.empty()) {
        std::swap(block, lookahead_);
      } else if (block.size() + lookahead_.size() <= options_.block_points) {
        block.positions.insert(block.positions.end(), lookahead_.positions.begin(),
                               lookahead_.positions.end());
        block.payload.insert(block.payload.end(), lookahead_.payload.begin(),
                             lookahead_.payload.end());
      } else {
        break;
      }
    }
    return !block.empty();
  }

  /// Reads the first window, which is held until it has been judged.
  void open() {
    state_ = State::judging;
    bool more = true;
    while (window_points_ < kWindowPoints && more) {
      PointBlock block;
      more = next_full_block(block);
      sample_window(block);
      // A source may reserve room for more points than it delivers.
      if (block.positions.capacity() > block.size() + block.size() / 4) {
        block.positions.shrink_to_fit();
        block.payload.shrink_to_fit();
      }
      if (!block.empty()) window_.push_back(std::move(block));
    }
    if (window_points_ > 0 && (options_.order == Order::spatial || spread() > kMaxSpread)) {
      report_.reordered = true;
      state_ = State::gathering;
      if (!more) load_window();
    } else {
      end_window();
    }
  }

  /// Judges blocks that are delivered. Points after a window that is not compact are put in order.
  void judge(const PointBlock& block) {
    if (points_to_skip_ > 0) {
      points_to_skip_ -= std::min<std::uint64_t>(points_to_skip_, block.size());
      return;
    }
    sample_window(block);
    if (window_points_ < kWindowPoints) return;
    if (spread() > kMaxSpread) {
      report_.reordered = true;
      state_ = State::gathering;
    } else {
      end_window();
    }
  }

  /// Adds points of a block to those that represent its window.
  void sample_window(const PointBlock& block) {
    places_.reserve(kWindowPoints / kSampleStep + block.size());
    for (const Point3& p : block.positions) {
      if (window_points_++ % kSampleStep == 0) places_.push_back({p, places_.size()});
    }
  }

  void end_window() {
    places_.clear();
    window_points_ = 0;
    points_to_skip_ = (kWindowStep - 1) * kWindowPoints;
  }

  /// Returns the spread of the window represented by `places_`, which it reorders.
  double spread() {
    const std::size_t blocks =
        blocks_of(places_.size(), std::max<std::size_t>(options_.block_points / kSampleStep, 1));
    std::vector<std::size_t> begins;
    for (std::size_t b = 0; b <= blocks; ++b) begins.push_back(b * places_.size() / blocks);
    measure_units();
    const double as_read = widths_of(places_, begins, lengths_);
    const double compact =
        widths_of(places_, cut_in_pieces(std::span(places_), blocks, lengths_), lengths_);
    const double spread = compact > 0 ? as_read / compact : 1.0;
    report_.spread = std::max(report_.spread, spread);
    return spread;
  }

  void measure_units() {
    if (!options_.unit_lengths) return;
    Box3 box;
    for (const NumberedPoint& point : places_) box.include(point.place);
    lengths_ = options_.unit_lengths(box);
  }

  void load_window() {
    packed_.emplace(info());
    Region region;
    std::vector<std::byte> records;
    for (const PointBlock& block : window_) {
      packed_->pack(block, records);
      region.records.insert(region.records.end(), records.begin(), records.end());
    }
    window_.clear();
    region_ = cut_region(std::move(region));
    total_ = delivered_ + region_.in_order.size();
    state_ = State::delivering;
  }

  /// Puts the window, if it is held, and all points that follow into buckets.
  void gather() {
    if (!window_.empty()) places_.clear();
    for (const PointBlock& block : window_) {
      for (const Point3& p : block.positions) places_.push_back({p, places_.size()});
    }
    measure_units();
    spread_places();
    planes_ = kd_planes(places_, kDepth, lengths_);
    packed_.emplace(info());
    file_.emplace(info().files.empty() ? std::string("points") : info().files.front(),
                  options_.folder, packed_->record_bytes());
    std::vector<Bucket> buckets(planes_.size() + 1);
    const auto next_of_all = [&](PointBlock& block) {
      if (window_.empty()) return next_full_block(block);
      block = std::move(window_.front());
      window_.pop_front();
      return true;
    };
    std::deque<Share> shares;
    std::mutex reading;
    total_ = delivered_;
    for (bool more = true; more;) {
      if (options_.stop.stop_requested()) throw Stopped();
      std::size_t count = 0, points = 0;
      // The thread that reads a block also sorts it while it is cached, and another reads the next
      // block.
      // Written before more is read, so that a full disk is reported even if the input's producer
      // idles.
      team_.run(team_.threads(), [&](std::size_t, std::size_t) {
        std::unique_lock lock(reading);
        while (more && points < kSharedPoints) {
          if (count == shares.size()) shares.emplace_back();
          Share& share = shares[count];
          more = false;  // no other thread may read if this fails
          if (!next_of_all(share.block)) return;
          more = true;
          ++count;
          points += share.block.size();
          lock.unlock();
          find_leaves(share, share.block.size(),
                      [&](std::size_t p) -> const Point3& { return share.block.positions[p]; });
          packed_->sort(share.block, share.leaves, planes_.size() + 1, share.sorted, share.begins);
          lock.lock();
        }
      });
      total_ += points;
      distribute(shares, count, buckets);
      if (options_.reading) options_.reading(source_->progress());
    }
    push(std::move(buckets), total_);
    report_.temporary_bytes = file_->bytes();
    state_ = State::delivering;
  }

  /// A window often covers only a corner of the whole, such as the first swath of a survey. If the
  /// source states a larger box, replaces most of the window's points by places spread evenly over
  /// that box, in proportion to the points still to come. Otherwise nearly all of these would go to
  /// the outermost buckets, which would have to be divided later.
  void spread_places() {
    const std::optional<Box3>& bounds = info().stated_bounds;
    const std::uint64_t points = info().points.value_or(0);
    if (!bounds || points <= places_.size()) return;
    Box3 window;
    for (const NumberedPoint& point : places_) window.include(point.place);
    std::array<double, 3> lengths{}, parts{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double length = bounds->max[axis] - bounds->min[axis];
      if (!(length >= 0) || !std::isfinite(length)) return;
      lengths[axis] = length * lengths_[axis];
      parts[axis] = length > 0 ? (window.max[axis] - window.min[axis]) / length : 1;
    }
    // The shortest axis does not count: on land it is the height, which one outlier may stretch.
    parts[static_cast<std::size_t>(std::ranges::min_element(lengths) - lengths.begin())] = 1;
    const double window_share =
        std::min(parts[0], 1.0) * std::min(parts[1], 1.0) * std::min(parts[2], 1.0);
    if (window_share > kRepresentativeShare) return;
    const std::size_t count = places_.size();
    const double share = std::max(static_cast<double>(count) / static_cast<double>(points), 0.125);
    const auto window_places = static_cast<std::size_t>(static_cast<double>(count) * share);
    for (std::size_t i = 0; i < window_places; ++i) places_[i] = places_[i * count / window_places];
    for (std::size_t i = window_places; i < count; ++i) {
      // The additive sequence of low discrepancy in three dimensions: powers of 1 / 1.2207...
      constexpr std::array<double, 3> kSteps{0.8191725133961645, 0.6710436067037893,
                                             0.5497004779019703};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double at = kSteps[axis] * static_cast<double>(i);
        places_[i].place[axis] =
            bounds->min[axis] + (at - std::floor(at)) * (bounds->max[axis] - bounds->min[axis]);
      }
    }
    for (std::size_t i = 0; i < count; ++i) places_[i].number = i;
  }

  /// A share of the points that go to the buckets.
  struct Share {
    PointBlock block;                   ///< if from the source
    std::vector<std::byte> records;     ///< if from another bucket
    std::vector<NumberedPoint> places;  ///< of these records
    std::vector<std::uint16_t> leaves;  ///< by record
    std::vector<std::byte> sorted;      ///< the records
    std::vector<std::size_t> begins;    ///< of each leaf's, and the end
  };

  template <class PlaceOf>
  void find_leaves(Share& share, std::size_t count, const PlaceOf& place_of) const {
    share.leaves.resize(count);
    kd_leaves(planes_, count, place_of, [&](std::size_t i, std::size_t leaf) {
      share.leaves[i] = static_cast<std::uint16_t>(leaf);
    });
  }

  /// Appends the records of the first `count` shares to the buckets, in order.
  void distribute(const std::deque<Share>& shares, std::size_t count,
                  std::vector<Bucket>& buckets) {
    while (packers_.size() < team_.threads()) packers_.emplace_back(packed_->record_bytes());
    team_.run(buckets.size() / kBucketsPerTask, [&](std::size_t i, std::size_t worker) {
      for (std::size_t b = i * kBucketsPerTask; b < (i + 1) * kBucketsPerTask; ++b) {
        for (std::size_t s = 0; s < count; ++s) {
          const Share& share = shares[s];
          const std::size_t bytes = packed_->record_bytes(), first = share.begins[b] * bytes;
          file_->append(buckets[b],
                        std::span(share.sorted).subspan(first, share.begins[b + 1] * bytes - first),
                        packers_[worker]);
        }
      }
    });
  }

  /// Makes these buckets the next to be delivered, joining small ones. A bucket of more than
  /// `divisible` records is not divided further: planes did not divide it, so most of its points
  /// are at one place.
  void push(std::vector<Bucket> buckets, std::uint64_t divisible) {
    std::vector<Bucket> joined;
    join(buckets, joined);
    // The first must be last in the list.
    for (; !joined.empty(); joined.pop_back()) {
      const bool small = file_->records(joined.back()) <= divisible;
      pending_.push_back({std::move(joined.back()), small});
    }
  }

  /// Joins the buckets of a subtree of the k-d tree if they fit into one region.
  void join(std::span<Bucket> buckets, std::vector<Bucket>& joined) {
    std::uint64_t records = 0;
    for (const Bucket& bucket : buckets) records += file_->records(bucket);
    if (records == 0) return;
    if (buckets.size() > 1 && records > kMaxRegionPoints) {
      join(buckets.first(buckets.size() / 2), joined);
      join(buckets.subspan(buckets.size() / 2), joined);
      return;
    }
    Bucket merged;
    for (Bucket& bucket : buckets) merged.append(std::move(bucket));
    joined.push_back(std::move(merged));
  }

  /// Fills the block with the next points; leaves it empty at the end.
  void deliver(PointBlock& block) {
    while (next_piece_ + 1 >= region_.pieces.size()) {
      if (!region_.records.empty()) free_regions_.push_back(std::exchange(region_, {}));
      prepare_ahead();
      if (prepared_.empty()) {
        file_.reset();
        return block.clear();
      }
      region_ = prepared_.front().get();
      prepared_.pop_front();
      next_piece_ = 0;
      if (options_.parts_ahead > 0) prepare_ahead();
    }
    const std::size_t begin = region_.pieces[next_piece_], end = region_.pieces[next_piece_ + 1];
    ++next_piece_;
    packed_->unpack(region_.records, std::span(region_.in_order).subspan(begin, end - begin),
                    block);
  }

  /// Points that are prepared together and delivered piece by piece.
  struct Region {
    std::vector<std::byte> records;
    std::vector<std::size_t> pieces;      ///< beginning of each, and the end
    std::vector<std::uint32_t> in_order;  ///< numbers of the records, by piece
    // Needed only during preparation; either `places` or `integers` is used.
    std::vector<NumberedPoint> places;
    std::vector<NumberedIntegers> integers;
    std::vector<std::uint32_t> piece_of;  ///< by record
  };

  void prepare_ahead() {
    while (prepared_.size() < std::max(options_.parts_ahead, 1U) && !pending_.empty()) {
      Pending& next = pending_.back();
      if (next.divisible && file_->records(next.bucket) > kMaxRegionPoints) {
        divide();
        continue;
      }
      Region region;
      if (!free_regions_.empty()) {
        region = std::move(free_regions_.back());
        free_regions_.pop_back();
      }
      file_->take(next.bucket, kMaxRegionPoints, region.records);
      if (file_->records(next.bucket) == 0) pending_.pop_back();
      // If the system grants no more threads, the region is cut when it is needed.
      const std::launch policy = options_.parts_ahead > 0
                                     ? std::launch::async | std::launch::deferred
                                     : std::launch::deferred;
      prepared_.push_back(std::async(
          policy, [this](Region cut) { return cut_region(std::move(cut)); }, std::move(region)));
    }
  }

  [[nodiscard]] Region cut_region(Region region) const {
    if (packed_->integers()) {
      cut_region(region, region.integers);
    } else {
      cut_region(region, region.places);
    }
    return region;
  }

  template <class Coordinate>
  void cut_region(Region& region, std::vector<Numbered<Coordinate>>& places) const {
    packed_->unpack(region.records, places);
    region.pieces =
        cut_in_pieces(std::span(places), blocks_of(places.size(), options_.block_points), lengths_);
    // A piece keeps the order of the source, in which neighbours are often alike.
    region.piece_of.resize(places.size());
    for (std::uint32_t piece = 0; piece + 1 < region.pieces.size(); ++piece) {
      for (std::size_t i = region.pieces[piece]; i < region.pieces[piece + 1]; ++i) {
        region.piece_of[places[i].number] = piece;
      }
    }
    std::vector<std::size_t> next(region.pieces);
    region.in_order.resize(places.size());
    for (std::uint32_t number = 0; number < places.size(); ++number) {
      region.in_order[next[region.piece_of[number]]++] = number;
    }
  }

  /// Replaces the next bucket by smaller ones.
  void divide() {
    Bucket bucket = std::move(pending_.back().bucket);
    pending_.pop_back();
    const std::uint64_t count = file_->records(bucket);
    report_.written_twice += count;
    std::vector<std::byte> records;
    std::vector<NumberedPoint> places;
    file_->sample(bucket, kWindowPoints, records);
    packed_->unpack(records, places);
    planes_ = kd_planes(places, kDepth, lengths_);
    places = {};
    std::vector<Bucket> buckets(planes_.size() + 1);
    std::deque<Share> shares(kSharesOfBucket);
    while (file_->records(bucket) > 0) {
      std::size_t filled = 0;
      for (; filled < shares.size() && file_->records(bucket) > 0; ++filled) {
        file_->take(bucket, kSharedPoints / kSharesOfBucket, shares[filled].records);
      }
      team_.run(filled, [&](std::size_t i, std::size_t) {
        Share& share = shares[i];
        packed_->unpack(share.records, share.places);
        find_leaves(share, share.places.size(),
                    [&](std::size_t p) -> const Point3& { return share.places[p].place; });
        packed_->sort(share.records, share.leaves, planes_.size() + 1, share.sorted, share.begins);
      });
      distribute(shares, filled, buckets);
    }
    push(std::move(buckets), count / 2);
    report_.temporary_bytes = file_->bytes();
  }

  struct Pending {
    Bucket bucket;
    bool divisible = true;
  };

  std::unique_ptr<PointSource> source_;
  SpatialOrderOptions options_;
  State state_;
  std::uint64_t ordering_bytes_;
  PointBlock lookahead_;               ///< read, but did not fit into the last full block
  bool ended_ = false;                 ///< whether the source has no more blocks
  std::deque<PointBlock> window_;      ///< held until it is judged
  std::vector<NumberedPoint> places_;  ///< represent a window
  std::uint64_t points_to_skip_ = 0;   ///< points to deliver before the next window to judge
  std::uint64_t window_points_ = 0;    ///< points of the window being judged
  std::array<double, 3> lengths_{1, 1, 1};

  std::optional<PackedPoints> packed_;
  std::vector<KdPlane> planes_;  ///< that divide the buckets
  std::optional<BucketFile> file_;
  std::vector<Pending> pending_;  ///< the next is at the end

  base::ThreadTeam team_;
  std::vector<RecordPacker> packers_;  ///< by thread of the team
  Region region_;                      ///< being delivered
  std::size_t next_piece_ = 0;
  std::vector<Region> free_regions_;

  std::uint64_t delivered_ = 0, total_ = 0;
  Report report_;
  std::deque<std::future<Region>> prepared_;  ///< destroyed first, because it uses the others
};

}  // namespace

std::unique_ptr<OrderedSource> in_spatial_order(std::unique_ptr<PointSource> source,
                                                SpatialOrderOptions options) {
  return std::make_unique<SpatialSource>(std::move(source), std::move(options));
}

}  // namespace terrace::stream
