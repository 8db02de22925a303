// SPDX-License-Identifier: Apache-2.0
#include "format/chain.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/core.h>

#include "crs_agreement.hpp"
#include "format/selection.hpp"
#include "io/peek.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

/// Lists the channels that are not among `others`, for messages.
std::string list_of(const std::vector<Channel>& channels, const std::vector<Channel>& others) {
  std::string out;
  for (const Channel& channel : channels) {
    if (std::find(others.begin(), others.end(), channel) != others.end()) continue;
    if (!out.empty()) out += ", ";
    out.append(name_of(channel.type)).append(" ").append(channel.name);
    if (!channel.unit.empty()) out.append(" (").append(channel.unit).append(")");
  }
  return out;
}

/// Describes how the attributes of `other` differ from those of `first`.
std::string difference(const SourceInfo& first, const SourceInfo& other) {
  const std::string& name = first.files.front();
  const std::string added = list_of(other.attributes, first.attributes);
  const std::string missing = list_of(first.attributes, other.attributes);
  if (missing.empty()) return fmt::format("it has attributes that {} lacks: {}", name, added);
  if (added.empty()) return fmt::format("it lacks attributes that {} has: {}", name, missing);
  return fmt::format("it has the attributes {} where {} has {}", added, name, missing);
}

void check_agreement(const SourceInfo& first, const SourceInfo& other, CrsAgreement& crs) {
  const auto refused = [&](std::string cause) {
    return Error(other.files.front(), std::move(cause))
        .remedy("convert one of them, or read them separately");
  };
  if (first.coordinates != other.coordinates) {
    throw refused(
        fmt::format("its coordinates are {}, but those of {} are {}, or their units differ",
                    name_of(other.coordinates[0].type), first.files.front(),
                    name_of(first.coordinates[0].type)));
  }
  if (first.attributes != other.attributes) {
    throw refused(difference(first, other))
        .remedy(message("{keep} only what all files have, or read the files separately"));
  }
  if (!crs.agrees(other.crs)) {
    throw refused("its coordinate reference system differs from that of " + first.files.front())
        .remedy(message(
            "if both mean the same system, name it ({crs} of build); otherwise convert one of the "
            "files, or read them separately"));
  }
}

