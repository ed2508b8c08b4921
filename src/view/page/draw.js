// Triangles by WebGL 2. One canvas that is not shown draws every picture, which is then copied.

const VERTEX = `#version 300 es
in vec3 place;
in vec3 normal;
in float value;
uniform mat4 matrix;
out vec3 at;
out vec3 facing;
out vec3 corner;
out float level;
void main() {
  int k = gl_VertexID % 3;
  corner = vec3(k == 0, k == 1, k == 2);
  at = place;
  facing = normal;
  level = value;
  gl_Position = matrix * vec4(place, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at;
in vec3 facing;
in vec3 corner;
in float level;
uniform sampler2D colours;
uniform vec3 eye;
uniform vec3 grey;
uniform vec4 clip;
uniform float light;
uniform float edges;
out vec4 colour;
void main() {
  if (dot(clip.xyz, at) > clip.w) discard;
  vec3 base = level < -0.25 ? grey : texture(colours, vec2((clamp(level, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb;
  float shade = mix(1.0, 0.5 + 0.55 * abs(dot(normalize(facing), eye)), light);
  vec3 width = fwidth(corner);
  vec3 near = smoothstep(vec3(0.0), 1.2 * width, corner);
  float line = 1.0 - min(min(near.x, near.y), near.z);
  colour = vec4(mix(base * shade, vec3(0.08), 0.75 * line * edges), 1.0);
}`;

function compiled(gl) {
  const program = gl.createProgram();
  [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]].forEach(([kind, text]) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return program;
}

/** Numbers per corner: position, normal, level. */
const STRIDE = 7;

class Painter {
  constructor() {
    this.canvas = document.createElement("canvas");
    const gl = this.canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("This browser offers no WebGL 2, which draws the sheet.");
    this.gl = gl;
    this.program = compiled(gl);
    gl.useProgram(this.program);
    gl.enable(gl.DEPTH_TEST);
    gl.clearColor(1, 1, 1, 1);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER].forEach(f => gl.texParameteri(gl.TEXTURE_2D, f, gl.LINEAR));
    [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T].forEach(w => gl.texParameteri(gl.TEXTURE_2D, w, gl.CLAMP_TO_EDGE));
  }

  /** Sets the 256 colours. */
  paint(map) {
    const gl = this.gl;
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, map);
  }

  /** A buffer for the corners of one sheet. */
  sheet() {
    const gl = this.gl;
    const array = gl.createVertexArray();
    const buffer = gl.createBuffer();
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    [["place", 3, 0], ["normal", 3, 3], ["value", 1, 6]].forEach(([name, size, from]) => {
      const place = gl.getAttribLocation(this.program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * STRIDE, 4 * from);
    });
    return { array, buffer, corners: 0 };
  }

  /** Fills it. */
  load(sheet, corners) {
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, sheet.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, corners, gl.DYNAMIC_DRAW);
    sheet.corners = corners.length / STRIDE;
  }

  /** Draws it on a canvas. */
  draw(sheet, target, { matrix, eye, clip, light, edges }) {
    const gl = this.gl;
    const [width, height] = [target.width, target.height];
    if (this.canvas.width !== width || this.canvas.height !== height) {
      [this.canvas.width, this.canvas.height] = [width, height];
    }
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const uniform = name => gl.getUniformLocation(this.program, name);
    gl.uniformMatrix4fv(uniform("matrix"), false, matrix);
    gl.uniform3fv(uniform("eye"), eye);
    gl.uniform3fv(uniform("grey"), GREY.map(c => c / 255));
    gl.uniform4fv(uniform("clip"), clip);
    gl.uniform1f(uniform("light"), light ? 1 : 0);
    gl.uniform1f(uniform("edges"), edges ? 1 : 0);
    gl.bindVertexArray(sheet.array);
    gl.drawArrays(gl.TRIANGLES, 0, sheet.corners);
    const context = target.getContext("2d");
    context.drawImage(this.canvas, 0, 0);
    return context;
  }
}

/** Unit normals of vertices, weighted by area. */
function normals(x, triangles) {
  const out = new Float64Array(x.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const [ux, uy, uz] = [x[b] - x[a], x[b + 1] - x[a + 1], x[b + 2] - x[a + 2]];
    const [vx, vy, vz] = [x[c] - x[a], x[c + 1] - x[a + 1], x[c + 2] - x[a + 2]];
    const [nx, ny, nz] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const v of [a, b, c]) {
      out[v] += nx;
      out[v + 1] += ny;
      out[v + 2] += nz;
    }
  }
  for (let i = 0; i < out.length; i += 3) {
    const size = Math.hypot(out[i], out[i + 1], out[i + 2]) || 1;
    for (let k = i; k < i + 3; k += 1) out[k] /= size;
  }
  return out;
}

/** The corners of all triangles with finite positions, as the painter takes them. */
function cornersOf(x, triangles, values, onTriangles, [least, largest]) {
  const n = normals(x, triangles);
  const out = new Float32Array(STRIDE * triangles.length);
  const width = largest > least ? largest - least : 1;
  const level = value => (Number.isFinite(value) ? (largest > least ? Math.max(0, Math.min(1, (value - least) / width)) : 0.5) : -1e3);
  let at = 0;
  for (let k = 0; k < triangles.length; k += 1) {
    const v = triangles[k];
    for (let i = 3 * v; i < 3 * v + 3; i += 1) out[at++] = x[i];
    for (let i = 3 * v; i < 3 * v + 3; i += 1) out[at++] = n[i];
    out[at++] = values ? level(values[onTriangles ? Math.floor(k / 3) : v]) : -1e3;
  }
  return out;
}
