// SPDX-License-Identifier: Apache-2.0
#include "terrace/cluster/block.hpp"

#include <gtest/gtest.h>
