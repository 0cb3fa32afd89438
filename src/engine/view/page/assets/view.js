// The mesh in space: surfaces of triangles, turned with the mouse. WebGL 2 without any library.

const VERTEX = `#version 300 es
uniform mat4 turn;
uniform mat4 lens;
uniform float apart;
uniform sampler2D middles;
in vec4 place;  // position in the unit cube, then the sub-domain
in vec4 paint;  // color, then which edges are drawn
out vec3 where;
out vec3 seen;
out vec3 across;
flat out vec3 color;
flat out float drawn;
void main() {
  int n = int(place.w * 65535.0 + 0.5);
  vec4 away = texelFetch(middles, ivec2(n & 255, n >> 8), 0);
  vec4 at = turn * vec4(place.xyz + apart * away.xyz, 1.0);
  where = place.xyz;
  seen = at.xyz;
  int corner = gl_VertexID % 3;
  across = vec3(corner == 0, corner == 1, corner == 2);
  color = paint.rgb;
  drawn = paint.a * 255.0;
  // Hidden sub-domains are behind everything.
  gl_Position = away.w > 0.5 ? vec4(0.0, 0.0, 2.0, 1.0) : lens * at;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 plane;
uniform float lines;
uniform float flatness;
in vec3 where;
in vec3 seen;
in vec3 across;
flat in vec3 color;
flat in float drawn;
out vec4 result;
void main() {
  if (dot(where, plane.xyz) > plane.w) discard;
  vec3 normal = normalize(cross(dFdx(seen), dFdy(seen)));
  if (normal.z < 0.0) normal = -normal;
  float light = 0.50 + 0.34 * normal.z + 0.22 * max(0.0, dot(normal, vec3(-0.45, 0.65, 0.6)));
  vec3 lit = color * mix(light, 1.0, flatness);
  vec3 width = fwidth(across);
  int mask = int(drawn + 0.5);
  vec3 far = across / max(width, vec3(1e-6));
  float nearest = 1e9;
  if ((mask & 1) != 0) nearest = min(nearest, far.x);
  if ((mask & 2) != 0) nearest = min(nearest, far.y);
  if ((mask & 4) != 0) nearest = min(nearest, far.z);
  // Lines fade where triangles become as small as their lines.
  float size = max(width.x, max(width.y, width.z));
  float strength = lines * (1.0 - smoothstep(0.25, 1.05, nearest)) * (1.0 - smoothstep(0.20, 0.50, size));
  result = vec4(mix(lit, vec3(0.08, 0.1, 0.13), 0.6 * strength), 1.0);
}`;

const GRAY = [196, 202, 210];

