// SPDX-License-Identifier: GPL-3.0-or-later
#include <vector>

#include <terrace/matching/assignment.hpp>

int main() { return terrace::matching::assign(std::vector<double>{3.0}, 1, 1).cost == 3.0 ? 0 : 1; }
