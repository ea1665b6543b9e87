#!/usr/bin/python3
"""Formulas of `qjulia convert`: both compile by glslangValidator, with what stands for DE-Raytracer.frag and for
Shadertoy's uniforms; in headless Chromium they compute what `qjulia sample` does, and their distances are safe.
formula.py QJULIA MESH FOLDER [MAP WIDTHxHEIGHT]: with MAP, writes the picture of its formula for Shadertoy alone."""
import array
import json
import math
import pathlib
import random
import re
import shutil
import subprocess
import sys

import browser
from checks import check, fit_ball, folder, run, run_test

# What the formula asks of DE-Raytracer.frag, and what that file asks of the formula.
RAYTRACER = """
uniform float Detail, FudgeFactor;
uniform int MaxRaySteps;
vec4 orbitTrap = vec4(10000.0);
float DE(vec3 pos);
vec3 normal(vec3 pos, float normalDistance);
void main() { gl_FragColor = vec4(normal(vec3(DE(gl_FragCoord.xyz)), 0.01), Detail + orbitTrap.x); }
"""
SHADERTOY = """#version 300 es
precision highp float;
precision highp int;
uniform vec3 iResolution;
uniform float iTime;
uniform int iFrame;
uniform vec4 iMouse;
out vec4 result;
"""
DRAW = "\nvoid main() { mainImage(result, gl_FragCoord.xy); }\n"
# A pixel for a point: F_n, F_1 and the distance.
EVALUATE = """
uniform highp sampler2D points;
void main() {
  vec3 p = texelFetch(points, ivec2(gl_FragCoord.xy), 0).xyz;
  result = vec4(map_iterate(to_map(p), Iterations), map_iterate(to_map(p), 1), formula_distance(p), 1);
}
"""
SCRIPT = """(([shader, width, height, points]) => {
  const canvas = document.createElement("canvas"), gl = canvas.getContext("webgl2");
  canvas.width = width, canvas.height = height;
  gl.getExtension("EXT_color_buffer_float");
  const program = gl.createProgram();
  const corner = `#version 300 es
    void main() { gl_Position = vec4(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1, 0, 1); }`;
  for (const [type, text] of [[gl.VERTEX_SHADER, corner], [gl.FRAGMENT_SHADER, shader]]) {
    const one = gl.createShader(type);
    gl.shaderSource(one, text), gl.compileShader(one), gl.attachShader(program, one);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS))
    throw new Error(gl.getAttachedShaders(program).map((s) => gl.getShaderInfoLog(s)).join(" "));
  gl.useProgram(program);
  const texture = (values) => {
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    for (const which of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, which, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, values);
    return made;
  };
  const target = texture(null);
  if (points) texture(new Float32Array(points));
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
  gl.uniform3f(gl.getUniformLocation(program, "iResolution"), width, height, 1);
  gl.viewport(0, 0, width, height);
  gl.enable(gl.SCISSOR_TEST);
  const start = performance.now(), all = new Float32Array(4 * width * height);
  for (let y = 0; y < height; y += 16) {  // one long draw is taken for a GPU that hangs
    gl.scissor(0, y, width, 16);
    gl.drawArrays(gl.TRIANGLES, 0, 3), gl.finish();
  }
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, all);
  return { values: [...all], seconds: (performance.now() - start) / 1000 };
})"""


def drawn(tab, shader, width, height, points=None):
    return tab.run(f"{SCRIPT}({json.dumps([shader, width, height, points])})")


def constant(text, name):
    return float(re.search(rf"const \w+ {name} = (\S+);", text)[1])


def check_compiles(name, text, prelude, end):
    file = folder / (name + ".frag")
    file.write_text(prelude(text) + end)
    done = subprocess.run(["glslangValidator", str(file)], capture_output=True, text=True, check=False)
    check(done.returncode == 0, f"{name} compiles: {done.stdout if done.returncode else 'by glslangValidator'}")


def without_directives(text):
    """What Fragmentarium leaves of a .frag for the compiler."""
    text = re.sub(r"(?s)#preset.*?#endpreset", "", text)
    text = text.replace('#include "MathUtils.frag"', "").replace('#include "DE-Raytracer.frag"', RAYTRACER)
    text = re.sub(r"(?m)^#(info|group).*$", "", text)
    return re.sub(r"(?m)^(uniform [^;]*;) *slider.*$", r"\1", text)


def samples(name, text, cells, iterations):
    """Points of a grid in shape units, and F_n there."""
    escape = math.exp(constant(text, "map_log_escape"))
    box = json.loads((folder / name).read_text())["box"]
    run("sample", name, "-o", "field.npy", "--resolution", cells, "--box", *box[0], *box[1], "--iterations", iterations,
        "--escape", escape, "--device", "cpu", "--quiet")
    data = (folder / "field.npy").read_bytes()
    shape = [int(n) for n in re.search(rb"'shape': \((\d+), (\d+), (\d+)\)", data).groups()]
    field = array.array("f")
    field.frombytes(data[10 + int.from_bytes(data[8:10], "little"):])
    points = [[low + (high - low) * (i + 0.5) / n for low, high, i, n in zip(*box, at, shape)]
              for at in ((x, y, z) for x in range(shape[0]) for y in range(shape[1]) for z in range(shape[2]))]
    return points, list(field)


