// SPDX-License-Identifier: Apache-2.0
#include "sample/sample_run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <fmt/core.h>
#include <terrace/stream/error.hpp>

#include "base/available_memory.hpp"
#include "base/fixed_text.hpp"
#include "base/parallel.hpp"
#include "base/progress_report.hpp"
#include "base/units.hpp"
#include "sample/samplers.hpp"
#include "surface/ground_slope.hpp"
#include "terrace/terrain/latitudes.hpp"

namespace terrace::terrain {
namespace {

/// Lines that a thread handles at a time.
constexpr std::size_t kLines = 8192;
/// Peak memory in bytes per line, excluding its text: places, sorting, surface, answer.
constexpr std::uint64_t kBytesPerLine = 266;
constexpr std::size_t kMaxLines = std::size_t{1} << 21, kMaxBytes = std::size_t{128} << 20;

/// The numbers to append to a line.
class AnswerText {
 public:
  AnswerText(const stream::Store& store, char separator)
      : separator_(separator), height_(FixedText::for_numbers_up_to(largest(store))) {}

  void append(std::string& text, double height, const tri::Gradient& gradient) const {
    text += separator_;
    height_.append(text, height);
    text += separator_;
    const double steepness = std::sqrt(gradient.x * gradient.x + gradient.y * gradient.y);
    gradient_.append(text, steepness);
    text += separator_;
    slope_.append(text, tri::slope_degrees(gradient));
    text += separator_;
    aspect_.append(text, tri::aspect_degrees(gradient));
  }

 private:
  static double largest(const stream::Store& store) {
    const stream::Channel& channel = store.schema().coordinates[2];
    const auto height = [&](double raw) { return std::abs(raw * channel.scale + channel.offset); };
    return std::max(height(store.bounds().min[2]), height(store.bounds().max[2]));
  }

  char separator_;
  FixedText height_, gradient_{8}, slope_{6}, aspect_{4};
};

class Answers {
 public:
  Answers(const stream::Store& store, const SamplerOptions& options, const PlaceFile& file,
          const Context& context)
      : store_(store),
        threads_(context.threads),
        stop_(context.stop),
        file_(file),
        sampler_(make_sampler(store, options, context)),
        ground_(store) {
    say_unknown_height_unit(ground_.ground(), context);
  }

  SampleCounts answer(const PlaceBatch& batch, const PlaceConversions& conversions,
                      const std::function<void(std::string_view)>& write) {
    find_layout(batch);
    const std::size_t lines = batch.size(), pieces = (lines + kLines - 1) / kLines;
    const auto end_of = [&](std::size_t piece) { return std::min((piece + 1) * kLines, lines); };
    places_.assign(lines, Point2{NAN, NAN});
    surface_.assign(lines, SurfacePoint{});
    if (conversions.to_written) written_.resize(lines);
    if (layout_) {
      parallel_for(
          pieces, threads_,
          [&](std::size_t piece) {
            for (std::size_t i = piece * kLines; i < end_of(piece); ++i) {
              if (!is_place(batch, i)) continue;
              places_[i] = place_of(batch.line(i), *layout_, file_.name(), batch.first_line + i);
              if (!(std::abs(places_[i][1]) > conversions.most_latitude)) continue;
              check_latitudes({&places_[i], 1}, conversions.most_latitude, file_.name(),
                              fmt::format("line {}", batch.first_line + i));
            }
            const std::span<Point2> stored_part(places_.data() + piece * kLines,
                                                end_of(piece) - piece * kLines);
            if (conversions.to_written) {
              const std::span<Point2> written_part(written_.data() + piece * kLines,
                                                   stored_part.size());
              std::copy(stored_part.begin(), stored_part.end(), written_part.begin());
              conversions.to_written(written_part);
            }
            if (conversions.to_store) conversions.to_store(stored_part);
            for (Point2& p : stored_part) p = ground_.stored(p);
          },
          stop_);
      sampler_->sample(places_, surface_);
    }
    texts_.resize(pieces);
    counts_.assign(pieces, {});
    const AnswerText numbers(store_, layout_ ? layout_->separator : ',');
    parallel_for(
        pieces, threads_,
        [&](std::size_t piece) {
          std::string& text = texts_[piece];
          text.clear();
          for (std::size_t i = piece * kLines; i < end_of(piece); ++i) {
            append_line(text, batch, i, conversions);
            if (is_header(batch, i)) {
              for (const char* name : {"height", "gradient", "slope", "aspect"}) {
                (text += layout_->separator) += unused_name(name);
              }
            } else if (is_place(batch, i)) {
              ++counts_[piece].points;
              if (!std::isnan(surface_[i].height)) ++counts_[piece].answered;
              numbers.append(text, surface_[i].height, ground_.on_ground(places_[i], surface_[i]));
            }
            text += '\n';
          }
        },
        stop_);
    SampleCounts sum;
    for (std::size_t piece = 0; piece < pieces; ++piece) {
      write(texts_[piece]);
      sum.points += counts_[piece].points;
      sum.answered += counts_[piece].answered;
    }
    return sum;
  }

