// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/point_tin.hpp"

#include <gtest/gtest.h>
