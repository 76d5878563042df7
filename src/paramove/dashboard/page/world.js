// The robot, the table and the objects at their estimated positions, drawn with WebGL. Draws only on request.
import { colourOf } from "./colours.js";
import { SHAPES, lookAt, moved, multiply, perspective, rigid, scaled } from "./shapes.js";

const VERTEX = `#version 300 es
uniform mat4 camera, place; uniform mat3 turn;
in vec3 position, normal; out vec3 at, facing;
void main() { vec4 world = place * vec4(position, 1.0); at = world.xyz; facing = turn * normal; gl_Position = camera * world; }`;
const FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 colour; uniform vec3 eye; uniform float lit;
in vec3 at, facing; out vec4 result;
void main() {
  if (lit < 0.5) { result = vec4(colour.rgb * colour.a, colour.a); return; }
  vec3 n = normalize(facing), v = normalize(eye - at), light = normalize(vec3(0.45, -0.5, 1.0)), fill = normalize(vec3(0.3, 0.9, 0.3));
  if (dot(n, v) < 0.0) n = -n;
  float shine = pow(max(dot(n, normalize(light + v)), 0.0), 40.0) * 0.22;
  float rim = pow(1.0 - max(dot(n, v), 0.0), 3.0) * 0.10;
  float bright = 0.36 + 0.10 * n.z + 0.52 * max(dot(n, light), 0.0) + 0.16 * max(dot(n, fill), 0.0);
  result = vec4((colour.rgb * bright + shine + rim) * colour.a, colour.a);
}`;
const LIGHT = [0.45, -0.5, 1.0];
const TABLE = [0.63, 0.6, 0.55], DEPTH = 0.105, SUNK = 0.044, ACCENT = [0.22, 0.74, 0.97];
const START = { turn: -0.5, tilt: 0.46, distance: 0.75 };

export class WorldView {
  constructor(canvas, labels) {
    this.canvas = canvas;
    this.labels = labels;
    this.view = { ...START };
    this.state = { world: null, robot: {}, objects: {}, goal: {}, plane: {} };
    this.drawn = 0;
    this.spans = new Map();
    this.gl = canvas.getContext("webgl2", { antialias: true, stencil: true, alpha: true });
    if (!this.gl) {
      const note = document.createElement("span");
      note.className = "failed";
      note.textContent = "This browser cannot draw in 3D (no WebGL 2).";
      labels.append(note);
      return;
    }
    this.prepare();
    this.listen();
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => { this.prepare(); this.draw(); });
    new ResizeObserver(() => this.draw()).observe(canvas);
  }

  update(state) {
    Object.assign(this.state, state);
  }

  prepare() {
    const gl = this.gl, program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source); gl.compileShader(shader); gl.attachShader(program, shader);
    }
    ["position", "normal"].forEach((name, index) => gl.bindAttribLocation(program, index, name));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`WebGL: ${gl.getProgramInfoLog(program)}`);
    gl.useProgram(program);
    this.uniforms = Object.fromEntries(["camera", "place", "turn", "colour", "eye", "lit"].map((name) => [name, gl.getUniformLocation(program, name)]));
    this.meshes = Object.fromEntries(Object.entries(SHAPES).map(([name, shape]) => {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      [shape.positions, shape.normals].forEach((values, index) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(values), gl.STATIC_DRAW);
        gl.enableVertexAttribArray(index);
        gl.vertexAttribPointer(index, 3, gl.FLOAT, false, 0, 0);
      });
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(shape.indices), gl.STATIC_DRAW);
      return [name, { array, count: shape.indices.length }];
    }));
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.clearColor(0, 0, 0, 0);
  }

  listen() {
    const { canvas, view } = this;
    let last = null;
    canvas.addEventListener("pointerdown", (event) => { last = [event.clientX, event.clientY]; canvas.setPointerCapture(event.pointerId); });
    canvas.addEventListener("pointerup", () => { last = null; });
    canvas.addEventListener("pointercancel", () => { last = null; });
    canvas.addEventListener("pointermove", (event) => {
      if (!last) return;
      view.turn -= (event.clientX - last[0]) * 0.008;
      view.tilt = Math.min(1.5, Math.max(-0.1, view.tilt + (event.clientY - last[1]) * 0.008));
      last = [event.clientX, event.clientY];
      this.draw();
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      view.distance = Math.min(2.5, Math.max(0.25, view.distance * Math.exp(event.deltaY * 0.001)));
      this.draw();
    }, { passive: false });
    canvas.addEventListener("dblclick", () => { Object.assign(view, START); this.draw(); });
  }

  draw() {
    const { gl, canvas, state, view } = this;
    if (!gl || !state.world || gl.isContextLost()) return;
    const ratio = Math.min(2, Math.max(1.5, window.devicePixelRatio || 1));
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    const [sx, sy, sz] = state.world.shoulder, { surface } = state.world;
    const middle = [sx + (surface.x[0] + surface.x[1]) / 2 - 0.06, sy + (surface.y[0] + surface.y[1]) / 2 + 0.045, sz + surface.z + 0.108];
    const eye = [
      middle[0] + view.distance * Math.cos(view.tilt) * Math.cos(view.turn),
      middle[1] + view.distance * Math.cos(view.tilt) * Math.sin(view.turn),
      middle[2] + view.distance * Math.sin(view.tilt),
    ];
    this.camera = multiply(perspective(0.62, width / height, 0.05, 6), lookAt(eye, middle));
    gl.viewport(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT | gl.STENCIL_BUFFER_BIT);
    gl.uniformMatrix4fv(this.uniforms.camera, false, this.camera);
    gl.uniform3fv(this.uniforms.eye, eye);
    const solids = [...this.robot(), ...this.objects()];
    this.table();
    this.shadows(solids, sz + surface.z);
    for (const solid of solids) this.solid(...solid);
    this.arc();
    this.names();
    this.drawn += 1;
  }

  solid(shape, place, colour, alpha = 1, lit = true) {
    const gl = this.gl, mesh = this.meshes[shape], t = [];
    for (let c = 0; c < 3; c++) {
      const column = place.subarray(4 * c, 4 * c + 3), square = column[0] ** 2 + column[1] ** 2 + column[2] ** 2 || 1;
      t.push(column[0] / square, column[1] / square, column[2] / square);
    }
    gl.uniformMatrix4fv(this.uniforms.place, false, place);
    gl.uniformMatrix3fv(this.uniforms.turn, false, t);
    gl.uniform4f(this.uniforms.colour, ...colour, alpha);
    gl.uniform1f(this.uniforms.lit, lit ? 1 : 0);
    gl.bindVertexArray(mesh.array);
    gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0);
  }

  robot() {
    const { world, robot } = this.state;
    if (!robot.poses) return [];
    const bodies = robot.poses.map((pose) => rigid(pose.slice(0, 3), pose.slice(3)));
    return world.parts.flatMap((part) => {
      const place = multiply(bodies[part.body], rigid(part.place, part.turn)), [a, b, c] = part.size;
      if (part.type === "capsule") {
        return [
          ["tube", multiply(place, scaled(a, a, b)), part.colour],
          ...[-b, b].map((z) => ["sphere", multiply(place, multiply(moved(0, 0, z), scaled(a, a, a))), part.colour]),
        ];
      }
      const sizes = { box: [a, b, c], ellipsoid: [a, b, c], sphere: [a, a, a], cylinder: [a, a, b] }[part.type];
      const shape = { box: "box", cylinder: "cylinder" }[part.type] ?? "sphere";
      return [[shape, multiply(place, scaled(...sizes)), part.colour]];
    });
  }

  // As it was seen, or as objects usually are.
  sizeOf(object) {
    const { radius, height } = this.state.world.object;
    return object.size ?? { width: 2 * radius, height, turn: null, length: 0 };
  }

  // Where an object is drawn: its middle, world frame; null where there is no estimate.
  placeOf(object) {
    const { world, robot } = this.state, [sx, sy, sz] = world.shoulder, z = sz + world.surface.z + this.sizeOf(object).height / 2;
    if (object.state === "in the robot's hand") return robot.gripper ?? null;
    if (!object.place) return null;
    return [sx + object.place[0], sy + object.place[1], object.state === "in an opening" ? z - SUNK : z];
  }

  objects() {
    return Object.entries(this.state.objects).flatMap(([name, object]) => {
      const place = this.placeOf(object), { width, height, turn, length } = this.sizeOf(object), half = (turn ?? 0) / 2;
      if (!place) return [];
      const tipped = length ? Math.PI / 4 : 0, [c, s] = [Math.cos(tipped), Math.sin(tipped)];
      const turned = rigid(place, [Math.cos(half) * c, -Math.sin(half) * s, Math.cos(half) * s, Math.sin(half) * c]);
      const solid = multiply(turned, scaled(width / 2, width / 2, (length || height) / 2));
      return [[turn === null || length ? "cylinder" : "box", solid, colourOf(name)]];
    });
  }

  table() {
    const { world, objects, plane } = this.state, [sx, sy, sz] = world.shoulder, { x, y, z } = world.surface, gl = this.gl;
    const box = [(x[1] - x[0]) / 2, (y[1] - y[0]) / 2, DEPTH / 2], top = sz + z;
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.ALWAYS, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.REPLACE);
    this.solid("box", multiply(moved(sx + x[0] + box[0], sy + y[0] + box[1], top - box[2]), scaled(...box)), TABLE);
    if (plane.corners?.length) {
      const xs = plane.corners.map((corner) => corner[2]), ys = plane.corners.map((corner) => corner[3]);
      const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)], line = 0.0009;
      for (const edge of [x0, x1]) this.flat(sx + edge, sy + (y0 + y1) / 2, top, line, (y1 - y0) / 2);
      for (const edge of [y0, y1]) this.flat(sx + (x0 + x1) / 2, sy + edge, top, (x1 - x0) / 2, line);
    }
    for (const [name, object] of Object.entries(objects)) {
      if (!object.rule) continue;
      const at = moved(sx + object.rule.place[0], sy + object.rule.place[1], top);
      this.solid("disc", multiply(at, multiply(moved(0, 0, 0.0006), scaled(0.014, 0.014, 1))), [0.07, 0.07, 0.07], 1, false);
      this.solid("ring", multiply(at, multiply(moved(0, 0, 0.0009), scaled(0.021, 0.021, 1))), colourOf(name), 1, false);
    }
    gl.disable(gl.STENCIL_TEST);
  }

  flat(x, y, z, halfX, halfY) {
    this.solid("box", multiply(moved(x, y, z), scaled(halfX, halfY, 0.0004)), ACCENT, 1, false);
  }

  // Everything cast along the light onto the table's top, each spot darkened once.
  shadows(solids, z) {
    const gl = this.gl, [lx, ly, lz] = LIGHT, up = z + 0.0014;
    const cast = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, -lx / lz, -ly / lz, 0, 0, (lx / lz) * z, (ly / lz) * z, up, 1]);
    gl.enable(gl.STENCIL_TEST);
    gl.stencilFunc(gl.EQUAL, 1, 255);
    gl.stencilOp(gl.KEEP, gl.KEEP, gl.INCR);
    gl.depthMask(false);
    for (const [shape, place] of solids) if (place[14] > z - 0.005) this.solid(shape, multiply(cast, place), [0, 0, 0], 0.34, false);
    gl.depthMask(true);
    gl.disable(gl.STENCIL_TEST);
  }

  // The present goal: a row of beads from its start to its end.
  arc() {
    const { goal, world } = this.state, [sx, sy, sz] = world.shoulder;
    if (!goal.from || !goal.to || goal.ended) return;
    for (let n = 0; n <= 14; n++) {
      const u = n / 14, [x, y, z] = [0, 1, 2].map((k) => goal.from[k] + u * (goal.to[k] - goal.from[k]));
      const size = n === 14 ? 0.0048 : 0.0026;
      this.solid("sphere", multiply(moved(sx + x, sy + y, sz + z + 0.03 + 0.16 * u * (1 - u)), scaled(size, size, size)), ACCENT, 1, false);
    }
  }

  names() {
    const shown = new Set(), { objects } = this.state, rect = this.canvas;
    const show = (key, text, [x, y, z]) => {
      const m = this.camera, [a, b, , w] = [0, 1, 2, 3].map((r) => m[r] * x + m[4 + r] * y + m[8 + r] * z + m[12 + r]);
      if (w <= 0) return;
      let span = this.spans.get(key);
      if (!span) { span = document.createElement("span"); this.labels.append(span); this.spans.set(key, span); }
      if (span.textContent !== text) span.textContent = text;
      const left = (0.5 + a / w / 2) * rect.clientWidth, top = (0.5 - b / w / 2) * rect.clientHeight;
      span.style.transform = `translate(${left.toFixed(1)}px, ${top.toFixed(1)}px) translate(-50%, -135%)`;
      shown.add(key);
    };
    for (const [name, object] of Object.entries(objects)) {
      const place = this.placeOf(object);
      if (place) show(name, name, [place[0], place[1], place[2] + this.sizeOf(object).height / 2]);
    }
    for (const [key, span] of this.spans) if (!shown.has(key)) { span.remove(); this.spans.delete(key); }
  }
}
