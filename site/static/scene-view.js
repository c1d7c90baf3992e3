// A scene in three dimensions, moving: what the replay of a recorded night and the live engine share.
// A movie is { step [s], count, bodies, solids, links, gravity, attractors, position, orientation, ... } with
// flat arrays over samples; see replay.js, which decodes one, and live.js, which computes one.
"use strict";

const WORLD_BODY = -1;
const MOST_ARROWS = 400;
const DOUBLE_SIDE = 2, WIDEST_CONE = 3;  // three.js' name for both sides of a surface; mu from which a cone is drawn no wider
const SLIDES = 0.999;  // share of the friction bound from which a point is shown as sliding

// --- arithmetic on flat arrays: no object is made while a scene moves ---
function turnInto(out, q, x, y, z) {
  const [w, a, b, c] = q;
  const tx = 2 * (b * z - c * y), ty = 2 * (c * x - a * z), tz = 2 * (a * y - b * x);
  out[0] = x + w * tx + b * tz - c * ty;
  out[1] = y + w * ty + c * tx - a * tz;
  out[2] = z + w * tz + a * ty - b * tx;
}

function product(p, q) {
  const [a, b, c, d] = p, [w, x, y, z] = q;
  return [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w];
}

// Column-major matrix of a unit quaternion, scaled and placed, written at `at`.
function placeInto(out, at, p, q, sx, sy, sz) {
  const [w, x, y, z] = q;
  out[at] = sx * (1 - 2 * (y * y + z * z)); out[at + 1] = sx * 2 * (x * y + w * z); out[at + 2] = sx * 2 * (x * z - w * y); out[at + 3] = 0;
  out[at + 4] = sy * 2 * (x * y - w * z); out[at + 5] = sy * (1 - 2 * (x * x + z * z)); out[at + 6] = sy * 2 * (y * z + w * x); out[at + 7] = 0;
  out[at + 8] = sz * 2 * (x * z + w * y); out[at + 9] = sz * 2 * (y * z - w * x); out[at + 10] = sz * (1 - 2 * (x * x + y * y)); out[at + 11] = 0;
  out[at + 12] = p[0]; out[at + 13] = p[1]; out[at + 14] = p[2]; out[at + 15] = 1;
}

// The shortest turn of the z-axis onto a direction of the given length.
function aim(dx, dy, dz, length) {
  const w = 1 + dz / length;
  if (w < 1e-9) { return [0, 1, 0, 0]; }
  const n = Math.hypot(w, dx / length, dy / length);
  return [w / n, -dy / length / n, dx / length / n, 0];
}

// --- where bodies are at a sample, which may lie between two ---
class Poses {
  constructor(movie, position, orientation) {
    Object.assign(this, { movie, position, orientation, p: [0, 0, 0], q: [1, 0, 0, 0] });
  }

  at(body, sample) {
    if (body === WORLD_BODY) { this.p = [0, 0, 0]; this.q = [1, 0, 0, 0]; return; }
    const n = this.movie.bodies, low = Math.floor(sample), high = Math.min(low + 1, this.movie.count - 1), share = sample - low;
    const i = 3 * (low * n + body), j = 3 * (high * n + body), v = this.position;
    for (let k = 0; k < 3; k += 1) { this.p[k] = v[i + k] + (share ? share * (v[j + k] - v[i + k]) : 0); }
    if (!this.orientation) { this.q[0] = 1; this.q[1] = this.q[2] = this.q[3] = 0; return; }
    const a = 4 * (low * n + body), b = 4 * (high * n + body), o = this.orientation;
    let dot = 0, size = 0;
    for (let k = 0; k < 4; k += 1) { dot += o[a + k] * o[b + k]; }
    for (let k = 0; k < 4; k += 1) {
      this.q[k] = (1 - share) * o[a + k] + share * (dot < 0 ? -1 : 1) * o[b + k];
      size += this.q[k] * this.q[k];
    }
    size = Math.sqrt(size) || 1;
    for (let k = 0; k < 4; k += 1) { this.q[k] /= size; }
  }
}

