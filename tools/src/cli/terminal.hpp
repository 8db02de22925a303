// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string>
#include <string_view>

/// Text on its way to people. File names, names in files and comments may hold anything, and a
/// terminal obeys control characters: all messages and summaries go through here.

namespace terrace::tools {

/// `text` with what a terminal would obey made visible as \xNN: control characters (of C0, DEL and
/// C1), bytes that are no UTF-8, and marks that turn the direction of writing. Line ends stay.
std::string printable(std::string_view text);
/// The same for a part of a line: line ends become \n.
std::string printable_line(std::string_view text);

/// "terrace: LINE" on standard error. Several lines become one.
void print_message(std::string_view line);
/// Lines, each ended by '\n', on standard error.
void print_lines(std::string_view text);
/// Text on standard output, as it is and all of it. Throws: stream::Error, ClosedPipe among them;
/// stream::Stopped.
void print_result(std::string_view text);

/// Makes sure that descriptors 0 to 2 are open, so that no file that is opened later gets the
/// number of one of them and messages into it. What was closed can then be neither read nor
/// written: to use it fails as before. To be called first of all.
void secure_standard_descriptors() noexcept;

}  // namespace terrace::tools
