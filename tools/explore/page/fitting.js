// The page of `qjulia explore MESH` while the fit runs: the mesh, the potential that closes on it, the set, stage by
// stage, and how energy and IoU go. When the fit is done it becomes the page of the map.
import { drawCurve } from "./curves.js";
import { byId, darkBackground, element, fail, followTheme, isDarkTheme } from "./dom.js";
import { ask, asked_json } from "./server.js";

const views = { mesh: { shows: "mesh" }, potential: { iterations: 1 }, set: { iterations: 6 } };
const camera = { azimuth: 30, elevation: 15 };
const undrawn = new Set(["mesh"]);
let shown = 0, isPainting = false, isMoving = false, isOver = false;

/** Draws what is not yet drawn, a view after the other. */
async function paint() {
  if (isPainting) return;
  isPainting = true;
  while (undrawn.size > 0 && !isOver) {
    const [name] = undrawn, canvas = byId(name), stage = shown;
    undrawn.delete(name);
    const size = isMoving ? "160x120" : `${canvas.width}x${canvas.height}`;
    const picture = await ask("frame", { ...views[name], azimuth: camera.azimuth.toFixed(1), elevation: camera.elevation.toFixed(1),
                                         size, samples: 1, steady: 1,
                                         ...(isDarkTheme() ? { background: darkBackground } : {}) });
    if (!picture) continue;
    canvas.getContext("2d").drawImage(await createImageBitmap(picture), 0, 0, canvas.width, canvas.height);
    if (name === "set" && !isMoving && stage === shown) keepStage();
  }
  isPainting = false;
}

let stages = [];
/** Adds the pictures of the stage that is shown to those before. */
function keepStage() {
  const stage = stages[shown - 1], list = byId("stages");
  if (list.dataset.last === String(shown)) return;
  list.dataset.last = shown;
  const pictures = ["potential", "set"].map((name) => {
    const made = element("canvas", { width: 120, height: 90 });
    made.getContext("2d").drawImage(byId(name), 0, 0, 120, 90);
    return made;
  });
  list.append(element("figure", {}, ...pictures, element("figcaption", {}, `${shown - 1}: ${stage.name}, IoU ${stage.iou.toFixed(3)}`)));
  list.scrollLeft = list.scrollWidth;
}

const clock = (seconds) => `${Math.floor(seconds / 60)}:${String(Math.round(seconds % 60)).padStart(2, "0")}`;

function follow(fit) {
  stages = fit.stages;
  const left = fit.seconds_left > 0 && fit.seconds_left < 36000 ? `, ${clock(fit.seconds_left)} left` : "";
  byId("status").textContent = `${fit.activity}${left}${fit.detail ? `: ${fit.detail}` : ""}`;
  byId("progress").style.width = `${100 * fit.fraction}%`;
  drawCurve(byId("energy"), fit.energies, true);
  drawCurve(byId("iou"), [stages.map((stage) => stage.iou)], false);
  byId("stop").disabled = stages.length === 0;
  if (stages.length === shown) return;
  shown = stages.length;
  undrawn.add("potential").add("set");
}

async function watch() {
  while (!isOver) {
    const fit = await asked_json("fit");
    if (fit.state === "done") {
      isOver = true;
      return location.reload();
    }
    if (fit.state === "failed") throw new Error(`${fit.problem}\nLoad this page again to see the set that was shown before.`);
    follow(fit);
    paint().catch(lose);
    await new Promise((resolve) => { setTimeout(resolve, 300); });
  }
}

function lose(error) {
  if (isOver) return;
  isOver = true;
  fail(error);
}

function turn(event) {
  if (event.buttons !== 1) return;
  camera.azimuth -= 0.4 * event.movementX;
  camera.elevation = Math.min(90, Math.max(-90, camera.elevation + 0.4 * event.movementY));
  redraw(true);
}
function redraw(moving) {
  isMoving = moving;
  for (const name of Object.keys(views)) if (name === "mesh" || shown > 0) undrawn.add(name);
  paint().catch(lose);
}
for (const name of Object.keys(views)) {
  byId(name).addEventListener("pointerdown", (event) => event.target.setPointerCapture(event.pointerId));
  byId(name).addEventListener("pointermove", turn);
  byId(name).addEventListener("pointerup", () => redraw(false));
}
byId("stop").addEventListener("click", async () => {
  byId("stop").disabled = true;
  byId("stop").textContent = "Stopping …";
  await asked_json("stop", "POST");
});
followTheme();
watch().catch(lose);