// Solids of one shape as flat arrays, so that ten thousand are placed in a few milliseconds.
function packed(items) {
  const n = items.length, solids = { body: new Int32Array(n), offset: new Float64Array(3 * n), turn: new Float64Array(4 * n), scale: new Float64Array(3 * n) };
  items.forEach((item, i) => {
    solids.body[i] = item.body;
    solids.offset.set(item.offset, 3 * i);
    solids.turn.set(item.turn, 4 * i);
    solids.scale.set(item.scale, 3 * i);
  });
  return solids;
}

// The matrix of each solid at a sample: that of its body, and the solid's place and turn in it. What Poses.at and
// placeInto do for one, in one loop that makes nothing.
function placeAll(out, poses, solids, sample) {
  const { movie, position: v, orientation: o } = poses, { body, offset, turn, scale } = solids, n = movie.bodies;
  const low = Math.floor(sample), share = sample - low, high = share ? Math.min(low + 1, movie.count - 1) : low;
  for (let i = 0, at = 0; i < body.length; i += 1, at += 16) {
    const b = body[i], sx = scale[3 * i], sy = scale[3 * i + 1], sz = scale[3 * i + 2];
    let px = 0, py = 0, pz = 0, w = 1, x = 0, y = 0, z = 0;
    if (b !== WORLD_BODY) {
      const j = 3 * (low * n + b), k = 3 * (high * n + b);
      px = v[j]; py = v[j + 1]; pz = v[j + 2];
      if (share) { px += share * (v[k] - px); py += share * (v[k + 1] - py); pz += share * (v[k + 2] - pz); }
      if (o) {
        const a = 4 * (low * n + b), c = 4 * (high * n + b);
        w = o[a]; x = o[a + 1]; y = o[a + 2]; z = o[a + 3];
        if (share) {
          const near = w * o[c] + x * o[c + 1] + y * o[c + 2] + z * o[c + 3] < 0 ? -share : share, rest = 1 - share;
          w = rest * w + near * o[c]; x = rest * x + near * o[c + 1]; y = rest * y + near * o[c + 2]; z = rest * z + near * o[c + 3];
        }
        const size = Math.sqrt(w * w + x * x + y * y + z * z) || 1;
        w /= size; x /= size; y /= size; z /= size;
      }
    }
    const ox = offset[3 * i], oy = offset[3 * i + 1], oz = offset[3 * i + 2];
    if (ox || oy || oz) {
      const tx = 2 * (y * oz - z * oy), ty = 2 * (z * ox - x * oz), tz = 2 * (x * oy - y * ox);
      px += ox + w * tx + y * tz - z * ty; py += oy + w * ty + z * tx - x * tz; pz += oz + w * tz + x * ty - y * tx;
    }
    const tw = turn[4 * i];
    if (tw !== 1) {
      const tx = turn[4 * i + 1], ty = turn[4 * i + 2], tz = turn[4 * i + 3], bw = w, bx = x, by = y, bz = z;
      w = bw * tw - bx * tx - by * ty - bz * tz; x = bw * tx + bx * tw + by * tz - bz * ty;
      y = bw * ty - bx * tz + by * tw + bz * tx; z = bw * tz + bx * ty - by * tx + bz * tw;
    }
    const xx = 2 * x * x, yy = 2 * y * y, zz = 2 * z * z, xy = 2 * x * y, xz = 2 * x * z, yz = 2 * y * z, wx = 2 * w * x, wy = 2 * w * y, wz = 2 * w * z;
    out[at] = sx * (1 - yy - zz); out[at + 1] = sx * (xy + wz); out[at + 2] = sx * (xz - wy); out[at + 3] = 0;
    out[at + 4] = sy * (xy - wz); out[at + 5] = sy * (1 - xx - zz); out[at + 6] = sy * (yz + wx); out[at + 7] = 0;
    out[at + 8] = sz * (xz + wy); out[at + 9] = sz * (yz - wx); out[at + 10] = sz * (1 - xx - yy); out[at + 11] = 0;
    out[at + 12] = px; out[at + 13] = py; out[at + 14] = pz; out[at + 15] = 1;
  }
}

// The largest of 1, 2 and 5 times a power of ten that is not above `most`.
function roundLength(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  return power * ([5, 2, 1].find((n) => n * power <= most * (1 + 1e-12)) || 1);
}

