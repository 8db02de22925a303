// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "setting.hpp"

/// The tables and figures, each in the file of its name. They report their results, and throw
/// std::runtime_error if a result is invalid.

namespace terrace::cluster::thesis {

void table_7_1(Setting& setting);    ///< block size: time, memory, clusters
void table_7_4(Setting& setting);    ///< where the plain search spends its time
void table_7_5(Setting& setting);    ///< the short search compared with the long one
void table_7_6(Setting& setting);    ///< space partitioning
void table_7_7(Setting& setting);    ///< threads
void table_7_8(Setting& setting);    ///< complete linkage on CPU and GPU
void figure_7_5(Setting& setting);   ///< order of the stream
void figure_7_6(Setting& setting);   ///< memory as a function of block size
void figure_7_12(Setting& setting);  ///< wrongly assigned points
void figure_7_13(Setting& setting);  ///< share of positive gains
void figure_7_14(Setting& setting);  ///< share of vertices inspected

}  // namespace terrace::cluster::thesis
