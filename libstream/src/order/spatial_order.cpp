// SPDX-License-Identifier: Apache-2.0
#include "terrace/stream/spatial_order.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "order/kd_cut.hpp"
#include "order/point_buckets.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Points that are looked at together.
constexpr std::size_t kWindowPoints = 1u << 18;
/// A window is judged by every fourth of its points, and in an ordered stream every fourth is.
constexpr std::size_t kJudgedPoints = 4;
constexpr std::size_t kJudgedWindows = 4;
/// Blocks so many times wider than those of a k-d tree are not compact.
constexpr double kWidest = 2.0;
/// Buckets are the leaves of a k-d tree of this depth.
constexpr unsigned kDepth = 8;
/// More points than these are not put in order at once.
constexpr std::uint64_t kMostAtOnce = 1u << 18;

std::size_t blocks_of(std::size_t points, std::size_t block_points) {
  return (points + block_points - 1) / block_points;
}

/// The widths of the blocks that `begins` tells, over all axes, as `lengths` counts them.
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

/// What points take that are held back to be judged or come next, and the ends of all buckets.
std::uint64_t bytes_to_order(const SourceInfo& info) {
  static_assert(kWindowPoints <= kMostAtOnce);
  const std::uint64_t point = sizeof(Point3) + info.payload_size() + sizeof(NumberedPoint);
  return kMostAtOnce * point + (std::uint64_t{kBucketBytes} << kDepth);
}

