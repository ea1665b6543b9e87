// What goes wrong anywhere is said on the page.

export function fail(error) {
  document.documentElement.dataset.state = "error";
  document.getElementById("note").textContent = error.message ?? String(error);
}
addEventListener("error", (event) => fail(event.error ?? event));
addEventListener("unhandledrejection", (event) => fail(event.reason));
