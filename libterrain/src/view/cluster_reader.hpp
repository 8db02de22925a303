// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <terrace/stream/given_bytes.hpp>
#include <terrace/tri/view.hpp>

#include "terrace/terrain/store_source.hpp"
#include "terrace/terrain/store_view.hpp"
#include "view/frame.hpp"

/// Readers of a view's clusters: in the drawing thread, or in a separate one.

namespace terrace::terrain {

/// The clusters of a store, with members in stored coordinates or on a lattice, and boxes in the
/// view frame.
class FramedSource final : public tri::ClusterSource {
 public:
  /// If the lattice is null, members are in stored coordinates. `bounds`: records with missing
  /// bytes may be replaced by bounds (tri::ClusterRecord::kUnread). `vertical`: errors are ranges
  /// of heights. Keeps references to its arguments.
  FramedSource(const stream::Store& store, const ViewFrame& frame, const ViewLattice* lattice,
               bool bounds, bool vertical)
      : store_(store),
        inner_(store),
        frame_(frame),
        lattice_(lattice),
        bounds_(bounds),
        vertical_(vertical) {}

  [[nodiscard]] unsigned top() const override { return inner_.top(); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return inner_.cluster_count(level);
  }
  tri::ClusterRecord record(tri::ClusterId id) override;
  tri::ClusterMembers read(tri::ClusterId id) override;

  /// As tri::load() and tri::load_root(). Throws: stream::MissingBytes that lists all missing bytes
  /// that can be determined, not only the first.
  tri::LoadedCluster load(const tri::ViewRequest& request);
  tri::LoadedCluster load_root();
  /// Reads the record itself. Throws: stream::MissingBytes.
  tri::ClusterRecord exact_record(tri::ClusterId id);
  /// Returns the bytes of the members of a cluster of level 0. Empty for other levels, for a level
  /// 0 in several files, and until load() has lacked such bytes for the first time, which names
  /// their file. Throws: stream::MissingBytes.
  [[nodiscard]] std::optional<stream::ByteRange> bytes_of(tri::ClusterId id) const;
  /// Returns a number that clusters share if their records are in the same bytes.
  [[nodiscard]] static tri::ClusterId page_of(tri::ClusterId id) {
    constexpr std::uint64_t kClusters = 64;  // older stores have larger pages
    const std::uint64_t ordinal = tri::ordinal_of(id);
    return tri::cluster_id(tri::level_of(id), ordinal - ordinal % kClusters);
  }

  /// The traffic until now; may be called while another thread reads.
  [[nodiscard]] ViewTraffic traffic() const { return {clusters_, points_, bytes_}; }
  [[nodiscard]] std::vector<std::uint64_t> counts() const;

 private:
  tri::LoadedCluster retry(const std::function<tri::LoadedCluster()>& load);

  const stream::Store& store_;
  StoreSource inner_;
  const ViewFrame& frame_;
  const ViewLattice* lattice_;
  bool bounds_;
  bool vertical_;
  std::vector<stream::Point3> nodes_;  ///< result of the last read(), with a lattice
  /// The index pages and bytes that the cluster being loaded still lacks.
  std::vector<tri::ClusterId> missing_pages_;
  std::vector<stream::ByteRange> missing_;
  std::string members_file_;  ///< of level 0, see bytes_of()
  std::atomic<std::uint64_t> clusters_ = 0, points_ = 0, bytes_ = 0;
};

/// Share of a frame's time that the calling thread spends on bring().
inline constexpr double kReadingShare = 0.4;

double steady_seconds();

class ClusterReader {
 public:
  using Give = std::function<void(tri::LoadedCluster)>;
  using GiveRecord = std::function<void(tri::ClusterId, const tri::ClusterRecord&)>;

  virtual ~ClusterReader() = default;
  /// Passes on requested clusters that are available, for about `seconds`. Call it before a step.
  /// Rethrows exceptions of the reading thread.
  virtual void bring(double seconds, const Give& give, const GiveRecord& give_record) = 0;
  /// Requests the clusters that a step lacks, see tri::ViewControl::Step. Call it after the step.
  virtual void ask(const std::vector<tri::ViewRequest>& wanted,
                   const std::vector<tri::ViewRequest>& requests,
                   const std::vector<tri::ClusterId>& withdrawn) = 0;
  /// The bytes that are needed to continue, the most important first.
  [[nodiscard]] virtual std::span<const stream::ByteRange> missing() const { return {}; }
};

/// Makes a reader in the calling thread, within the frame's time. Missing bytes are not an error:
/// it tries again once `has_arrived` says so or, if that is empty, in every frame.
std::unique_ptr<ClusterReader> make_frame_reader(
    FramedSource& source, std::function<bool(const stream::ByteRange&)> has_arrived = {});
/// Makes a reader with its own thread.
std::unique_ptr<ClusterReader> make_reading_thread(FramedSource& source);

}  // namespace terrace::terrain
