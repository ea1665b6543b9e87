// What all pages share: their elements, their theme, and where they say what went wrong.

export const root = document.documentElement;
export const byId = (id) => document.getElementById(id);
/** The picture's own element, where the page has one picture. */
export const canvas = byId("canvas");
/** How coarse the first picture of its size is as yet, pixels of the screen a side, for the style. */
export function tellPass(divisor) {
  if (root.dataset.pass !== "1") root.dataset.pass = divisor;
}
/** Gives the canvas other sides, and with that empties it: until something is drawn it is not shown. */
export function resizeCanvas(width, height) {
  delete root.dataset.pass;
  Object.assign(canvas, { width, height });
}

/** A new element with children. */
export function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/** An ImageData as an element. */
export function canvasOf(image) {
  const made = element("canvas", { width: image.width, height: image.height });
  made.getContext("2d").putImageData(image, 0, 0);
  return made;
}

/** The theme is the browser's, until another is chosen. */
export function followTheme() {
  root.dataset.theme = matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light";
}

export const isDarkTheme = () => root.dataset.theme === "dark";
/** A dark backdrop's colour, as qjulia render takes it. */
export const darkBackground = "1d1f24";

/** What goes wrong anywhere is said on the page. */
export function fail(error) {
  root.dataset.state = "error";
  byId("note").textContent = error.message ?? String(error);
}
addEventListener("error", (event) => fail(event.error ?? event));
addEventListener("unhandledrejection", (event) => fail(event.reason));
