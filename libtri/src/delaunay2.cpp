// SPDX-License-Identifier: GPL-3.0-or-later
#include "terrace/tri/delaunay2.hpp"
