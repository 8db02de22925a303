// SPDX-License-Identifier: Apache-2.0
#include "format/chain.hpp"

#include <cstdint>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "io/peek.hpp"
#include "terrace/stream/error.hpp"

namespace terrace::stream {
namespace {

std::string list_of(const std::vector<Channel>& channels) {
  std::string out;
  for (const Channel& channel : channels) {
    if (!out.empty()) out += ", ";
    out.append(name_of(channel.type)).append(" ").append(channel.name);
    if (!channel.unit.empty()) out.append(" (").append(channel.unit).append(")");
  }
  return out.empty() ? "none" : out;
}

void check_agreement(const SourceInfo& first, const SourceInfo& other) {
  const auto refuse = [&](std::string cause) {
    throw Error({.file = other.files.front(),
                 .where = {},
                 .cause = std::move(cause),
                 .remedy = "convert one of them, or read them on their own"});
  };
  if (first.coordinates != other.coordinates) {
    refuse("its coordinates are " + std::string(name_of(other.coordinates[0].type)) +
           ", those of " + first.files.front() + " are " +
           std::string(name_of(first.coordinates[0].type)) + ", or their units differ");
  }
  if (first.attributes != other.attributes) {
    refuse("its attributes are " + list_of(other.attributes) + ", those of " + first.files.front() +
           " are " + list_of(first.attributes));
  }
  if (first.crs != other.crs) {
    refuse("its coordinate reference system is not that of " + first.files.front());
  }
}

class Chain final : public PointSource {
 public:
  Chain(std::span<const std::string> files, const SourceOptions& options, OpenOne open_one)
      : options_(options), open_one_(open_one), parts_(files.size()) {
    for (std::size_t i = 0; i < files.size(); ++i) {
      Part& part = parts_[i];
      part.file = files[i];
      auto source = open_one_(part.file, options_, i == 0 ? nullptr : &info_);
      const SourceInfo& info = source->info();
      if (i == 0) {
        info_ = info;
        info_.octree.reset();
      } else {
        check_agreement(info_, info);
        info_.files.push_back(part.file);
        info_.comments.insert(info_.comments.end(), info.comments.begin(), info.comments.end());
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
  }

  const SourceInfo& info() const override { return info_; }

  bool next(PointBlock& block) override {
    for (; turn_ < parts_.size(); ++turn_) {
      Part& part = parts_[turn_];
      if (!part.source) {
        part.source = open_one_(part.file, options_, turn_ == 0 ? nullptr : &info_);
        check_agreement(info_, part.source->info());
      }
      if (part.source->next(block)) {
        delivered_ += block.size();
        return true;
      }
      const Progress progress = part.source->progress();
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
    Progress progress{
        .points = delivered_, .withheld = withheld_, .excluded = excluded_, .lost = lost_};
    if (turn_ == parts_.size()) {
      progress.fraction = 1.0;
      return progress;
    }
    const Part& part = parts_[turn_];
    if (part.source) {
      const Progress inside = part.source->progress();
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

  SourceOptions options_;
  OpenOne open_one_;
  SourceInfo info_;
  std::vector<Part> parts_;
  std::size_t turn_ = 0;
  std::uint64_t delivered_ = 0, withheld_ = 0, excluded_ = 0, lost_ = 0, done_bytes_ = 0,
                total_bytes_ = 0;
  bool sizes_known_ = true;
};

}  // namespace

std::unique_ptr<PointSource> open_in_turn(std::span<const std::string> files,
                                          const SourceOptions& options, OpenOne open_one) {
  if (files.size() == 1) return open_one(files.front(), options, nullptr);
  return std::make_unique<Chain>(files, options, open_one);
}

}  // namespace terrace::stream