function lengthWords(metres) {
  const [unit, size] = metres >= 1e6 || metres < 1e-3 ? ["m", 1] : metres >= 1e3 ? ["km", 1e3] : metres >= 0.1 ? ["m", 1] : ["mm", 1e-3];
  return `${Number((metres / size).toPrecision(3))} ${unit}`.replace("e+", "e").replace("-", "−");
}

// The length of a bar and the axes of the world, in the lower corners of the picture.
const AXIS = 26, BAR = 0.2;  // px; share of the picture's width
class Marks {
  constructor(host) {
    const drawn = (tag, attributes) => {
      const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
      for (const [name, value] of Object.entries(attributes)) { element.setAttribute(name, value); }
      return element;
    };
    this.svg = drawn("svg", { class: "scene-marks", "aria-hidden": "true" });
    this.bar = drawn("path", {});
    this.length = drawn("text", { class: "length" });
    this.axes = [..."xyz"].map((letter) => {
      const axis = { line: drawn("path", {}), letter: drawn("text", { class: "axis" }) };
      axis.letter.textContent = letter;
      return axis;
    });
    this.svg.append(this.bar, this.length, ...this.axes.flatMap((axis) => [axis.line, axis.letter]));
    host.append(this.svg);
  }

  // `right` and `up` are the camera's axes, `scale` the pixels of a metre in the middle of the scene.
  show(wide, high, right, up, scale) {
    const metres = roundLength((BAR * wide) / scale), end = 14 + metres * scale;
    this.metres = metres;
    this.bar.setAttribute("d", `M14 ${high - 18}v8h${(metres * scale).toFixed(1)}v-8`);
    this.length.textContent = lengthWords(metres);
    this.length.setAttribute("x", ((14 + end) / 2).toFixed(1));
    this.length.setAttribute("y", String(high - 16));
    const x = wide - AXIS - 20, y = high - AXIS - 20;
    this.axes.forEach((axis, k) => {
      const dx = AXIS * right[k], dy = -AXIS * up[k], long = Math.hypot(dx, dy), away = long > 3 ? (long + 9) / long : 0;
      axis.line.setAttribute("d", `M${x} ${y}l${dx.toFixed(1)} ${dy.toFixed(1)}`);
      const aside = long < AXIS / 2 ? Math.max(9, Math.abs(away * dx)) : Math.abs(away * dx);  // clear of one that stands upright
      axis.letter.setAttribute("x", (x + Math.sign(dx) * aside).toFixed(1));
      axis.letter.setAttribute("y", (y + away * dy + 4).toFixed(1));
    });
  }

  close() { this.svg.remove(); }
}

const TURN = Math.PI / 18, NEARER = 1.15;  // of one press of a key: rad; ratio of distances

// Of facets: the corners of each face, three numbers each.
function facesOf(size) {
  const faces = [];
  for (let start = 0; start < size.length;) {
    const end = start + 1 + 3 * size[start], face = [];
    for (let i = start + 1; i < end; i += 3) { face.push(size.slice(i, i + 3)); }
    faces.push(face);
    start = end;
  }
  return faces;
}

function extentOf(movie) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const see = (x, y, z, r) => [x, y, z].forEach((v, k) => {
    if (Math.abs(v) < 1e6) { low[k] = Math.min(low[k], v - r); high[k] = Math.max(high[k], v + r); }
  });
  const reach = new Float64Array(movie.bodies), drawn = new Uint8Array(movie.bodies);
  for (const solid of movie.solids) {
    if (solid.kind === "plane") { continue; }
    if (solid.kind === "facets" && solid.fixed) {  // a ground is as far as it reaches, and flat
      const corner = [0, 0, 0];
      for (const p of facesOf(solid.size).flat()) {
        turnInto(corner, solid.orientation, ...p);
        see(...corner.map((v, k) => v + solid.position[k]), 0);
      }
      continue;
    }
    const r = solid.kind === "box" ? Math.hypot(...solid.size) / 2 : solid.kind === "capsule" ? solid.size[0] + solid.size[1] / 2 :
      solid.kind === "facets" ? Math.max(...facesOf(solid.size).flat().map((p) => Math.hypot(...p))) : solid.size[0] || 0;
    if (solid.body === WORLD_BODY) { see(...solid.position, r); } else { reach[solid.body] = Math.max(reach[solid.body], r); drawn[solid.body] = 1; }
  }
  const stride = Math.max(1, Math.floor(movie.count * movie.bodies / 60000));
  for (let sample = 0; sample < movie.count; sample += stride) {
    for (let body = 0; body < movie.bodies; body += 1) {
      if (!drawn[body]) { continue; }
      const i = 3 * (sample * movie.bodies + body);
      see(movie.position[i], movie.position[i + 1], movie.position[i + 2], reach[body]);
    }
  }
  for (const link of movie.links) {
    link.bodies.forEach((body, end) => { if (body === WORLD_BODY) { see(...link.anchors[end], 0); } });
  }
  for (const centre of movie.attractors) { see(...centre, 0); }
  return low[0] <= high[0] ? { low, high } : { low: [-1, -1, -1], high: [1, 1, 1] };
}

