// WebGL 2: programs of the page's .glsl files, textures, waiting for what was drawn.
import { byId, canvas } from "./dom.js";
import { unpacked } from "./packed.js";
import { scene } from "./scene.js";
import { isSeen } from "./seen.js";

await isSeen;

export const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true, powerPreference: "high-performance" });
if (!gl) throw new Error("this page needs WebGL 2: try another browser, or turn on its graphics acceleration");
if (!gl.getExtension("EXT_color_buffer_float")) {
  throw new Error("this page needs textures of 32-bit numbers to draw to, which this browser's graphics do not have");
}

const { files, groups, portals } = scene;
const isBlock = 80 * groups <= 16384;  // the least size that a uniform block has anywhere: 816 factors
const head = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler3D;
#define GROUPS ${Math.max(groups, 1)}
#define FACTORS_IN_BLOCK ${Number(isBlock)}
#define PORTALS ${portals}
`;

/** The text of a file with all that it includes, each once. */
function source(name, included = new Set()) {
  const file = files[name] ?? name;
  if (included.has(file)) return "";
  included.add(file);
  const text = byId(file).textContent;
  return text.replace(/^#include (.*)$/gm, (_, other) => source(other, included));
}

const corner = `#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }`;

/** A program that draws every pixel of a file's main. Compiling goes on beside the page until it is used. */
export function program(file) {
  const made = { file, handle: gl.createProgram(), uniforms: null };
  for (const [type, text] of [[gl.VERTEX_SHADER, corner], [gl.FRAGMENT_SHADER, head + source(file)]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made.handle, shader);
  }
  gl.linkProgram(made.handle);
  return made;
}

function finish(made) {
  if (!gl.getProgramParameter(made.handle, gl.LINK_STATUS)) {
    const logs = gl.getAttachedShaders(made.handle).map((s) => gl.getShaderInfoLog(s)).join(" ");
    throw new Error(`${made.file} does not compile here: ${gl.getProgramInfoLog(made.handle)} ${logs}`);
  }
  made.uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(made.handle, gl.ACTIVE_UNIFORMS); ++i) {
    const { name, type } = gl.getActiveUniform(made.handle, i);
    const at = gl.getUniformLocation(made.handle, name);
    if (at) made.uniforms[name.replace("[0]", "")] = { type, at };
  }
  const block = gl.getUniformBlockIndex(made.handle, "Factors");
  if (block !== gl.INVALID_INDEX) gl.uniformBlockBinding(made.handle, block, 0);
}

/** Textures have units by their uniform's name. */
const units = { factors: 0, grid: 1, points: 2, hints: 3, before: 4, depths: 5, traits: 6, picture: 7,
                coefficients: 8, scratch: 9, paint: 10, file_bytes: 11, widened: 11, sums: 12, coarse: 13, ranks: 14, corrections: 15 };
const samplers = [gl.SAMPLER_2D, gl.SAMPLER_3D, gl.INT_SAMPLER_2D, gl.UNSIGNED_INT_SAMPLER_2D];
/** What sets uniforms that are no matrices. */
const setters = { [gl.FLOAT]: "uniform1fv", [gl.FLOAT_VEC2]: "uniform2fv", [gl.FLOAT_VEC3]: "uniform3fv", [gl.FLOAT_VEC4]: "uniform4fv",
                  [gl.UNSIGNED_INT]: "uniform1uiv", [gl.INT]: "uniform1iv", [gl.INT_VEC3]: "uniform3iv", [gl.BOOL]: "uniform1iv" };

export function use(made, values) {
  if (!made.uniforms) finish(made);
  gl.useProgram(made.handle);
  for (const [name, { type, at }] of Object.entries(made.uniforms)) {
    if (samplers.includes(type)) {
      gl.uniform1i(at, units[name]);
      continue;
    }
    const value = values[name];
    if (value === undefined) throw new Error(`${made.file}: ${name} is not set`);
    const list = [value].flat(Infinity).map(Number);
    if (type === gl.FLOAT_MAT3) gl.uniformMatrix3fv(at, false, list);
    else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(at, false, list);
    else gl[setters[type]](at, list);
  }
}

