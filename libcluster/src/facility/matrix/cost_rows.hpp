// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <terrace/base/stop_check.hpp>

#include "terrace/cluster/facility_location.hpp"

namespace terrace::cluster {

/// Connection costs as the searches use them: by facility, stored or computed on the fly, and
/// multiplied by a power of two so that sums neither overflow nor underflow.
class CostRows {
 public:
  virtual ~CostRows() = default;
  [[nodiscard]] std::size_t facilities() const { return facilities_; }
  [[nodiscard]] std::size_t clients() const { return clients_; }
  /// Throws whatever the stop check throws. For loops over facilities or clients.
  void check_stop() const {
    if (*check_stop_) (*check_stop_)();
  }
  /// Returns the costs of all clients from a facility; valid until `scratch` is used again. This
  /// and gather() throw whatever the stop check throws.
  virtual const double* row(std::size_t facility, std::vector<double>& scratch) const = 0;
  /// Writes the costs of some clients, with the same values as in the row.
  virtual void gather(std::size_t facility, std::span<const std::uint32_t> clients,
                      double* out) const = 0;

 protected:
  /// check_stop: must outlive this object.
  CostRows(std::size_t facilities, std::size_t clients, const base::StopCheck& check_stop)
      : facilities_(facilities), clients_(clients), check_stop_(&check_stop) {}
  CostRows(const CostRows&) = default;
  CostRows& operator=(const CostRows&) = default;

 private:
  std::size_t facilities_, clients_;
  const base::StopCheck* check_stop_;
};

/// A matrix whose costs are at most 2^900. It is copied only if its costs must be scaled for that,
/// or if they are all so small that they lack digits.
class MatrixRows final : public CostRows {
 public:
  /// Throws what the check throws.
  MatrixRows(const FacilityMatrix& matrix, const base::StopCheck& check_stop);

  const double* row(std::size_t facility, std::vector<double>& scratch) const override;
  void gather(std::size_t facility, std::span<const std::uint32_t> clients,
              double* out) const override;
  [[nodiscard]] double cost(std::size_t facility, std::size_t client) const {
    return connection_[facility * clients() + client];
  }
  [[nodiscard]] std::span<const double> opening() const { return opening_; }
  /// Returns a scaled cost in the unit of the matrix; infinite if it overflows a double.
  [[nodiscard]] double unscaled(double cost) const;
  /// Returns a cost of the matrix, scaled.
  [[nodiscard]] double scaled(double cost) const;

 private:
  std::span<const double> opening_, connection_;
  std::vector<double> owned_;
  int exponent_ = 0;
};

/// Assigns each client to the cheapest of these facilities, on ties to the first, and closes
/// facilities without clients. Costs are those of the matrix, infinite if they overflow a double.
/// Requires: `open` is ascending and not empty.
FacilitySolution solution_of(const FacilityMatrix& matrix, std::span<const std::uint32_t> open,
                             const base::StopCheck& check_stop = {});

}  // namespace terrace::cluster
