// Lets browsers show the page, and that it is drawing, before they compile shaders and make grids,
// which blocks them.

/** Comes true when the page has been shown; where it is in the background, soon. */
export const isSeen = new Promise((resolve) => {
  requestAnimationFrame(() => setTimeout(resolve));
  setTimeout(resolve, 300);
});