export function bind(name, kind, handle) {
  gl.activeTexture(gl.TEXTURE0 + units[name]);
  gl.bindTexture(kind, handle);
}

/** An empty texture; `size` has two or three sides. It stays bound to `scratch`. */
export function texture(format, size, filter = gl.NEAREST) {
  const made = gl.createTexture(), kind = size.length === 3 ? gl.TEXTURE_3D : gl.TEXTURE_2D;
  bind("scratch", kind, made);
  if (size.length === 3) gl.texStorage3D(kind, 1, format, ...size);
  else gl.texStorage2D(kind, 1, format, ...size);
  for (const side of ["S", "T", "R"]) gl.texParameteri(kind, gl["TEXTURE_WRAP_" + side], gl.CLAMP_TO_EDGE);
  gl.texParameteri(kind, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(kind, gl.TEXTURE_MAG_FILTER, filter);
  return made;
}

/** A texture of two sides that keeps its name and changes its size. */
const kept = new Map();
export function keptTexture(name, format, width, height) {
  const old = kept.get(name);
  if (old && old.width === width && old.height === height) return old.handle;
  if (old) gl.deleteTexture(old.handle);
  kept.set(name, { handle: texture(format, [width, height]), width, height });
  return kept.get(name).handle;
}

const framebuffer = gl.createFramebuffer();
/** Draws go to this texture, or to the canvas; of a texture of three sides to one layer. */
export function drawTo(handle, width, height, layer = null) {
  gl.bindFramebuffer(gl.FRAMEBUFFER, handle ? framebuffer : null);
  if (layer !== null) gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, handle, 0, layer);
  else if (handle) gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, handle, 0);
  gl.viewport(0, 0, width, height);
}

export const drawAll = () => gl.drawArrays(gl.TRIANGLES, 0, 3);

/** Longest wait for draws, ms: for measurements. */
export const waits = { longest: 0 };

const later = new MessageChannel(), waiting = [];
later.port1.onmessage = () => waiting.shift()();
/** The page's next turn; a timer would take 4 ms. */
const nextTurn = () => new Promise((resolve) => { waiting.push(resolve); later.port2.postMessage(0); });

/** Waits for what was drawn, without blocking the page; returns milliseconds. */
export async function drawn() {
  const start = performance.now(), fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  while (gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) {
    await (performance.now() - start < 2 ? nextTurn() : new Promise((resolve) => setTimeout(resolve, 1)));
  }
  gl.deleteSync(fence);
  if (gl.isContextLost()) throw new Error("the browser has taken its graphics away: load the page again");
  const ms = performance.now() - start;
  waits.longest = Math.max(waits.longest, ms);
  return ms;
}

/** Whether any pixel of the query was drawn. */
export async function anyPassed(query) {
  while (!gl.getQueryParameter(query, gl.QUERY_RESULT_AVAILABLE)) await nextTurn();
  return Boolean(gl.getQueryParameter(query, gl.QUERY_RESULT));
}

// ---- the map's factors ----
export const factorsAreIn = isBlock ? "block" : "texture";
/** Hands the factors, as the host has packed them, to all programs. */
async function uploadFactors() {
  const values = new Float32Array((await unpacked(scene.factors)).buffer);
  if (isBlock) {
    gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, gl.createBuffer());
    gl.bufferData(gl.UNIFORM_BUFFER, values, gl.STATIC_DRAW);
  } else {
    const rows = Math.ceil(values.length / 1024), whole = new Float32Array(1024 * rows);
    whole.set(values);
    bind("factors", gl.TEXTURE_2D, texture(gl.RGBA32F, [256, rows]));
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, rows, gl.RGBA, gl.FLOAT, whole);
  }
}
if (groups > 0) await uploadFactors();