def to_picture(name, points):
    """From shape units to the picture's: the box centred, its longest side 2, the map's up axis upwards."""
    shape = json.loads((folder / name).read_text())
    box, up = shape["box"], shape["up"]
    upright = "xyz".index(up[-1])
    front = (upright + 1) % 3
    sign = -1 if up[0] == "-" else 1
    side = 3 - upright - front
    # Y x Z = X, and so on: side = up x front.
    side_sign = sign * (1 if (upright + 1) % 3 == front else -1)
    longest = max(high - low for low, high in zip(*box))
    middle = [(low + high) / 2 for low, high in zip(*box)]
    unit = [[2 * (p - m) / longest for p, m in zip(point, middle)] for point in points]
    return [[side_sign * p[side], sign * p[upright], p[front]] for p in unit]


def check_values(tab, name):
    """The formula's numbers against the program's own."""
    run("convert", name, name + ".glsl", "--device", "cpu", "--quiet")
    text = (folder / (name + ".glsl")).read_text()
    level, cells = constant(text, "map_surface_level"), 24
    points, field = samples(name, text, cells, 2)
    _, first = samples(name, text, cells, 1)
    seen = to_picture(name, points)
    width = 64
    height = -(-len(seen) // width)
    packed = [c for p in seen + [[0, 0, 0]] * (width * height - len(seen)) for c in (*p, 1)]
    text = text.replace("const int Iterations = 6;", "const int Iterations = 2;")
    got = drawn(tab, SHADERTOY + text + EVALUATE, width, height, packed)["values"]
    off = sorted(abs(got[4 * i + 1] - f) / (1 + abs(f)) for i, f in enumerate(first))
    check(off[-1] < 1e-4, f"{name}: F_1 of {len(off)} points is off by {off[-1]:.1e} at most")
    # Second iterates stretch rounding as they stretch distances.
    off = sorted(abs(got[4 * i] - f) / (1 + abs(f)) for i, f in enumerate(field))
    check(off[len(off) // 2] < 1e-5 and off[int(0.99 * len(off))] < 2e-3,
          f"{name}: F_2 is off by {off[len(off) // 2]:.1e} in the middle, {off[int(0.99 * len(off))]:.1e} at 99 %")
    inside = [i for i, f in enumerate(field) if f < level]
    wrong = sum((got[4 * i + 2] < 0) != (f < level) for i, f in enumerate(field))
    check(100 < len(inside) < len(field) - 100 and wrong <= 2e-3 * len(field),
          f"{name}: {wrong} of {len(field)} points are on the wrong side; {len(inside)} are inside")
    shot = random.Random(1).sample([i for i, f in enumerate(field) if f > level], 300)
    too_far = 0
    for i in shot:
        nearest = min(math.dist(seen[i], seen[j]) for j in inside)
        too_far += got[4 * i + 2] > 1.02 * nearest
    check(too_far == 0, f"{name}: {too_far} of {len(shot)} distances lead past a point inside")


def check_text(name):
    run("convert", name, name + ".frag", "--device", "cpu", "--quiet")
    check_compiles("fragmentarium", (folder / (name + ".frag")).read_text(), without_directives, "")
    check_compiles("shadertoy", (folder / (name + ".glsl")).read_text(), lambda text: SHADERTOY + text, DRAW)


def picture(tab, map_file, size):
    """Writes the formula's picture, as a .ppm."""
    width, height = map(int, size.split("x"))
    run("convert", pathlib.Path(map_file).resolve(), "picture.glsl", "--device", "cpu", "--quiet")
    text = (folder / "picture.glsl").read_text()
    done = drawn(tab, SHADERTOY + text + DRAW, width, height)
    values, rows = done["values"], []
    for y in reversed(range(height)):
        row = values[4 * width * y:4 * width * (y + 1)]
        rows.append(bytes(round(255 * min(max(v, 0), 1)) for i, v in enumerate(row) if i % 4 < 3))
    (folder / "picture.ppm").write_bytes(f"P6 {width} {height} 255\n".encode() + b"".join(rows))
    print(f"{done['seconds']:.1f} s: {folder / 'picture.ppm'}")


def test():
    with browser.Browser(400, 300) as tab:
        if len(sys.argv) > 4:
            picture(tab, *sys.argv[4:6])
            return
        check(shutil.which("glslangValidator") is not None, "glslangValidator is there (Debian's glslang-tools)")
        fit_ball()
        run("convert", "ball.qjulia.json", "turned.qjulia.json", "--phase", 0.8, 0.4, -0.3, 0.2, "--slice", 0.1,
            "--steepness", 3, "--drift", 0.3, "--up=-x", "--device", "cpu", "--quiet")
        for name in ("ball.qjulia.json", "turned.qjulia.json"):
            check_values(tab, name)
        check_text("turned.qjulia.json")


run_test(test)