class View {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("no WebGL 2");
    const { low, high } = data.scene;
    this.side = Math.max(high[0] - low[0], high[1] - low[1], high[2] - low[2]) || 1;
    this.extent = [0, 1, 2].map((k) => (high[k] - low[k]) / this.side);
    this.program = this.link();
    this.middles();
    this.surfaces = {};
  }

  link() {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.bindAttribLocation(program, 0, "place");
    gl.bindAttribLocation(program, 1, "paint");
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    this.at = {};
    for (const name of ["turn", "lens", "apart", "middles", "plane", "lines", "flatness"]) this.at[name] = gl.getUniformLocation(program, name);
    return program;
  }

  // Where each sub-domain goes when they are moved apart, and whether it is hidden: a texture in rows of 256.
  middles(hidden = new Set()) {
    const gl = this.gl, { low } = data.scene, list = data.subdomains;
    const rows = Math.max(1, Math.ceil(list.length / 256));
    const texels = new Float32Array(4 * 256 * rows);
    for (const s of list) {
      for (let k = 0; k < 3; k++) {
        const middle = (0.5 * (s.low[k] + s.high[k]) - low[k]) / this.side;
        texels[4 * s.id + k] = middle - this.extent[k] / 2;
      }
      texels[4 * s.id + 3] = hidden.has(s.id) ? 1 : 0;
    }
    this.texture = this.texture || gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 256, rows, 0, gl.RGBA, gl.FLOAT, texels);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
    gl.uniform1i(this.at.middles, 0);
  }

  // `ranks[i]` is the sub-domain triangle i moves with, `masks[i]` its drawn edges; `turned` has its corners the other way round.
  add(name, packed, ranks, masks, turned = false) {
    const gl = this.gl, n = packed.nTriangles;
    this.remove(name);
    const place = new Uint16Array(12 * n), paint = new Uint8Array(12 * n);
    for (let i = 0; i < n; i++) {
      for (let k = 0; k < 3; k++) {
        const corner = packed.corners[3 * i + (turned ? 2 - k : k)], at = 4 * (3 * i + k);
        for (let axis = 0; axis < 3; axis++) place[at + axis] = packed.points[3 * corner + axis];
        place[at + 3] = ranks[i];
        paint[at + 3] = masks ? masks[i] : 7;
      }
    }
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const places = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, places);
    gl.bufferData(gl.ARRAY_BUFFER, place, gl.STATIC_DRAW);
    gl.vertexAttribPointer(0, 4, gl.UNSIGNED_SHORT, true, 0, 0);
    gl.enableVertexAttribArray(0);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, paint, gl.DYNAMIC_DRAW);
    gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 0, 0);
    gl.enableVertexAttribArray(1);
    this.surfaces[name] = { array, places, buffer, paint, n };
  }

  remove(name) {
    const old = this.surfaces[name], gl = this.gl;
    if (!old) return;
    gl.deleteVertexArray(old.array);
    gl.deleteBuffer(old.places);
    gl.deleteBuffer(old.buffer);
    delete this.surfaces[name];
  }

  color(name, colorOf) {
    const { buffer, paint, n } = this.surfaces[name], gl = this.gl;
    for (let i = 0; i < n; i++) {
      const [r, g, b] = colorOf(i);
      for (let at = 12 * i; at < 12 * i + 12; at += 4) {
        paint[at] = r;
        paint[at + 1] = g;
        paint[at + 2] = b;
      }
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, paint, gl.DYNAMIC_DRAW);
  }

  // The first view: looking at a cut across `axis`, with what is left of the box as large as can be.
  home(axis = null, clip = null) {
    [this.yaw, this.pitch] = axis === null ? [0.55, 0.42] : [[0.95, 0.35], [0.45, 0.4], [0.4, 0.95]][axis];
    this.zoom = 1;
    this.shift = [0, 0];
    const ends = this.extent.map((e) => [0, e]);
    if (clip && axis !== null) ends[axis][clip[axis] > 0 ? 1 : 0] = clip[3] / clip[axis];
    this.middle = ends.map(([from, to]) => (from + to) / 2);
    for (let step = 0; step < 4; step++) {
      const { turn, lens, distance } = this.look(0);
      let [left, right, foot, top] = [Infinity, -Infinity, Infinity, -Infinity];
      for (let k = 0; k < 8; k++) {
        const p = [0, 1, 2].map((axis) => ends[axis][(k >> axis) & 1]);
        const at = [0, 1, 2].map((row) => turn[row] * p[0] + turn[4 + row] * p[1] + turn[8 + row] * p[2] + turn[12 + row]);
        const [x, y] = [(lens[0] * at[0]) / -at[2], (lens[5] * at[1]) / -at[2]];
        [left, right, foot, top] = [Math.min(left, x), Math.max(right, x), Math.min(foot, y), Math.max(top, y)];
      }
      this.shift[0] -= ((left + right) / 2 / lens[0]) * distance;
      this.shift[1] -= ((foot + top) / 2 / lens[5]) * distance;
      this.zoom *= 1.8 / Math.max(right - left, top - foot);
    }
  }

  // Where things are seen: positions before the viewer, then on the screen.
  look(apart) {
    const radius = 0.5 * Math.hypot(...this.extent) * (1 + 0.8 * apart);
    const opening = 0.5, distance = radius / Math.sin(opening / 2) / this.zoom;
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    // Rows: right, up, towards the viewer; z is up.
    const right = [cy, sy, 0], up = [-sp * sy, sp * cy, cp], back = [sy * cp, -cy * cp, sp];
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const turn = new Float32Array([
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, this.middle) + this.shift[0], -dot(up, this.middle) + this.shift[1], -dot(back, this.middle) - distance, 1,
    ]);
    const near = Math.max(distance - 1.2 * radius, distance * 0.02), far = distance + 1.2 * radius;
    const aspect = (this.canvas.clientWidth || 1) / (this.canvas.clientHeight || 1);
    const f = Math.min(aspect, 1) / Math.tan(opening / 2);
    const lens = new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, (2 * far * near) / (near - far), 0]);
    return { turn, lens, distance };
  }

  // The ray behind a place on the canvas: from the viewer, in shares of the longest side of the box.
  ray(x, y) {
    const { turn, lens } = this.look(0), { clientWidth, clientHeight } = this.canvas;
    const [right, up, back] = [0, 1, 2].map((row) => [turn[row], turn[4 + row], turn[8 + row]]);
    const [a, b] = [(2 * x / clientWidth - 1) / lens[0], (1 - 2 * y / clientHeight) / lens[5]];
    const across = (p, q, r) => [0, 1, 2].map((k) => p * right[k] + q * up[k] + r * back[k]);
    return [across(-turn[12], -turn[13], -turn[14]), across(a, b, -1)];
  }

  draw(scene) {
    const gl = this.gl, canvas = this.canvas;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const [width, height] = [Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio)];
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const { turn, lens } = this.look(scene.apart);
    gl.uniformMatrix4fv(this.at.turn, false, turn);
    gl.uniformMatrix4fv(this.at.lens, false, lens);
    gl.uniform1f(this.at.apart, 1.2 * scene.apart);
    gl.uniform1f(this.at.lines, scene.edges ? 1 : 0);
    for (const { name, clip, flat, cull, over } of scene.shown) {
      const surface = this.surfaces[name];
      if (!surface) continue;
      gl.uniform4f(this.at.plane, ...(clip || [0, 0, 0, 1]));
      gl.uniform1f(this.at.flatness, flat ? 0.75 : 0);
      gl.depthFunc(over ? gl.LEQUAL : gl.LESS);
      cull ? gl.enable(gl.CULL_FACE) : gl.disable(gl.CULL_FACE);
      gl.bindVertexArray(surface.array);
      gl.drawArrays(gl.TRIANGLES, 0, 3 * surface.n);
    }
  }
}
