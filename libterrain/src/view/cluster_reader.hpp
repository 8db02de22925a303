// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include <terrace/stream/given_bytes.hpp>
#include <terrace/tri/view.hpp>

#include "terrace/terrain/store_source.hpp"
#include "terrace/terrain/store_view.hpp"
#include "view/view_frame.hpp"

/// Who reads the clusters of a view: the thread that draws, or one of its own.

namespace terrace::terrain {

/// The clusters of a store, members in stored coordinates or on a lattice, boxes in the view frame.
class FramedSource final : public tri::ClusterSource {
 public:
  /// Without a lattice (null) members are in stored coordinates. `bounds`: records whose bytes are
  /// missing may be bounds (tri::ClusterRecord::kUnread). Keeps references.
  FramedSource(const stream::Store& store, const ViewFrame& frame, const ViewLattice* lattice,
               bool bounds)
      : store_(store), inner_(store), frame_(frame), lattice_(lattice), bounds_(bounds) {}

  [[nodiscard]] unsigned top() const override { return inner_.top(); }
  [[nodiscard]] std::uint64_t cluster_count(unsigned level) const override {
    return inner_.cluster_count(level);
  }
  tri::ClusterRecord record(tri::ClusterId id) override;
  tri::ClusterMembers read(tri::ClusterId id) override;

  /// tri::load() and tri::load_root(). Throws: stream::MissingBytes that names all bytes that are
  /// missing and can be told, not only the first.
  tri::GivenCluster load(const tri::ViewRequest& request);
  tri::GivenCluster load_root();
  /// A record itself. Throws: stream::MissingBytes.
  tri::ClusterRecord exact_record(tri::ClusterId id);
  /// Clusters with the same number have their records in the same bytes.
  [[nodiscard]] static tri::ClusterId page_of(tri::ClusterId id) {
    constexpr std::uint64_t kClusters = 64;  // older stores have larger pages
    const std::uint64_t ordinal = tri::ordinal_of(id);
    return tri::cluster_id(tri::level_of(id), ordinal - ordinal % kClusters);
  }

  /// What was read so far; may be asked while another thread reads.
  [[nodiscard]] ViewTraffic traffic() const { return {clusters_, points_, bytes_}; }
  [[nodiscard]] std::vector<std::uint64_t> counts() const;

 private:
  tri::GivenCluster whole(const std::function<tri::GivenCluster()>& load);

  const stream::Store& store_;
  StoreSource inner_;
  const ViewFrame& frame_;
  const ViewLattice* lattice_;
  bool bounds_;
  std::vector<stream::Point3> nodes_;  ///< what the last read() shows, with a lattice
  /// The index pages and bytes that the cluster being loaded still lacks.
  std::vector<tri::ClusterId> missing_pages_;
  std::vector<stream::ByteRange> missing_;
  std::atomic<std::uint64_t> clusters_ = 0, points_ = 0, bytes_ = 0;
};

/// Share of a frame's time that the calling thread spends bringing clusters.
inline constexpr double kReadingShare = 0.4;

double steady_seconds();

class ClusterReader {
 public:
  using Give = std::function<void(tri::GivenCluster)>;
  using GiveRecord = std::function<void(tri::ClusterId, const tri::ClusterRecord&)>;

  virtual ~ClusterReader() = default;
  /// Before a step: gives what was asked for and is there, for about `seconds`. Throws what reading
  /// threw.
  virtual void bring(double seconds, const Give& give, const GiveRecord& give_record) = 0;
  /// After it: what the step lacks, as in tri::ViewControl::Step.
  virtual void ask(const std::vector<tri::ViewRequest>& wanted,
                   const std::vector<tri::ViewRequest>& requests,
                   const std::vector<tri::ClusterId>& withdrawn) = 0;
  /// Bytes without which nothing more can be brought, the most important first.
  [[nodiscard]] virtual std::span<const stream::ByteRange> missing() const { return {}; }
};

/// The calling thread, within the frame's time. Bytes that are missing are no fault of it; they are
/// looked for again once they are `given`, or, if that is empty, in each frame.
std::unique_ptr<ClusterReader> make_frame_reader(
    FramedSource& source, std::function<bool(const stream::ByteRange&)> given = {});
/// A thread of its own.
std::unique_ptr<ClusterReader> make_reading_thread(FramedSource& source);

}  // namespace terrace::terrain
