// SPDX-License-Identifier: GPL-3.0-or-later
// Lists all formats, so every reader and the third-party libraries that it uses must link.
#include <terrace/stream/source.hpp>

int main() { return terrace::stream::formats().empty() ? 1 : 0; }
