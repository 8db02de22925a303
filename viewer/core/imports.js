// SPDX-License-Identifier: GPL-3.0-or-later
// Imports that the page provides besides Emscripten's own (src/core.ts), so that the linker knows
// their names.
const {library} = LibraryManager;
mergeInto(library, {number: () => {}});