class SceneView {
  // `host` is an empty element; throws where the browser has no WebGL.
  constructor(host, movie) {
    this.host = host;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    this.renderer.setPixelRatio(Math.min(devicePixelRatio || 1, 2));
    this.canvas = this.renderer.domElement;
    host.append(this.canvas);
    this.marks = new Marks(host);
    this.canvas.tabIndex = 0;
    this.canvas.addEventListener("keydown", (event) => { if (this.turnBy(event.key)) { event.preventDefault(); } });
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 1000);
    this.camera.up.set(0, 0, 1);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x8899aa, 1.7));
    const sun = new THREE.DirectionalLight(0xffffff, 1.9);
    sun.position.set(0.4, -0.7, 1);
    this.scene.add(sun);
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.enableZoom = false;  // the wheel scrolls the page
    this.controls.addEventListener("change", () => this.draw());
    this.watch = new ResizeObserver(() => this.resize());
    this.watch.observe(host);
    this.shown = { ghost: true, forces: true, cones: true };
    this.sample = 0;
    this.load(movie);
  }

  // Another movie in the same view; the camera stays unless the scene has another extent.
  load(movie, keepCamera = false) {
    this.movie = movie;
    this.poses = new Poses(movie, movie.position, movie.orientation);
    this.ghost = movie.ghost ? new Poses(movie, movie.ghost.position, movie.ghost.orientation) : null;
    if (this.world) { this.scene.remove(this.world); this.world.traverse((part) => { part.geometry?.dispose(); part.material?.dispose(); part.dispose?.(); }); }
    this.world = new THREE.Group();
    this.scene.add(this.world);
    const { low, high } = extentOf(movie);
    this.middle = low.map((v, k) => (v + high[k]) / 2);
    this.size = Math.max(...high.map((v, k) => v - low[k])) || 1;
    this.dot = 0.018 * this.size;
    this.build();
    if (!keepCamera) { this.home(low, high); }
    this.resize();
    this.paint();
  }

  home(low, high) {
    const extent = high.map((v, k) => v - low[k]);
    const flat = extent[2] < 0.2 * Math.max(extent[0], extent[1]) && !this.movie.gravity.some(Boolean);
    const turn = (extent[0] < 0.5 * extent[1] ? Math.PI / 2 : 0) + 0.35, above = flat ? 0.95 : 0.26;
    const radius = Math.hypot(...extent) / 2 || this.size;
    this.fit = { extent, direction: [Math.sin(turn) * Math.cos(above), -Math.cos(turn) * Math.cos(above), Math.sin(above)] };
    this.controls.target.set(...this.middle);
    this.camera.near = radius / 100;
    this.camera.far = radius * 60;
    this.frame();
  }

  frame() {
    // Far enough away that every corner of the scene's box is seen.
    const [dx, dy, dz] = this.fit.direction, tangent = Math.tan((this.camera.fov * Math.PI) / 360) * 0.92;
    const flat = Math.hypot(dx, dy), right = [-dy / flat, dx / flat, 0], up = [-dz * right[1], dz * right[0], flat];
    let far = 0.05 * this.size;
    for (let corner = 0; corner < 8; corner += 1) {
      const c = this.fit.extent.map((e, k) => ((corner >> k) & 1 ? 0.5 : -0.5) * e + (e === 0 ? 0.02 * this.size : 0));
      const along = (v) => c[0] * v[0] + c[1] * v[1] + c[2] * v[2], near = along(this.fit.direction) + this.dot;
      far = Math.max(far, (Math.abs(along(right)) + 2 * this.dot) / (tangent * this.camera.aspect) + near, (Math.abs(along(up)) + 2 * this.dot) / tangent + near);
    }
    this.camera.position.set(...this.middle.map((v, k) => v + far * this.fit.direction[k]));
    this.camera.updateProjectionMatrix();
    this.controls.update();
  }

  mesh(geometry, count, options = {}) {
    const material = new THREE.MeshLambertMaterial(options);
    const mesh = new THREE.InstancedMesh(geometry, material, Math.max(1, count));
    mesh.count = count;
    mesh.frustumCulled = false;
    mesh.instanceMatrix.setUsage(THREE.DynamicDrawUsage);
    this.world.add(mesh);
    return mesh;
  }

  build() {
    const kinds = new Map();
    const start = new Poses(this.movie, this.movie.position, this.movie.orientation);
    for (const solid of this.movie.solids) {
      if (solid.kind === "plane") { this.floor(solid); continue; }
      const key = (solid.kind === "particle" ? "sphere" : ["capsule", "facets"].includes(solid.kind) ? `${solid.kind} ${solid.size}` : solid.kind) + (solid.fixed ? " fixed" : "");
      if (!kinds.has(key)) { kinds.set(key, []); }
      // The solid in the axes of its body: a compound has several that move as one.
      start.at(solid.body, 0);
      const away = [start.q[0], -start.q[1], -start.q[2], -start.q[3]], offset = [0, 0, 0];
      turnInto(offset, away, ...solid.position.map((v, k) => v - start.p[k]));
      const turn = product(away, solid.orientation), r = solid.size[0];
      const scale = solid.kind === "particle" ? [this.dot, this.dot, this.dot] : solid.kind === "sphere" ? [r, r, r] : solid.kind === "box" ? solid.size : [1, 1, 1];
      kinds.get(key).push({ body: solid.body, offset, turn, scale });
    }
    this.solids = [];
    for (const [key, items] of kinds) {
      const detail = items.length > 4000 ? [7, 5] : items.length > 800 ? [10, 6] : [28, 18];
      const shape = key.split(" ")[0], fixed = key.endsWith("fixed");
      const geometry = () => shape === "facets" ? this.facets(key.split(" ")[1].split(",").map(Number)) : shape === "sphere" ? new THREE.SphereGeometry(1, ...detail) : shape === "box" ? new THREE.BoxGeometry(1, 1, 1) :
        new THREE.CapsuleGeometry(...key.split(" ")[1].split(",").map(Number), 6, 16).rotateX(Math.PI / 2);
      const solids = packed(items);
      this.solids.push({ mesh: this.mesh(geometry(), items.length), solids, poses: this.poses, colour: fixed ? "--ink-3" : "--c0" });
      if (this.ghost && !fixed) {
        const mesh = this.mesh(geometry(), items.length, { transparent: true, opacity: 0.36, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4 });
        this.solids.push({ mesh, solids, poses: this.ghost, colour: "--c1", ghost: true });
      }
    }
    const rods = this.movie.links.filter((link) => link.kind !== "joint"), joints = this.movie.links.filter((link) => link.kind === "joint");
    const rod = new THREE.CylinderGeometry(1, 1, 1, 8).rotateX(Math.PI / 2);
    this.rods = rods.length ? { mesh: this.mesh(rod, rods.length), links: rods } : null;
    this.joints = joints.length && joints.length <= 60 ? { mesh: this.mesh(new THREE.SphereGeometry(1, 12, 8), joints.length, { depthTest: false }), links: joints } : null;
    for (const part of [this.rods, this.joints]) {
      if (part) { part.mesh.setColorAt(0, new THREE.Color(1, 1, 1)); part.mesh.renderOrder = part === this.joints ? 3 : 0; }
    }
    if (this.movie.contact) {
      const tip = new THREE.ConeGeometry(1, 1, 12).rotateX(Math.PI / 2);
      this.arrows = { shaft: this.mesh(rod.clone(), MOST_ARROWS), tip: this.mesh(tip, MOST_ARROWS), largest: this.usualForce() };
    } else { this.arrows = null; }
    this.cones = this.movie.cones ? this.buildCones(rod) : null;
    for (const centre of this.movie.attractors) {
      const star = new THREE.Mesh(new THREE.SphereGeometry(2 * this.dot, 24, 16), new THREE.MeshLambertMaterial());
      star.position.set(...centre);
      star.userData.colour = "--watch-fill";
      this.world.add(star);
    }
    this.violationScale = (this.movie.violation || []).reduce((a, v) => Math.max(a, Math.abs(v) || 0), 0);
  }

  // One cone and one arrow for each contact point: the apex at the point, as wide as friction lets a force lean.
  buildCones(rod) {
    const width = this.movie.cones.friction.length / this.movie.count;
    const cone = new THREE.ConeGeometry(1, 1, 28, 1, true).rotateX(-Math.PI / 2);  // opens along z
    const mesh = this.mesh(cone, width, { transparent: true, opacity: 0.4, depthWrite: false, side: DOUBLE_SIDE });
    mesh.setColorAt(0, new THREE.Color(1, 1, 1));
    mesh.renderOrder = 2;
    const { force } = this.movie.cones, sizes = [];
    for (let i = 0; i < force.length; i += 3) { const f = Math.hypot(force[i], force[i + 1], force[i + 2]); if (f > 0) { sizes.push(f); } }
    const usual = sizes.sort((a, b) => a - b)[Math.floor(sizes.length / 2)] || 0;
    return { mesh, width, usual, arrows: this.mesh(rod.clone(), width, { depthTest: false }) };
  }

  // The scale of the arrows: impacts are far larger than what rests, so the middle of the samples decides.
  usualForce() {
    const { contact, count, bodies } = this.movie, most = [];
    for (let i = 0; i < count; i += 1) {
      let largest = 0;
      for (let k = 3 * i * bodies; k < 3 * (i + 1) * bodies; k += 1) { largest = Math.max(largest, Math.abs(contact[k]) || 0); }
      if (largest > 0) { most.push(largest); }
    }
    return most.sort((a, b) => a - b)[Math.floor(most.length / 2)] || 0;
  }

  facets(size) {
    const places = facesOf(size).flatMap((face) => face.slice(2).flatMap((corner, k) => [...face[0], ...face[k + 1], ...corner]));
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(places), 3));
    geometry.computeVertexNormals();
    return geometry;
  }

  floor(solid) {
    const normal = [0, 0, 0];
    turnInto(normal, solid.orientation, ...solid.size);
    const away = normal.reduce((sum, n, k) => sum + n * (this.middle[k] - solid.position[k]), 0);
    const geometry = new THREE.PlaneGeometry(1.7 * this.size, 1.7 * this.size, 16, 16);
    const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.55 }));
    const grid = new THREE.LineSegments(this.gridLines(1.7 * this.size), new THREE.LineBasicMaterial());
    const q = aim(...normal, 1), lift = -1e-3 * this.size;
    for (const [part, up] of [[mesh, lift], [grid, 0.5 * lift]]) {
      part.position.set(...this.middle.map((v, k) => v - (away - up) * normal[k]));
      part.quaternion.set(q[1], q[2], q[3], q[0]);
      this.world.add(part);
    }
    mesh.userData.colour = "--line-soft";
    grid.userData.colour = "--line";
  }

  gridLines(width) {
    const places = [], n = 12;
    for (let i = 0; i <= n; i += 1) {
      const at = width * (i / n - 0.5), end = width / 2;
      places.push(at, -end, 0, at, end, 0, -end, at, 0, end, at, 0);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(places), 3));
    return geometry;
  }

  // Colours of the page's theme.
  paint() {
    const style = getComputedStyle(document.documentElement), colour = (name) => new THREE.Color(style.getPropertyValue(name).trim());
    for (const part of this.solids) { part.mesh.material.color = colour(part.colour); }
    this.world.traverse((part) => { if (part.userData.colour) { part.material.color = colour(part.userData.colour); } });
    if (this.arrows) { this.arrows.shaft.material.color = this.arrows.tip.material.color = colour("--c3"); }
    if (this.cones) { this.cones.arrows.material.color = colour("--c3"); }
    this.holding = colour("--c2");
    this.sliding = colour("--watch-fill");
    this.kept = colour("--pass-fill");
    this.broken = colour("--fail-fill");
    this.elastic = colour("--c4");
    this.show(this.sample);
  }

  show(sample) {
    this.sample = Math.max(0, Math.min(this.movie.count - 1, sample));
    for (const part of this.solids) {
      part.mesh.visible = !part.ghost || this.shown.ghost;
      if (!part.mesh.visible) { continue; }
      placeAll(part.mesh.instanceMatrix.array, part.poses, part.solids, this.sample);
      part.mesh.instanceMatrix.needsUpdate = true;
    }
    if (this.rods) { this.showLinks(this.rods, 0.34 * this.dot); }
    if (this.joints) { this.showLinks(this.joints, 0.55 * this.dot); }
    if (this.arrows) { this.showForces(); }
    if (this.cones) { this.showCones(); }
    this.draw();
  }

  endOf(link, end, out) {
    this.poses.at(link.bodies[end], this.sample);
    turnInto(out, this.poses.q, ...link.anchors[end]);
    for (let k = 0; k < 3; k += 1) { out[k] += this.poses.p[k]; }
  }

  showLinks(part, width) {
    const a = [0, 0, 0], b = [0, 0, 0], out = part.mesh.instanceMatrix.array, colour = new THREE.Color();
    const nearest = Math.round(this.sample), rows = this.movie.rows || 0;
    part.links.forEach((link, i) => {
      this.endOf(link, 0, a);
      this.endOf(link, 1, b);
      const d = [b[0] - a[0], b[1] - a[1], b[2] - a[2]], length = Math.hypot(...d);
      const joint = link.kind === "joint" || length === 0;
      placeInto(out, 16 * i, [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2], joint ? [1, 0, 0, 0] : aim(...d, length), width, width, joint ? width : length);
      if (link.kind === "spring") { colour.copy(this.elastic); } else {
        const g = link.row >= 0 && this.violationScale > 0 ? Math.abs(this.movie.violation[nearest * rows + link.row]) / this.violationScale : 0;
        colour.lerpColors(this.kept, this.broken, Math.min(1, g || 0));
      }
      part.mesh.setColorAt(i, colour);
    });
    part.mesh.instanceMatrix.needsUpdate = true;
    part.mesh.instanceColor.needsUpdate = true;
  }

  showForces() {
    const { shaft, tip, largest } = this.arrows, nearest = Math.round(this.sample), n = this.movie.bodies;
    const longest = 0.3 * this.size, width = 0.22 * this.dot;
    let used = 0;
    for (let body = 0; this.shown.forces && largest > 0 && body < n && used < MOST_ARROWS; body += 1) {
      const i = 3 * (nearest * n + body), d = [0, 1, 2].map((k) => (this.movie.contact[i + k] * 0.5 * longest) / largest);
      let length = Math.hypot(...d);
      if (length > longest) { d.forEach((v, k) => { d[k] = (v * longest) / length; }); length = longest; }
      if (!(length > 0.01 * longest)) { continue; }
      this.poses.at(body, this.sample);
      const q = aim(...d, length), head = Math.min(length, 6 * width);
      placeInto(shaft.instanceMatrix.array, 16 * used, this.poses.p.map((v, k) => v + d[k] / 2), q, width, width, length);
      placeInto(tip.instanceMatrix.array, 16 * used, this.poses.p.map((v, k) => v + d[k] * (1 + head / length / 2)), q, 2.6 * width, 2.6 * width, head);
      used += 1;
    }
    for (const mesh of [shaft, tip]) { mesh.count = used; mesh.instanceMatrix.needsUpdate = true; }
  }

  showCones() {
    const { mesh, arrows, width, usual } = this.cones, { point, axis, force, friction } = this.movie.cones;
    const high = 0.09 * this.size * Math.min(1, Math.sqrt(16 / width)), thin = 0.16 * this.dot, first = width * Math.round(this.sample);
    let used = 0;
    for (let i = first; this.shown.cones && i < first + width; i += 1) {
      const mu = friction[i];
      if (!(mu > 0)) { continue; }
      const at = [point[3 * i], point[3 * i + 1], point[3 * i + 2]], n = [axis[3 * i], axis[3 * i + 1], axis[3 * i + 2]];
      const f = [force[3 * i], force[3 * i + 1], force[3 * i + 2]];
      const pressed = f[0] * n[0] + f[1] * n[1] + f[2] * n[2], along = Math.hypot(f[0] - pressed * n[0], f[1] - pressed * n[1], f[2] - pressed * n[2]);
      const wide = high * Math.min(mu, WIDEST_CONE);
      placeInto(mesh.instanceMatrix.array, 16 * used, at.map((v, k) => v + (n[k] * high) / 2), aim(...n, Math.hypot(...n)), wide, wide, high);
      mesh.setColorAt(used, pressed > 0 && along >= SLIDES * mu * pressed ? this.sliding : this.holding);
      const length = Math.hypot(...f), shown = usual > 0 ? Math.min(1.6, length / usual) * high : 0;
      if (shown > 0) { placeInto(arrows.instanceMatrix.array, 16 * used, at.map((v, k) => v + (f[k] / length) * shown / 2), aim(...f, length), thin, thin, shown); } else { arrows.instanceMatrix.array.fill(0, 16 * used, 16 * used + 16); }
      used += 1;
    }
    for (const part of [mesh, arrows]) { part.count = used; part.instanceMatrix.needsUpdate = true; }
    if (mesh.instanceColor) { mesh.instanceColor.needsUpdate = true; }
  }

  resize() {
    const wide = this.host.clientWidth, high = this.host.clientHeight;
    if (!wide || !high) { return; }
    const before = this.camera.aspect;
    this.renderer.setSize(wide, high, false);
    this.camera.aspect = wide / high;
    this.camera.updateProjectionMatrix();
    if (Math.abs(before - this.camera.aspect) > 0.05) { this.frame(); }
    this.draw();
  }

  close() {
    this.watch.disconnect();
    this.controls.dispose();
    this.renderer.dispose();
    this.canvas.remove();
    this.marks.close();
  }

  say(name) {
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", `${name}; drag or press the arrow keys to turn it, plus and minus to come nearer or go away, Home to go back.`);
  }

  // By keyboard: arrows turn the picture, + and - bring it nearer or take it away, Home shows it as it was. False for others.
  turnBy(key) {
    if (key === "Home") {
      this.controls.target.set(...this.middle);
      this.frame();
      return true;
    }
    const turns = { ArrowLeft: [-TURN, 0, 1], ArrowRight: [TURN, 0, 1], ArrowUp: [0, TURN, 1], ArrowDown: [0, -TURN, 1], "+": [0, 0, 1 / NEARER], "-": [0, 0, NEARER] };
    if (!turns[key]) { return false; }
    const [about, above, far] = turns[key], from = this.controls.target, eye = this.camera.position;
    const x = eye.x - from.x, y = eye.y - from.y, z = eye.z - from.z, reach = Math.hypot(x, y, z);
    const round = Math.atan2(y, x) + about, high = Math.max(-1.5, Math.min(1.5, Math.asin(z / reach) + above)), r = reach * far;
    eye.set(from.x + r * Math.cos(high) * Math.cos(round), from.y + r * Math.cos(high) * Math.sin(round), from.z + r * Math.sin(high));
    this.controls.update();  // tells whoever follows, and draws
    return true;
  }

  // Only where the camera has moved since: a scene that plays costs nothing here.
  mark() {
    const { position, matrixWorld, fov } = this.camera, wide = this.host.clientWidth, high = this.host.clientHeight, from = this.controls.target;
    const now = [position.x, position.y, position.z, from.x, from.y, from.z, wide, high];
    if (!wide || (this.marked && now.every((v, k) => v === this.marked[k]))) { return; }
    this.marked = now;
    const reach = position.distanceTo(from), m = matrixWorld.elements;
    this.marks.show(wide, high, [m[0], m[1], m[2]], [m[4], m[5], m[6]], high / (2 * reach * Math.tan((fov * Math.PI) / 360)));
  }

  draw() {
    this.renderer.render(this.scene, this.camera);
    this.mark();
  }
}
