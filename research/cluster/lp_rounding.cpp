// SPDX-License-Identifier: GPL-3.0-or-later
#include "lp_rounding.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <string>

#include <glpk.h>

#include "facility/bounds/matrix_dual.hpp"
#include "facility/matrix/cost_rows.hpp"

namespace terrace::research {

using cluster::FacilityMatrix;

namespace {

// Fractions below this count as zero.
constexpr double kFraction = 1e-9;

class Relaxation {
 public:
  explicit Relaxation(const FacilityMatrix& problem)
      : m_(static_cast<int>(problem.facilities)),
        n_(static_cast<int>(problem.clients)),
        is_bounded_(problem.facilities * problem.clients, 0),
        program_(glp_create_prob()) {
    double largest = 0.0;
    for (const double c : problem.opening) largest = std::max(largest, c);
    for (const double c : problem.connection) largest = std::max(largest, c);
    // GLPK's tolerances are absolute.
    if (largest > 0.0) exponent_ = std::ilogb(largest) - 10;
    glp_set_obj_dir(program_, GLP_MIN);
    glp_add_cols(program_, m_ + m_ * n_);
    for (int j = 0; j < m_; ++j) {
      glp_set_col_bnds(program_, open(j), GLP_LO, 0.0, 0.0);
      glp_set_obj_coef(program_, open(j),
                       std::ldexp(problem.opening[static_cast<std::size_t>(j)], -exponent_));
      for (int i = 0; i < n_; ++i) {
        glp_set_col_bnds(program_, connected(j, i), GLP_LO, 0.0, 0.0);
        const double cost = problem.cost(static_cast<std::size_t>(j), static_cast<std::size_t>(i));
        glp_set_obj_coef(program_, connected(j, i), std::ldexp(cost, -exponent_));
      }
    }
    glp_add_rows(program_, n_);
    std::vector<int> columns(static_cast<std::size_t>(m_) + 1);
    const std::vector<double> ones(columns.size(), 1.0);
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < m_; ++j) columns[static_cast<std::size_t>(j) + 1] = connected(j, i);
      glp_set_row_bnds(program_, i + 1, GLP_FX, 1.0, 1.0);
      glp_set_mat_row(program_, i + 1, m_, columns.data(), ones.data());
    }
  }
  ~Relaxation() { glp_delete_prob(program_); }
  Relaxation(const Relaxation&) = delete;
  Relaxation& operator=(const Relaxation&) = delete;

  void solve() {
    do {
      glp_smcp options;
      glp_init_smcp(&options);
      options.msg_lev = GLP_MSG_OFF;
      options.meth = GLP_DUALP;
      const int failure = glp_simplex(program_, &options);
      if (failure != 0 || glp_get_status(program_) != GLP_OPT) {
        throw std::runtime_error("GLPK did not solve the linear relaxation: code " +
                                 std::to_string(failure) + ", status " +
                                 std::to_string(glp_get_status(program_)));
      }
    } while (add_violated());
  }

  [[nodiscard]] double value() const { return std::ldexp(glp_get_obj_val(program_), exponent_); }
  [[nodiscard]] double fraction(int j) const { return glp_get_col_prim(program_, open(j)); }
  [[nodiscard]] bool uses(int j, int i) const {
    return glp_get_col_prim(program_, connected(j, i)) > kFraction;
  }
  [[nodiscard]] double dual(int i) const {
    return std::ldexp(glp_get_row_dual(program_, i + 1), exponent_);
  }

 private:
  // GLPK's columns count from 1.
  [[nodiscard]] int open(int j) const { return 1 + j; }
  [[nodiscard]] int connected(int j, int i) const { return 1 + m_ + j * n_ + i; }

  // Adds the constraints x_ij <= y_j that are violated. Returns whether there were any.
  bool add_violated() {
    bool added = false;
    for (int j = 0; j < m_; ++j) {
      for (int i = 0; i < n_; ++i) {
        char& bounded = is_bounded_[static_cast<std::size_t>(j * n_ + i)];
        if (bounded) continue;
        if (glp_get_col_prim(program_, connected(j, i)) <= fraction(j) + kFraction) continue;
        bounded = 1;
        added = true;
        const int row = glp_add_rows(program_, 1);
        const std::array<int, 3> columns{0, connected(j, i), open(j)};
        const std::array<double, 3> values{0.0, 1.0, -1.0};
        glp_set_row_bnds(program_, row, GLP_UP, 0.0, 0.0);
        glp_set_mat_row(program_, row, 2, columns.data(), values.data());
      }
    }
    return added;
  }

  int m_, n_;
  int exponent_ = 0;
  std::vector<char> is_bounded_;
  glp_prob* program_;
};

std::vector<std::uint32_t> rounded(const Relaxation& relaxation, const FacilityMatrix& problem,
                                   const std::vector<double>& duals) {
  std::vector<std::uint32_t> order(problem.clients);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return duals[a] < duals[b]; });
  std::vector<char> blocked(problem.facilities, 0);
  std::vector<std::uint32_t> open;
  for (const std::uint32_t i : order) {
    std::vector<std::uint32_t> near;
    bool free = true;
    for (std::uint32_t j = 0; j < problem.facilities; ++j) {
      if (!relaxation.uses(static_cast<int>(j), static_cast<int>(i))) continue;
      near.push_back(j);
      free = free && !blocked[j];
    }
    if (!free || near.empty()) continue;
    for (const std::uint32_t j : near) blocked[j] = 1;
    open.push_back(*std::min_element(
        near.begin(), near.end(),
        [&](std::uint32_t a, std::uint32_t b) { return problem.opening[a] < problem.opening[b]; }));
  }
  std::sort(open.begin(), open.end());
  return open;
}

}  // namespace

LpRounding lp_rounding(const FacilityMatrix& problem) {
  cluster::check(problem);
  if (problem.facilities > 10000000 / problem.clients) {
    throw std::invalid_argument("a linear program of " + std::to_string(problem.facilities) +
                                " facilities times " + std::to_string(problem.clients) +
                                " clients is too large to solve: use interchange");
  }
  Relaxation relaxation(problem);
  relaxation.solve();
  LpRounding result;
  result.relaxation = relaxation.value();
  for (int j = 0; j < static_cast<int>(problem.facilities); ++j) {
    result.fractions.push_back(relaxation.fraction(j));
  }
  for (int i = 0; i < static_cast<int>(problem.clients); ++i) {
    result.duals.push_back(relaxation.dual(i));
  }
  result.solution = cluster::solution_of(problem, rounded(relaxation, problem, result.duals));
  result.solution.lower_bound = cluster::dual_value(problem, result.duals);
  return result;
}

}  // namespace terrace::research
