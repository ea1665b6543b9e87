// What all pages share: their elements, their theme, and where they say what went wrong.

export const root = document.documentElement;
export const byId = (id) => document.getElementById(id);
/** The picture's own element, where the page has one picture. */
export const canvas = byId("canvas");

/** A new element with children. */
export function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/** The theme is the browser's, until another is chosen. */
export function followTheme() {
  root.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

/** What goes wrong anywhere is said on the page. */
export function fail(error) {
  root.dataset.state = "error";
  byId("note").textContent = error.message ?? String(error);
}
addEventListener("error", (event) => fail(event.error ?? event));
addEventListener("unhandledrejection", (event) => fail(event.reason));
