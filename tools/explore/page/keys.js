// Keys of a film: the settings of the page at given seconds, and what stands between them. Numbers go
// as the step "spline" of tools/film/track.cpp.
import { turned } from "./vectors.js";
import { settings } from "./settings.js";
import { ranges } from "./state.js";

const phases = ["phase1", "phase2", "phase3"];
const angles = ["azimuth", "lightaz", "environturn"];  // they go the shorter way around
const still = ["lightup", "light", "order"];  // of the first key throughout, as words are: films have no keys for them
const byRatio = [...settings.map, ...settings.picture].flatMap((setting) => setting.controls).filter((control) => control.log).map((control) => control.name);

/** Keys by their time, in which no angle jumps from 180 to -180 degrees. */
export function sorted(keys) {
  const all = keys.map((key) => ({ at: key.at, values: { ...key.values } })).sort((a, b) => a.at - b.at);
  for (let i = 1; i < all.length; ++i) {
    for (const name of angles.filter((each) => each in all[i].values)) {
      all[i].values[name] += 360 * Math.round((all[i - 1].values[name] - all[i].values[name]) / 360);
    }
  }
  return all;
}

/** The slope at a key, as Track::slope has it. */
function slope(times, values, key) {
  const last = times.length - 1, span = (k) => times[k + 1] - times[k], rise = (k) => (values[k + 1] - values[k]) / span(k);
  if (last === 1) return rise(0);
  if (key > 0 && key < last) {
    const before = rise(key - 1), after = rise(key);
    if (before * after <= 0) return 0;
    const a = span(key - 1) + 2 * span(key), b = 2 * span(key - 1) + span(key);
    return (a + b) / (b / before + a / after);
  }
  const [near, far] = key === 0 ? [0, 1] : [last - 1, last - 2];
  const end = rise(near) + (rise(near) - rise(far)) * span(near) / (span(near) + span(far));
  if (end * rise(near) <= 0) return 0;
  return Math.abs(end) > 3 * Math.abs(rise(near)) ? 3 * rise(near) : end;
}

function spline(times, values, k, t) {
  const length = times[k + 1] - times[k], from = values[k], rise = values[k + 1] - from;
  const left = length * slope(times, values, k), right = length * slope(times, values, k + 1);
  return from + t * left + t * t * (3 * rise - 2 * left - right) + t * t * t * (left + right - 2 * rise);
}

/** The state at a time. @param keys as `sorted` has them; words are those of the first. */
export function stateAt(keys, time) {
  const k = keys.findLastIndex((key) => key.at <= time);
  if (k < 0) return keys[0].values;
  if (k === keys.length - 1) return keys[k].values;
  const times = keys.map((key) => key.at), t = (time - times[k]) / (times[k + 1] - times[k]), made = { ...keys[0].values };
  const between = (of) => spline(times, keys.map((key) => of(key.values)), k, t);
  for (const name of Object.keys(ranges).filter((each) => !still.includes(each))) {
    made[name] = byRatio.includes(name) ? Math.exp(between((values) => Math.log(values[name]))) : between((values) => values[name]);
  }
  made.iterations = Math.round(made.iterations);
  const [from, to] = [k, k + 1].map((i) => phases.map((name) => keys[i].values[name]));
  if (from.every(Number.isFinite)) turned(from, to, t * t * (3 - 2 * t)).forEach((angle, i) => { made[phases[i]] = angle; });
  made.look = [0, 1, 2].map((i) => between((values) => values.look[i]));
  made.distance = between((values) => values.distance);
  return made;
}
