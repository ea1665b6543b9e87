// Has browsers show the page, and that it draws, before they compile shaders and make grids, which keeps them busy.

/** Comes true when the page has been shown; where it is in the background, soon. */
export const isSeen = new Promise((resolve) => {
  requestAnimationFrame(() => setTimeout(resolve));
  setTimeout(resolve, 300);
});
