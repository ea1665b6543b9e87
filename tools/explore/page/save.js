// Pictures and maps for the viewer to keep.
import { button, line, select } from "./controls.js";
import { element, root } from "./dom.js";

/** That of the map's file without its folder and type. */
const mapName = () => root.dataset.map.replace(/^.*\//, "").replace(/(\.qjulia)?\.[^.]*$/, "") || "map";

/** @param end of the file's name, after that of the map or another. */
export function download(blob, end, name = mapName()) {
  const link = element("a", { href: URL.createObjectURL(blob), download: name + end });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const formats = { png: "image/png", jpg: "image/jpeg", webp: "image/webp" };

/** What the viewer wants of a picture: { name, width, height, format }; null for none.
 * @param size of the one that is seen. @param most pixels a side. */
export async function askPicture(size, most) {
  const side = (name, value) => element("input", { type: "number", name, value, min: 16, max: most, required: true });
  const name = element("input", { name: "file", value: mapName(), required: true, maxLength: 100 });
  const width = side("width", size.width), height = side("height", size.height);
  const format = select("format", Object.keys(formats).map((end) => [end, `.${end}`]));
  const dialog = element("dialog", { id: "picture", ariaLabel: "Save picture" }, element("form", { method: "dialog" },
    element("h1", {}, "Save picture"), line("name", "Says how the file is called, without its extension", name), line("width", "Sets how many pixels wide the picture is", width),
    line("height", "Sets how many pixels high the picture is", height), line("format", "webp and jpg files are smaller, but not exact", format),
    element("div", { className: "row" }, element("button", { value: "save" }, "Save"), button("Cancel", "Save nothing (Escape)", () => dialog.close()))));
  document.body.append(dialog);
  dialog.showModal();
  await new Promise((resolve) => { dialog.addEventListener("close", resolve); });
  dialog.remove();
  if (dialog.returnValue !== "save") return null;
  return { name: name.value, width: Number(width.value), height: Number(height.value), format: format.value };
}

export async function savePicture(canvas, { name, format }) {
  const blob = await new Promise((resolve) => canvas.toBlob(resolve, formats[format], 0.95));
  if (blob?.type !== formats[format]) throw new Error(`this browser cannot make a .${format} picture of this size`);
  download(blob, `.${format}`, name);
}

export const saveMap = (text, name) => download(new Blob([text], { type: "application/json" }), "", name);
/** The name of the page's map as a file, or of another that is made of it. */
export const mapFileName = (end = "") => `${mapName()}${end}.qjulia.json`;
