// Files that the server takes: meshes, whose exact sets are shown, and maps, whose grooves the present set gets. They may be
// dropped on the page.
import { button, group, note } from "./controls.js";
import { element } from "./dom.js";
import { ask, asked_json } from "./server.js";

const meshEnds = [".obj", ".glb", ".stl", ".ply"], mapEnds = [".json", ".html", ".png"], mostBytes = 2 ** 26;
const hasEnd = (file, ends) => ends.some((end) => file.name.toLowerCase().endsWith(end));

/** Has the server do something that changes its map, and shows that. @param keeps whether knobs and camera stay. */
async function changeMap(title, path, file, keeps) {
  const stop = new AbortController(), bar = element("progress", { max: 1, ariaLabel: "How much is done" });
  const dialog = element("dialog", {}, element("h1", {}, title), bar,
                         element("div", { className: "row" }, button("Cancel", "Leaves all as it is", () => dialog.close())));
  dialog.addEventListener("close", () => {
    stop.abort();
    dialog.remove();
  });
  document.body.append(dialog);
  dialog.showModal();
  try {
    const report = (share) => { bar.value = share; };
    const named = await ask(path, file ? { name: file.name } : {}, { method: "POST", body: file, signal: stop.signal, report, as: "file" });
    if (!named) throw new Error("The server is ending.");
    if (!keeps) history.replaceState(null, "", location.pathname + location.search);
    location.reload();
  } catch (error) {
    if (!stop.signal.aborted) note(error.message, 12);
    dialog.close();
  }
}

/** What is wrong with a file before it is sent; empty for nothing. */
function problemOf(file, ends, what) {
  if (!hasEnd(file, ends)) return `'${file.name}' is no ${what}: give ${ends.join(", ")}.`;
  if (file.size === 0) return `'${file.name}' is empty.`;
  return file.size > mostBytes ? `'${file.name}' is larger than 64 MiB: use 'qjulia shape ${file.name}', then 'qjulia explore' with its map.` : "";
}

function takeMesh(file) {
  const problem = problemOf(file, meshEnds, "mesh");
  if (problem) note(problem, 12);
  else changeMap(`The set of ${file.name}`, "shape", file, false);
}

function takeGrooves(file) {
  const problem = problemOf(file, mapEnds, "map");
  if (problem) note(problem, 12);
  else changeMap(`The grooves of ${file.name}`, "grooves", file, true);
}

/** A button that asks for a file. */
function chooser(text, title, ends, take) {
  const input = element("input", { type: "file", accept: ends.join(","), hidden: true, onchange: () => {
    if (input.files[0]) take(input.files[0]);
    input.value = "";
  } });
  return [button(text, title, () => input.click()), input];
}

function listenForDrops() {
  const words = element("div", { id: "drop", hidden: true }, "Drop a mesh to see its set, or a map to give its grooves to this set");
  document.body.append(words);
  const isFile = (event) => event.dataTransfer.types.includes("Files");
  addEventListener("dragover", (event) => {
    if (!isFile(event)) return;
    event.preventDefault();
    words.hidden = false;
  });
  addEventListener("dragleave", (event) => { if (!event.relatedTarget) words.hidden = true; });
  addEventListener("drop", (event) => {
    if (!isFile(event)) return;
    event.preventDefault();
    words.hidden = true;
    const { files } = event.dataTransfer;
    if (files.length !== 1) note("Drop one file at a time.");
    else if (hasEnd(files[0], mapEnds)) takeGrooves(files[0]);
    else takeMesh(files[0]);
  });
}

/** Adds the controls to the panel. */
export function offerOthers() {
  listenForDrops();
  group("Other shapes and grooves", element("div", { className: "row" },
    ...chooser("Set of a mesh", "Shows the exact set of a mesh: .obj, .glb, .stl or .ply. You can also drop it on the page", meshEnds, takeMesh),
    ...chooser("Grooves of", "Gives this set the grooves of another map. You can also drop the map's file on the page", mapEnds, takeGrooves),
    button("Fit to its mesh", "Fits a map of factors to the mesh that you have dropped; you can watch, and stop it", async () => {
      try {
        const { problem } = await asked_json("refit", "POST");
        if (problem) throw new Error(problem);
        history.replaceState(null, "", location.pathname + location.search);
        location.reload();
      } catch (error) {
        note(error.message, 12);
      }
    }),
    button("Back to the first", "Shows the map again with which the server began", () => changeMap("The first map", "first", null, false))));
}
