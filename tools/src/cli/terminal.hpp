// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

/// Text for people. File names, names in files and comments may hold control characters, which a
/// terminal obeys: all messages and summaries go through here.

namespace terrace::tools {

/// `text` with what a terminal would obey made visible as \xNN: control characters (of C0, DEL and
/// C1), bytes that are not UTF-8, and marks that turn the direction of writing. Line ends stay.
std::string printable(std::string_view text);
/// The same for a part of a line: line ends become \n.
std::string printable_line(std::string_view text);

/// "terrace: LINE" on standard error. Several lines become one.
void print_message(std::string_view line);
/// Lines, each ended by '\n', on standard error.
void print_lines(std::string_view text);
/// Writes all of the text, unchanged, to standard output. Throws: stream::Error, ClosedPipe among
/// them; stream::Stopped.
void print_result(std::string_view text);

/// Makes sure that descriptors 0 to 2 are open, so that no file opened later gets one of these
/// numbers, and messages into it. Reading or writing a descriptor that was closed still fails. To
/// be called first of all.
void secure_standard_descriptors() noexcept;

}  // namespace terrace::tools
