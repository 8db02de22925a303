// SPDX-License-Identifier: Apache-2.0
#include "earth/crs/proj_pipeline.hpp"

#include <cmath>
#include <limits>
#include <mutex>
#include <utility>
#include <vector>

#include "earth/crs/definition.hpp"
#include "earth/crs/proj_object.hpp"

namespace terrace::terrain {
namespace {

/// The operation with its own context, which moves between threads with it.
class Worker {
 public:
  explicit Worker(const std::string& definition)
      : context_(make_proj_context()), operation_(proj_create(context_, definition.c_str())) {}
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;
  ~Worker() {
    proj_destroy(operation_);
    proj_context_destroy(context_);
  }
  [[nodiscard]] PJ* operation() const { return operation_; }

 private:
  PJ_CONTEXT* context_;
  PJ* operation_;
};

}  // namespace

class ProjPipeline::Pool {
 public:
  explicit Pool(std::string definition) : definition_(std::move(definition)) {
    idle_.push_back(create_worker());
  }

  /// Borrows a worker for its lifetime.
  class Loan {
   public:
    explicit Loan(Pool& pool) : pool_(pool), worker_(pool.take()) {}
    Loan(const Loan&) = delete;
    Loan& operator=(const Loan&) = delete;
    ~Loan() { pool_.give_back(std::move(worker_)); }
    [[nodiscard]] PJ* operation() const { return worker_->operation(); }

   private:
    Pool& pool_;
    std::unique_ptr<Worker> worker_;
  };

  [[nodiscard]] const std::string& definition() const { return definition_; }

 private:
  [[nodiscard]] std::unique_ptr<Worker> create_worker() const {
    proj_complaint();
    auto worker = std::make_unique<Worker>(definition_);
    check_proj_database();
    if (worker->operation() == nullptr) {
      const std::string reason = proj_complaint();
      throw CrsError(
          "PROJ cannot compute '" + definition_ + "'" + (reason.empty() ? "" : ": " + reason),
          stream::message("give another CRS with {crs} EPSG:n"));
    }
    return worker;
  }
  std::unique_ptr<Worker> take() {
    {
      const std::scoped_lock lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<Worker> worker = std::move(idle_.back());
        idle_.pop_back();
        return worker;
      }
    }
    std::unique_ptr<Worker> worker = create_worker();
    // Reserve room now, because returning a worker must not throw.
    const std::scoped_lock lock(mutex_);
    idle_.reserve(++workers_);
    return worker;
  }
  void give_back(std::unique_ptr<Worker> worker) {
    const std::scoped_lock lock(mutex_);
    idle_.push_back(std::move(worker));
  }

  std::string definition_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Worker>> idle_;
  std::size_t workers_ = 1;
};

namespace {

PJ_COORD moved(PJ* operation, PJ_DIRECTION direction, const Point2& place) {
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  constexpr PJ_COORD kNothing{{kNowhere, kNowhere, kNowhere, kNowhere}};
  if (!std::isfinite(place[0]) || !std::isfinite(place[1])) return kNothing;
  // Pass no time: coordinates that move with the plates are used at their own epoch.
  const PJ_COORD result =
      proj_trans(operation, direction, proj_coord(place[0], place[1], 0, HUGE_VAL));
  return std::isfinite(result.xyzt.x) && std::isfinite(result.xyzt.y) ? result : kNothing;
}

void move_all(PJ* operation, PJ_DIRECTION direction, std::span<Point2> places) {
  for (Point2& place : places) {
    const PJ_COORD result = moved(operation, direction, place);
    place = {result.xyzt.x, result.xyzt.y};
  }
}

}  // namespace

ProjPipeline::ProjPipeline(const std::string& definition)
    : pool_(std::make_shared<Pool>(definition)) {}

const std::string& ProjPipeline::definition() const { return pool_->definition(); }

void ProjPipeline::forward(std::span<Point2> places) const {
  move_all(Pool::Loan(*pool_).operation(), PJ_FWD, places);
}

void ProjPipeline::reverse(std::span<Point2> places) const {
  move_all(Pool::Loan(*pool_).operation(), PJ_INV, places);
}

void ProjPipeline::add_heights(std::span<const Point2> places, std::span<double> heights) const {
  const Pool::Loan loan(*pool_);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (std::isnan(heights[i])) continue;
    const double z = moved(loan.operation(), PJ_FWD, places[i]).xyzt.z;
    heights[i] += std::isfinite(z) ? z : std::numeric_limits<double>::quiet_NaN();
  }
}

}  // namespace terrace::terrain
