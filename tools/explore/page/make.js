// Files that the server makes of what is seen: meshes, pictures and turntables.
import { button, group, line, note, select } from "./controls.js";
import { queryOf } from "./command.js";
import { element } from "./dom.js";
import { download } from "./save.js";
import { ask } from "./server.js";

/** What can be made: the name, the end of the file's name, which numbers matter, and what they are at first. */
const products = {
  ply: { text: "mesh, .ply (Blender, MeshLab, ParaView)", file: "_surface.ply", asks: ["resolution"] },
  obj: { text: "mesh, .obj", file: "_surface.obj", asks: ["resolution"] },
  glb: { text: "mesh, .glb (web, AR)", file: "_surface.glb", asks: ["resolution"] },
  stl: { text: "printable file, .stl", file: "_print.stl", asks: ["resolution", "millimetres"] },
  png: { text: "picture, .png (holds the map and how it was made)", file: ".png", asks: ["width", "height"], usual: { width: 1280, height: 960 } },
  turntable: { text: "turntable, .png that moves", file: "_turntable.png", asks: ["frames", "width", "height"], usual: { width: 480, height: 360 } },
};
const numbers = {
  resolution: ["cells", 256, 16, 1024, "Sets how many cells the grid has along the box's longest side: more show finer grooves, and take longer"],
  millimetres: ["length, mm", 80, 1, 10000, "Sets the length of the shape's longest side"],
  frames: ["pictures", 36, 2, 120, "Sets how many pictures the whole turn has"],
  width: ["width", 1280, 16, 4096, "Sets how many pixels wide a picture is"],
  height: ["height", 960, 16, 4096, "Sets how many pixels high a picture is"],
};

/** Adds the controls to the panel. */
export function offerFiles() {
  let making = null;  // an AbortController while something is made
  const fields = Object.fromEntries(Object.entries(numbers).map(([name, [text, value, min, max, title]]) =>
    [name, line(text, title, element("input", { type: "number", name, value, min, max, step: 1 }))]));
  const follow = () => {
    const { asks, usual = {} } = products[product.value];
    for (const [name, field] of Object.entries(fields)) {
      field.hidden = !asks.includes(name);
      if (name in usual) field.lastElementChild.value = usual[name];
    }
  };
  const product = select("product", Object.entries(products).map(([value, { text }]) => [value, text]), follow);
  const bar = element("progress", { max: 1, value: 0, hidden: true, ariaLabel: "How much is made" });
  const begin = button("Make and download", "Makes the file on this machine's device, and downloads it", async () => {
    making = new AbortController();
    begin.hidden = true, cancel.hidden = bar.hidden = false;
    bar.removeAttribute("value");
    const kind = product.value, { file, asks } = products[kind];
    const given = Object.fromEntries(asks.map((name) => [name, fields[name].lastElementChild.value]));
    let made = "";
    const report = (share, text) => { bar.value = share, made = text; };
    try {
      await make(kind, given, file, { signal: making.signal, report });
      note(`made: ${made}`, 8);
    } catch (error) {
      note(making.signal.aborted ? "nothing was made" : error.message, 8);
    }
    begin.hidden = false, cancel.hidden = bar.hidden = true;
  });
  const cancel = button("Cancel", "Makes nothing after all", () => making.abort());
  cancel.hidden = true;
  group("Make a file", line("file", "Says what is made of the set with its knobs as they stand. Meshes are open where it is cut", product),
        ...Object.values(fields), bar, element("div", { className: "row" }, begin, cancel));
  follow();
}

async function make(kind, { width, height, ...given }, file, options) {
  const query = { ...queryOf(), ...given, make: kind };
  if (width) Object.assign(query, { size: `${width}x${height}`, samples: 2 });
  const bytes = await ask("make", query, options);
  if (!bytes) throw new Error("another page's request came in between");
  download(bytes, file);
}