class SpatialSource final : public OrderedSource {
 public:
  SpatialSource(std::unique_ptr<PointSource> source, SpatialOrderOptions options)
      : source_(std::move(source)),
        options_(std::move(options)),
        state_(options_.order == Order::stream || source_->info().grid ? State::passing
                                                                       : State::opening),
        ordering_bytes_(state_ == State::passing ? 0 : bytes_to_order(source_->info())) {}

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
    block.clear();
    if (state_ == State::opening) open();
    if (state_ == State::gathering) gather();
    if (state_ == State::delivering) {
      deliver(block);
    } else if (!window_.empty()) {
      block = std::move(window_.front());
      window_.pop_front();
    } else if (source_->next(block) && state_ == State::judging) {
      judge(block);
    }
    delivered_ += block.size();
    return !block.empty();
  }

 private:
  enum class State : std::uint8_t { opening, passing, judging, gathering, delivering };

  /// Reads the first window, which is held back until it has been judged.
  void open() {
    state_ = State::judging;
    bool more = true;
    while (seen_ < kWindowPoints && more) {
      PointBlock block;
      more = source_->next(block);
      look_at(block);
      if (!block.empty()) window_.push_back(std::move(block));
    }
    if (seen_ > 0 && (options_.order == Order::spatial || spread() > kWidest)) {
      report_.reordered = true;
      state_ = State::gathering;
      if (!more) load_window();
    } else {
      leave_window();
    }
  }

  /// Looks at blocks on their way: what follows a window that is not compact is put in order.
  void judge(const PointBlock& block) {
    if (unjudged_ > 0) {
      unjudged_ -= std::min<std::uint64_t>(unjudged_, block.size());
      return;
    }
    look_at(block);
    if (seen_ < kWindowPoints) return;
    if (spread() > kWidest) {
      report_.reordered = true;
      state_ = State::gathering;
    } else {
      leave_window();
    }
  }

  /// Adds points of a block to those by which its window is judged.
  void look_at(const PointBlock& block) {
    places_.reserve(kWindowPoints / kJudgedPoints + block.size());
    for (const Point3& p : block.positions) {
      if (seen_++ % kJudgedPoints == 0) places_.push_back({p, places_.size()});
    }
  }

  void leave_window() {
    places_.clear();
    seen_ = 0;
    unjudged_ = (kJudgedWindows - 1) * kWindowPoints;
  }

  /// The spread of the window of which `places_` are a part, which is reordered.
  double spread() {
    const std::size_t blocks =
        blocks_of(places_.size(), std::max<std::size_t>(options_.block_points / kJudgedPoints, 1));
    std::vector<std::size_t> begins;
    for (std::size_t b = 0; b <= blocks; ++b) begins.push_back(b * places_.size() / blocks);
    measure_units();
    const double as_read = widths_of(places_, begins, lengths_);
    const double compact = widths_of(places_, cut_in_pieces(places_, blocks, lengths_), lengths_);
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
    std::vector<std::byte> records;
    for (const PointBlock& block : window_) {
      packed_->pack(block, records);
      records_.insert(records_.end(), records.begin(), records.end());
    }
    window_.clear();
    cut_records();
    total_ = delivered_ + places_.size();
    state_ = State::delivering;
  }

  /// Puts what is held back and all that follows into buckets.
  void gather() {
    if (!window_.empty()) places_.clear();
    for (const PointBlock& block : window_) {
      for (const Point3& p : block.positions) places_.push_back({p, places_.size()});
    }
    measure_units();
    planes_ = kd_planes(places_, kDepth, lengths_);
    packed_.emplace(info());
    file_.emplace(info().files.empty() ? std::string("points") : info().files.front(),
                  options_.folder, packed_->record_bytes());
    std::vector<Bucket> buckets(planes_.size() + 1);
    std::vector<std::byte> records;
    const auto put = [&](const PointBlock& block) {
      packed_->pack(block, records);
      distribute(records, block.positions, buckets);
      total_ += block.size();
    };
    total_ = delivered_;
    for (; !window_.empty(); window_.pop_front()) put(window_.front());
    PointBlock block;
    while (source_->next(block)) {
      if (options_.stop.stop_requested()) throw Stopped();
      put(block);
      if (options_.reading) options_.reading(source_->progress());
    }
    push(std::move(buckets), total_);
    report_.temporary_bytes = file_->bytes();
    state_ = State::delivering;
  }

  void distribute(std::span<const std::byte> records, std::span<const Point3> places,
                  std::vector<Bucket>& buckets) {
    const std::size_t bytes = packed_->record_bytes();
    for (std::size_t i = 0; i < places.size(); ++i) {
      file_->append(buckets[kd_leaf(planes_, places[i])], records.subspan(i * bytes, bytes));
    }
  }

  /// Makes the buckets the next ones, such as are small together as one. Planes do not divide those
  /// of more than `divisible` records: they hold one place, more or less.
  void push(std::vector<Bucket> buckets, std::uint64_t divisible) {
    std::vector<Bucket> joined;
    join(buckets, joined);
    // The first is to be the last in the list.
    for (; !joined.empty(); joined.pop_back()) {
      const bool small = file_->records(joined.back()) <= divisible;
      pending_.push_back({std::move(joined.back()), small});
    }
  }

  /// The buckets of a subtree of the k-d tree that fit together are one region.
  void join(std::span<Bucket> buckets, std::vector<Bucket>& joined) {
    std::uint64_t records = 0;
    for (const Bucket& bucket : buckets) records += file_->records(bucket);
    if (records == 0) return;
    if (buckets.size() > 1 && records > kMostAtOnce) {
      join(buckets.first(buckets.size() / 2), joined);
      join(buckets.subspan(buckets.size() / 2), joined);
      return;
    }
    Bucket all;
    for (Bucket& bucket : buckets) all.append(std::move(bucket));
    joined.push_back(std::move(all));
  }

  void deliver(PointBlock& block) {
    while (next_piece_ + 1 >= pieces_.size()) {
      if (pending_.empty()) return;
      Pending& next = pending_.back();
      if (next.divisible && file_->records(next.bucket) > kMostAtOnce) {
        divide();
        continue;
      }
      file_->take(next.bucket, kMostAtOnce, records_);
      if (file_->records(next.bucket) == 0) pending_.pop_back();
      cut_records();
    }
    const std::size_t begin = pieces_[next_piece_], end = pieces_[next_piece_ + 1];
    ++next_piece_;
    packed_->unpack(records_, std::span(in_order_).subspan(begin, end - begin), block);
  }

  void cut_records() {
    packed_->unpack(records_, places_);
    pieces_ = cut_in_pieces(places_, blocks_of(places_.size(), options_.block_points), lengths_);
    next_piece_ = 0;
    // Within a piece in the order of the source: neighbours in it are often alike.
    piece_of_.resize(places_.size());
    for (std::uint32_t piece = 0; piece + 1 < pieces_.size(); ++piece) {
      for (std::size_t i = pieces_[piece]; i < pieces_[piece + 1]; ++i) {
        piece_of_[places_[i].number] = piece;
      }
    }
    std::vector<std::size_t> next(pieces_);
    in_order_.resize(places_.size());
    for (std::uint32_t number = 0; number < places_.size(); ++number) {
      in_order_[next[piece_of_[number]]++] = number;
    }
  }

  /// Puts smaller buckets in place of the next one.
  void divide() {
    Bucket bucket = std::move(pending_.back().bucket);
    pending_.pop_back();
    const std::uint64_t count = file_->records(bucket);
    std::vector<std::byte> records;
    std::vector<NumberedPoint> places;
    file_->sample(bucket, kWindowPoints, records);
    packed_->unpack(records, places);
    planes_ = kd_planes(places, kDepth, lengths_);
    std::vector<Bucket> buckets(planes_.size() + 1);
    std::vector<Point3> positions;
    while (file_->records(bucket) > 0) {
      file_->take(bucket, kMostAtOnce / 8, records);
      packed_->unpack(records, places);
      positions.clear();
      for (const NumberedPoint& point : places) positions.push_back(point.place);
      distribute(records, positions, buckets);
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
  std::deque<PointBlock> window_;  ///< what was held back to be judged
  std::uint64_t unjudged_ = 0;     ///< points that pass before the next window
  std::uint64_t seen_ = 0;         ///< points of the window that is judged
  std::array<double, 3> lengths_{1, 1, 1};

  std::optional<PackedPoints> packed_;
  std::vector<KdPlane> planes_;  ///< between the buckets
  std::optional<BucketFile> file_;
  std::vector<Pending> pending_;  ///< the next one is the last

  std::vector<std::byte> records_;       ///< that come next
  std::vector<NumberedPoint> places_;    ///< of the records, in pieces; before, of a window
  std::vector<std::size_t> pieces_;      ///< where each begins
  std::vector<std::uint32_t> piece_of_;  ///< by number of the record
  std::vector<std::uint32_t> in_order_;  ///< records of the pieces
  std::size_t next_piece_ = 0;

  std::uint64_t delivered_ = 0, total_ = 0;
  Report report_;
};

}  // namespace

std::unique_ptr<OrderedSource> in_spatial_order(std::unique_ptr<PointSource> source,
                                                SpatialOrderOptions options) {
  return std::make_unique<SpatialSource>(std::move(source), std::move(options));
}

}  // namespace terrace::stream
