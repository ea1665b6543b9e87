// What the browser keeps for this page as long as its tab is open.
import { root } from "./dom.js";
import { mapText } from "./map.js";

/** A number that differs from map to map. */
const mark = [...mapText()].reduce((sum, c) => (31 * sum + c.charCodeAt(0)) | 0, 0);
const file = root.dataset.map;  // as it was when the page was loaded
const place = (name) => `qjulia ${location.pathname} ${file} ${mark} ${name}`;

/** A list that was kept, or an empty one. */
export function recalled(name) {
  try {
    const list = JSON.parse(sessionStorage.getItem(place(name)));
    return Array.isArray(list) ? list : [];
  } catch {
    return [];
  }
}

/** Keeps a list, where the browser does and has room. */
export function remember(name, list) {
  try {
    sessionStorage.setItem(place(name), JSON.stringify(list));
  } catch {
    // They are there until the page is left.
  }
}