 private:
  /// Returns the name of an answer column, with a number if the places have a column of that name.
  [[nodiscard]] std::string unused_name(const std::string& name) const {
    const std::vector<std::string>& names = layout_->names;
    std::string unused = name;
    for (int i = 2; std::find(names.begin(), names.end(), unused) != names.end(); ++i) {
      unused = fmt::format("{}_{}", name, i);
    }
    return unused;
  }

  /// Appends the line unchanged, except for the place.
  void append_line(std::string& text, const PlaceBatch& batch, std::size_t i,
                   const PlaceConversions& conversions) const {
    const std::string_view line = batch.line(i);
    if (!conversions.to_written || !layout_ || is_skipped_line(line)) {
      text += line;
    } else if (is_header(batch, i)) {
      const bool degrees = conversions.writes_degrees;
      append_with_place(text, line, *layout_, degrees ? "longitude" : "x",
                        degrees ? "latitude" : "y");
    } else {
      // Precision of a hundredth, or a tenth, of a millimetre.
      const FixedText number(conversions.writes_degrees ? 10 : 4);
      std::string x, y;
      number.append(x, written_[i][0]);
      number.append(y, written_[i][1]);
      append_with_place(text, line, *layout_, x, y);
    }
  }
  /// The first line that is not a comment determines how to read all lines.
  void find_layout(const PlaceBatch& batch) {
    std::string_view comment;
    for (std::size_t i = 0; !layout_ && i < batch.size(); ++i) {
      if (is_skipped_line(batch.line(i))) {
        comment = batch.line(i);
        continue;
      }
      layout_ = PlaceLayout::of(batch.line(i), file_.name(), comment);
      if (layout_->header) header_line_ = batch.first_line + i;
    }
  }
  [[nodiscard]] bool is_header(const PlaceBatch& batch, std::size_t i) const {
    return batch.first_line + i == header_line_;
  }
  [[nodiscard]] bool is_place(const PlaceBatch& batch, std::size_t i) const {
    return !is_header(batch, i) && !is_skipped_line(batch.line(i));
  }

  const stream::Store& store_;
  unsigned threads_;
  std::stop_token stop_;
  const PlaceFile& file_;
  std::unique_ptr<HeightSampler> sampler_;
  GroundSlope ground_;
  std::optional<PlaceLayout> layout_;
  std::uint64_t header_line_ = 0;  ///< 0: no header
  std::vector<Point2> places_, written_;
  std::vector<SurfacePoint> surface_;
  std::vector<std::string> texts_;
  std::vector<SampleCounts> counts_;
};

}  // namespace

SampleCounts answer_places(const stream::Store& store, const SamplerOptions& options,
                           PlaceFile& places, const PlaceConversions& conversions,
                           const std::function<void(std::string_view)>& write,
                           const Context& context) {
  Answers answers(store, options, places, context);
  const std::uint64_t memory = working_memory(context);
  const std::uint64_t per_line = kBytesPerLine + added_bytes_per_place(options);
  const auto lines =
      static_cast<std::size_t>(std::clamp<std::uint64_t>(memory / 4 / per_line, 1000, kMaxLines));
  const auto bytes = static_cast<std::size_t>(
      std::clamp<std::uint64_t>(memory / 16, std::uint64_t{1} << 20, kMaxBytes));
  const ProgressReport report(context, "points");
  PlaceBatch batch;
  SampleCounts sum;
  while (places.next(batch, bytes, lines)) {
    const SampleCounts counts = answers.answer(batch, conversions, write);
    sum.points += counts.points;
    sum.answered += counts.answered;
    report.update(sum.points, 0);
  }
  return sum;
}

}  // namespace terrace::terrain
