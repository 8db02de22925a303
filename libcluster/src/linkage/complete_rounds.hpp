// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "linkage/kernels.hpp"
#include "terrace/cluster/band_matrix.hpp"
#include "terrace/cluster/dendrogram.hpp"
#include "terrace/cluster/linkage.hpp"

/// Private to complete linkage.

namespace terrace::cluster {

/// Complete linkage over a band matrix, which it consumes.
///
/// Clusters are numbered 0 ... m-1 along the matrix. The row of cluster c holds its distances to
/// the next `length` clusters, modulo m. When clusters merge, rows shrink in place. The entry of a
/// pair never moves to another row, so the lengths of rows begin to differ. A new cluster replaces
/// the first of its two parts.
template <class T>
class CompleteRounds {
 public:
  /// Fills in or checks the entries of row i of the matrix. Several threads call it for different
  /// rows, in any order.
  using FillRow = std::function<void(std::size_t i, T* row)>;

  /// options: must outlive this object.
  CompleteRounds(BandMatrix<T>& matrix, const LinkageKernels<T>& kernels,
                 const LinkageOptions& options);
  /// Returns all merges, numbered by the first rows of the clusters. If a pair has two copies (even
  /// n), only the copy in the upper half of the matrix counts.
  std::vector<Link> run(const FillRow& fill);

 private:
  using Index = LaneIndex<T>;
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Cluster {
    T* row;
    std::uint32_t length;
    std::uint32_t name;  ///< number of one of its points
  };
  struct Nearest {
    T distance;
    std::uint32_t cluster;
  };
  /// Entries of consecutive columns.
  struct Piece {
    std::uint32_t begin, end;
    const T* values;
  };
  struct Pieces {
    Piece after, wrapped;
  };
  /// A thread's results per column, and its scratch memory.
  struct Columns {
    std::vector<T> best;
    std::vector<Index> row;
    std::vector<T> buffer;
    std::vector<std::uint32_t> others;
  };

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(clusters_.size()); }
  /// Returns the position of b in the row of a: the number of steps from a to b modulo their
  /// number, minus one.
  [[nodiscard]] std::uint32_t offset(std::uint32_t a, std::uint32_t b) const {
    return b > a ? b - a - 1 : b + size() - a - 1;
  }
  [[nodiscard]] bool holds(std::uint32_t a, std::uint32_t b) const {
    return offset(a, b) < clusters_[a].length;
  }
  [[nodiscard]] T& entry(std::uint32_t a, std::uint32_t b) {
    return holds(a, b) ? clusters_[a].row[offset(a, b)] : clusters_[b].row[offset(b, a)];
  }
  [[nodiscard]] Pieces pieces(std::uint32_t c) const;
  [[nodiscard]] unsigned threads() const;
  /// Throws whatever the stop check throws.
  void check_stop() const {
    if (check_stop_) check_stop_();
  }

  // Finds nearest clusters, row by row.
  void begin_minima(std::size_t count);
  void note_minima(std::uint32_t c, const Cluster& cluster, std::uint32_t count, Columns& columns);
  void end_minima();
  [[nodiscard]] const Nearest& nearest(std::uint32_t c) const;

  // One round.
  std::size_t match();
  bool pair_up(std::uint32_t c, const Nearest& candidate);
  void list_parts();
  void fetch_entries(std::uint32_t k, Columns& columns);
  void list_others(std::uint32_t k, std::vector<std::uint32_t>& others) const;
  [[nodiscard]] Cluster merged_row(std::uint32_t k, Columns& columns);
  void shrink();

  // The chain.
  void chain();
  [[nodiscard]] Nearest nearest_of(std::uint32_t c, Nearest best);
  void merge_into(std::uint32_t a, std::uint32_t b);

  const LinkageKernels<T>& kernels_;
  const unsigned threads_;
  const base::StopCheck& check_stop_;
  std::vector<Cluster> clusters_;
  std::vector<Columns> columns_;  ///< by thread
  std::vector<Nearest> row_nearest_,
      column_nearest_;                  ///< by cluster: nearest in its row and in its column
  std::vector<std::uint32_t> partner_;  ///< the cluster with which a cluster merges, or kNone
  /// The parts of each new cluster, twice the same if there is only one. For each old cluster, the
  /// new one and the number of first parts before it.
  std::vector<std::uint32_t> first_, second_, new_cluster_, first_parts_before_;
  std::vector<std::uint32_t> pair_first_, pair_second_;  ///< parts of new clusters that have two
  std::vector<Link> links_;
};

extern template class CompleteRounds<float>;
extern template class CompleteRounds<double>;

}  // namespace terrace::cluster
