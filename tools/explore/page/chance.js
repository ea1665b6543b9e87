// States by chance: any, or kin of another; and how far apart small pictures are.
import { ranges, state, usual, words } from "./state.js";

/** Ranges in which all sets are worth seeing. `still`: how often the usual value stays. */
const genes = {
  iterations: { low: 3, high: 9 }, detail: { low: usual.detail / 4, high: usual.detail * 3, log: true },
  steepness: { low: 1, high: 6, log: true }, drift: { low: 0, high: 0.6, still: 0.5 }, slice: { low: -0.15, high: 0.15, still: 0.7 },
  phase1: { low: 0, high: 180 }, phase2: { low: 0, high: 180 }, phase3: { low: -180, high: 180 }, order: { low: 1, high: 999999, still: 0.3 },
  azimuth: { low: -180, high: 180 }, elevation: { low: -10, high: 50 }, zoom: { low: 1, high: 3, log: true, still: 0.5 },
  lightaz: { low: -120, high: 120 }, lightup: { low: 5, high: 70 }, light: { low: 0.7, high: 1.6 },
};
const mutable = Object.keys(genes).filter((name) => Object.hasOwn(ranges, name));
const menus = ["material", "palette", "wears"].filter((name) => Object.hasOwn(words, name));
const isWhole = (name) => name === "iterations" || name === "order";

/** A value of a gene from 0 to 1 and back. */
const wayOf = ({ low, high, log }, v) => log ? Math.log(v / low) / Math.log(high / low) : (v - low) / (high - low);
const valueAt = ({ low, high, log }, way) => log ? low * (high / low) ** way : low + way * (high - low);

function tidy(name, value) {
  const [, least, most] = ranges[name], rounded = isWhole(name) ? Math.round(value) : Number(value.toPrecision(3));
  return Math.min(Math.max(rounded, least), most);
}

const oneOf = (list) => list[Math.floor(list.length * Math.random())];

/** Any state, turned and cut as the present one. */
export function anyState() {
  const made = { ...state, look: null, distance: null };
  for (const name of mutable) {
    const { still = 0 } = genes[name];
    made[name] = Math.random() < still ? usual[name] : tidy(name, valueAt(genes[name], Math.random()));
  }
  for (const name of menus) made[name] = oneOf(words[name]);
  return made;
}

/** A state near the present one in everything. @param spread of genes, as a share of their ranges. */
export function kinState(spread) {
  const made = { ...state }, dice = () => (Math.random() + Math.random() + Math.random() - 1.5) * 2 * spread;
  for (const name of mutable) {
    const { still = 0 } = genes[name];
    if (name === "order" ? Math.random() > spread : state[name] === usual[name] && Math.random() < still) continue;
    made[name] = tidy(name, valueAt(genes[name], wayOf(genes[name], state[name]) + dice()));
  }
  for (const name of menus) if (Math.random() < spread / 2) made[name] = oneOf(words[name]);
  return made;
}

const part = 8;  // pixels a side that a signature averages

/** The means of an ImageData's parts: red, green, blue, 0 ... 255. */
export function signature({ width, height, data }) {
  const columns = Math.floor(width / part), rows = Math.floor(height / part), means = new Float32Array(3 * columns * rows);
  for (let y = 0; y < rows * part; ++y) {
    for (let x = 0; x < columns * part; ++x) {
      const to = 3 * (Math.floor(y / part) * columns + Math.floor(x / part)), from = 4 * (y * width + x);
      for (let c = 0; c < 3; ++c) means[to + c] += data[from + c] / part ** 2;
    }
  }
  return means;
}

/** The mean difference of two signatures. */
export const difference = (a, b) => a.reduce((sum, v, i) => sum + Math.abs(v - b[i]), 0) / a.length;

/** Whether a picture shows something: its neighbouring pixels differ more than those of an empty backdrop. */
export function showsSomething({ width, data }) {
  let sum = 0, count = 0;
  for (let i = 4; i < data.length; i += 4) if ((i / 4) % width > 0) sum += Math.abs(data[i + 1] - data[i - 3]), ++count;
  return sum / count > 1.2;
}

/** Which of these are farthest apart, one after the other as far as can be from all before (Gonzalez 1985):
 * { chosen: indices, least: the least difference of two }. */
export function farthest(signatures, count) {
  const away = signatures.map(() => Infinity), chosen = [];
  let next = 0, least = Infinity;
  while (chosen.length < Math.min(count, signatures.length)) {
    if (chosen.length > 0) least = Math.min(least, away[next]);
    chosen.push(next);
    signatures.forEach((other, i) => { away[i] = chosen.includes(i) ? -1 : Math.min(away[i], difference(other, signatures[next])); });
    next = away.indexOf(Math.max(...away));
  }
  return { chosen, least };
}