/// Delivers the points of several files one after another. Opens each file again when its turn
/// comes.
class Chain final : public PointSource {
 public:
  Chain(std::span<const std::string> files, const SourceOptions& options, const OpenOne& open_one)
      : options_(options), open_one_(open_one), parts_(files.size()) {
    std::vector<std::string> unseen = options.selection.drop;
    for (std::size_t i = 0; i < files.size(); ++i) {
      Part& part = parts_[i];
      part.file = files[i];
      auto source = open_one_(part.file, options_);
      const std::vector<Channel>& attributes = source->info().attributes;
      std::erase_if(unseen, [&](const std::string& name) {
        return std::any_of(attributes.begin(), attributes.end(),
                           [&](const Channel& attribute) { return attribute.name == name; });
      });
      if (i > 0 && attributes != info_.attributes) drop_unneeded_attributes();
      if (drops_attributes_) source = with_needed_attributes(std::move(source));
      const SourceInfo& info = source->info();
      if (i == 0) {
        info_ = info;
        info_.octree.reset();
        crs_.emplace(info.crs, options.same_crs);
      } else {
        check_agreement(info_, info, *crs_);
        info_.files.push_back(part.file);
        info_.faces |= info.faces;
        const std::size_t room =
            kMaxComments - std::min<std::size_t>(kMaxComments, info_.comments.size());
        info_.comments.insert(info_.comments.end(), info.comments.begin(),
                              info.comments.begin() + static_cast<std::ptrdiff_t>(
                                                          std::min(room, info.comments.size())));
        if (info_.stated_bounds && info.stated_bounds) {
          info_.stated_bounds->include(*info.stated_bounds);
        } else {
          info_.stated_bounds.reset();
        }
        if (info_.points && info.points) {
          *info_.points += *info.points;
        } else {
          info_.points.reset();
        }
      }
      if (is_rereadable(part.file)) {
        std::error_code ignored;
        const auto bytes = std::filesystem::file_size(part.file, ignored);
        if (!ignored) part.bytes = bytes;
        total_bytes_ += part.bytes;
      } else {
        sizes_known_ = false;
        part.source = std::move(source);
      }
    }
    check_attributes(unseen, info_.attributes, info_.files.front());
  }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    for (; turn_ < parts_.size(); ++turn_) {
      Part& part = parts_[turn_];
      if (!part.source) {
        part.source = open_one_(part.file, options_);
        if (drops_attributes_) part.source = with_needed_attributes(std::move(part.source));
        check_agreement(info_, part.source->info(), *crs_);
      }
      if (part.source->next(block)) {
        delivered_ += block.size();
        return true;
      }
      const Progress progress = part.source->progress();
      nodata_ += progress.nodata;
      empty_values_ += progress.empty_values;
      withheld_ += progress.withheld;
      excluded_ += progress.excluded;
      lost_ += progress.lost;
      done_bytes_ += part.bytes;
      part.source.reset();
    }
    block.clear();
    return false;
  }

  Progress progress() const override {
    Progress progress{.points = delivered_,
                      .nodata = nodata_,
                      .empty_values = empty_values_,
                      .withheld = withheld_,
                      .excluded = excluded_,
                      .lost = lost_};
    if (turn_ == parts_.size()) {
      progress.fraction = 1.0;
      return progress;
    }
    const Part& part = parts_[turn_];
    if (part.source) {
      const Progress inside = part.source->progress();
      progress.nodata += inside.nodata;
      progress.empty_values += inside.empty_values;
      progress.withheld += inside.withheld;
      progress.excluded += inside.excluded;
      progress.lost += inside.lost;
    }
    if (sizes_known_ && total_bytes_ > 0) {
      const double inside = part.source ? part.source->progress().fraction : 0.0;
      progress.fraction =
          (static_cast<double>(done_bytes_) + inside * static_cast<double>(part.bytes)) /
          static_cast<double>(total_bytes_);
    }
    return progress;
  }

 private:
  struct Part {
    std::string file;
    std::unique_ptr<PointSource> source;  ///< while it is open
    std::uint64_t bytes = 0;
  };

  /// Returns the source with only the attributes that the selection needs, in the order of the
  /// first file.
  [[nodiscard]] std::unique_ptr<PointSource> with_needed_attributes(
      std::unique_ptr<PointSource> source) const {
    // Select before the flags of withheld points are dropped, so that those points are counted.
    SourceOptions selecting = options_;
    selecting.selection.keep.reset();
    selecting.selection.drop.clear();
    source = selection_of(std::move(source), selecting);
    const std::vector<std::string> needed = needed_attributes(source->info(), options_);
    std::vector<std::string> names;
    for (const Channel& attribute : info_.attributes) names.push_back(attribute.name);
    for (const std::string& name : needed) {
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    return with_attributes(std::move(source), names, options_.block_points);
  }
  /// Files need to agree only in the attributes that the selection needs.
  void drop_unneeded_attributes() {
    if (drops_attributes_) return;
    drops_attributes_ = true;
    const std::vector<std::string> needed = needed_attributes(info_, options_);
    std::erase_if(info_.attributes, [&](const Channel& attribute) {
      return std::find(needed.begin(), needed.end(), attribute.name) == needed.end();
    });
    for (Part& part : parts_) {
      if (part.source) part.source = with_needed_attributes(std::move(part.source));
    }
  }

  /// The limit for all files together: there may be thousands, each with many comments.
  static constexpr std::size_t kMaxComments = 1000;

  SourceOptions options_;
  OpenOne open_one_;
  SourceInfo info_;
  std::optional<CrsAgreement> crs_;
  bool drops_attributes_ = false;
  std::vector<Part> parts_;
  std::size_t turn_ = 0;
  std::uint64_t delivered_ = 0, nodata_ = 0, empty_values_ = 0, withheld_ = 0, excluded_ = 0,
                lost_ = 0, done_bytes_ = 0, total_bytes_ = 0;
  bool sizes_known_ = true;
};

}  // namespace

std::unique_ptr<PointSource> open_in_sequence(std::span<const std::string> files,
                                              const SourceOptions& options,
                                              const OpenOne& open_one) {
  if (files.size() == 1) return open_one(files.front(), options);
  return std::make_unique<Chain>(files, options, open_one);
}

}  // namespace terrace::stream
