// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

#include "terrace/tri/grid_tin.hpp"

namespace terrace::tri::tin {

/// Throws std::invalid_argument if the window is empty or the number of heights does not match.
template <class T>
void check_shape(const GridWindow<T>& window, const char* function) {
  const std::size_t samples = static_cast<std::size_t>(window.columns) * window.rows;
  if (samples == 0 || window.heights.size() != samples)
    throw std::invalid_argument(std::string(function) + ": a window of " +
                                std::to_string(window.columns) + " x " +
                                std::to_string(window.rows) + " samples with " +
                                std::to_string(window.heights.size()) + " heights");
}

}  // namespace terrace::tri::tin
