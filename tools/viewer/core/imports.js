// SPDX-License-Identifier: GPL-3.0-or-later
// What the page gives to the module beside Emscripten's own (src/core.ts): the linker wants to know the names.
const {library} = LibraryManager;
mergeInto(library, {number: () => {}});
