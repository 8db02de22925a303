// SPDX-License-Identifier: GPL-3.0-or-later
/// Elements of the page, and what it says to the user.

export function element<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}
/// Inserts texts from a store as text, never as markup.
export function make(tag: string, kind: string, ...content: Array<Node|string>): HTMLElement {
  const made = document.createElement(tag);
  if (kind) made.className = kind;
  made.append(...content);
  return made;
}
export const bold = (text: string) => make('b', '', text);

export const phone = matchMedia('(max-width: 640px)');
export const touch = matchMedia('(pointer: coarse)').matches;

/// Shows the panels over the picture. They wait at first, because a browser that renders in software needs longer to start
/// with them than to show the picture. The style sheet limits the wait.
export const showPanels = () => document.body.classList.remove('starting');

/// Reports that the store cannot be shown. `again` offers a retry.
export function fail(message: string, again = true): void {
  showPanels();
  element('progress').hidden = true;
  element('message').hidden = false;
  element('message-text').textContent = message;
  element('retry').hidden = !again;
}

let noticeTimer = 0;
/// Shows a short message for some seconds.
export function notice(message: string, seconds = 10): void {
  element('notice').textContent = message;
  element('notice').hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = window.setTimeout(() => element('notice').hidden = true, 1000 * seconds);
}
