// Keys as a script that `qjulia film` takes.
import { root } from "./dom.js";
import { settings } from "./settings.js";
import { backdropOptions, differ, namesOf, short, usual, valuesOf } from "./state.js";

const tomlOf = (value) => typeof value === "string" ? JSON.stringify(value) : short(value);
const lineOf = ([name, value]) => `${name} = ${Array.isArray(value) && value.length !== 1 ? `[${value.map(tomlOf).join(", ")}]` : tomlOf([value].flat()[0])}`;

/** What a key may have, by the names of films: [name, value]; and what holds for the whole film. */
function split({ values }, first) {
  const moving = [], fixed = [];
  for (const setting of [...settings.map, ...settings.picture]) {
    const name = setting.option.replaceAll("-", "_"), isFixed = setting.type === "word" || setting.type === "seed";
    if (setting.type === "lamp") {
      // The lamp goes with the camera here; lamp_turn says so in a film.
      if (differ(first, ...namesOf(setting))) fixed.push([name, [valuesOf(setting, first)].flat()]);
      moving.push(["lamp_turn", values.azimuth + values.lightaz - first.lightaz]);
    } else if (isFixed) {
      if (differ(first, ...namesOf(setting))) fixed.push([name, valuesOf(setting, first)[0]]);
    } else {
      moving.push([name, valuesOf(setting, values)]);
    }
  }
  for (const axis of ["x", "y", "z"]) moving.push([`cut_${axis}`, values[`cut${axis}`]]);
  return { moving, fixed };
}

/** @param keys as `sorted` has them, with a point to look at and a distance. @param size of its pictures, "960x720". */
export function scriptOf(keys, size) {
  const first = keys[0].values, parts = keys.map((key) => split(key, first));
  // What never moves is said once.
  const constant = parts[0].moving.filter(([name], i) => parts.every(({ moving }) => lineOf(moving[i]) === lineOf([name, parts[0].moving[i][1]])));
  const still = constant.map(([name]) => name), asUsual = split({ values: usual }, first).moving.map(lineOf);
  const options = [["size", size], ...parts[0].fixed, ...constant.filter((one) => !/^cut_/.test(one[0]) && !asUsual.includes(lineOf(one)))];
  const cuts = constant.filter(([name, value]) => /^cut_/.test(name) && value < 100).map(([name, value]) => `${name.at(-1)}=${short(value)}%`);
  if (cuts.length > 0) options.push(["cut", cuts]);
  options.push(...backdropOptions(first));
  if (root.dataset.renderer === "webgl") options.push(["keep_loose", true]);
  const blocks = keys.map(({ at }, k) => ["[[key]]", lineOf(["at", at]), ...parts[k].moving.filter(([name]) => !still.includes(name)).map(lineOf)]);
  return [
    [`# Keys from the page of ${root.dataset.map}. Look at it by: qjulia film sheet SCRIPT`,
     "[film]", lineOf(["map", root.dataset.map]), lineOf(["seconds", Math.max(keys.at(-1).at, 0.04)]), "rate = 25"],
    ["[options]", ...options.map(lineOf)], ...blocks,
  ].map((block) => block.join("\n")).join("\n\n") + "\n";
}
