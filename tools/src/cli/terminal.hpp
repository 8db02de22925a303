// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

/// Text output for people. File names, names in files and comments may contain control characters
/// that a terminal would act on, so all messages and summaries go through here.

namespace terrace::tools {

/// Returns `text` with everything that a terminal would act on escaped as \xNN: control characters
/// (C0, DEL and C1), invalid UTF-8, and marks that change the writing direction. Line ends stay.
std::string printable(std::string_view text);
/// Returns printable(text) as a single line: line ends become \n.
std::string printable_line(std::string_view text);

/// Prints "terrace: LINE" on standard error. Joins several lines into one.
void print_message(std::string_view line);
/// Prints lines, each ended by '\n', on standard error.
void print_lines(std::string_view text);
/// Writes the text unchanged to standard output. Throws stream::Error (including ClosedPipe) and
/// stream::Stopped.
void print_result(std::string_view text);

/// Opens any of the descriptors 0 to 2 that are closed, so that no file opened later gets one of
/// these numbers and receives messages. Reading or writing a descriptor that was closed still
/// fails. Call this first in main().
void secure_standard_descriptors() noexcept;

}  // namespace terrace::tools
