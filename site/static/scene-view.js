// A scene in three dimensions, moving: what the replay of a recorded night and the live engine share.
// A movie is { step [s], count, bodies, solids, links, gravity, attractors, position, orientation, ... } with
// flat arrays over samples; see replay.js, which decodes one, and live.js, which computes one.
// Needs scene-poses.js and scene-marks.js.
"use strict";

const MOST_ARROWS = 400, MOST_TRAILS = 3, MOST_SHADES = 2000, DRIVEN = "--c6";
const DOUBLE_SIDE = 2, WIDEST_CONE = 3;  // three.js' name for both sides of a surface; mu from which a cone is drawn no wider
const SLIDES = 0.999;  // share of the friction bound from which a point is shown as sliding
const TURN = Math.PI / 18, NEARER = 1.15;  // of one press of a key: rad; ratio of distances

// A context takes long enough to be made in a task of its own, before there is anything to draw.
let prepared = null;
function renderer() {
  const made = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  made.debug.checkShaderErrors = false;  // asking waits for the compiler
  return made;
}
function prepareView() {
  try { prepared = prepared || renderer(); } catch (error) { prepared = null; }  // SceneView says it again
}

class SceneView {
  // `host` is an empty element; throws where the browser has no WebGL.
  constructor(host, movie) {
    this.host = host;
    this.renderer = prepared || renderer();
    prepared = null;
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
    this.scene.add(sun, sun.target);
    this.sun = sun;
    this.controls = new THREE.OrbitControls(this.camera, this.canvas);
    this.controls.enableZoom = false;  // the wheel scrolls the page
    this.canvas.style.touchAction = "pan-y";  // and so does a finger up and down; across, it turns the scene
    this.controls.addEventListener("change", () => this.draw());
    this.watch = new ResizeObserver(() => this.resize());
    this.watch.observe(host);
    this.shown = { ghost: true, forces: true, cones: true };
    this.drawn = true;
    this.sample = 0;
    this.load(movie);
  }

  // Another movie in the same view; the camera stays unless the scene has another extent.
  load(movie, keepCamera = false) {
    this.movie = movie;
    this.poses = new Poses(movie, movie.position, movie.orientation);
    this.ghost = movie.ghost ? new Poses(movie, movie.ghost.position, movie.ghost.orientation) : null;
    const before = this.world;
    if (before) { this.scene.remove(before); }
    this.world = new THREE.Group();
    this.scene.add(this.world);
    const { low, high } = extentOf(movie);
    this.middle = low.map((v, k) => (v + high[k]) / 2);
    this.size = Math.max(...high.map((v, k) => v - low[k])) || 1;
    this.dot = 0.018 * this.size;
    this.shade(0.5 * Math.hypot(...high.map((v, k) => v - low[k])) || this.size);
    this.build();
    if (!keepCamera) { this.home(low, high); }
    this.resize();
    this.paint();
    // Last: while something uses a shader it is not compiled again, which takes longer than a picture.
    before?.traverse((part) => { part.geometry?.dispose(); part.material?.dispose(); part.dispose?.(); });
  }

  // What lies on a floor or hangs above it is told by its shadow; where nothing can receive one, none is drawn.
  shade(radius) {
    const { solids } = this.movie, { shadow } = this.sun;
    this.renderer.shadowMap.enabled = this.sun.castShadow = solids.length <= MOST_SHADES && solids.some((s) => s.kind === "plane" || s.fixed);
    this.sun.target.position.set(...this.middle);
    this.sun.position.set(...this.middle.map((v, k) => v + 2 * radius * [0.31, -0.55, 0.78][k]));
    Object.assign(shadow.camera, { left: -radius, right: radius, bottom: -radius, top: radius, near: 0.1 * radius, far: 6 * radius });
    shadow.camera.updateProjectionMatrix();
    shadow.mapSize.set(1024, 1024);
    shadow.normalBias = 0.004 * radius;
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
      const key = (solid.kind === "particle" ? "sphere" : ["capsule", "facets"].includes(solid.kind) ? `${solid.kind} ${solid.size}` : solid.kind) + (solid.driven ? " driven" : solid.fixed ? " fixed" : "");
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
      const shape = key.split(" ")[0], still = key.endsWith("fixed"), driven = key.endsWith("driven");
      const geometry = () => shape === "facets" ? this.facets(key.split(" ")[1].split(",").map(Number)) : shape === "sphere" ? new THREE.SphereGeometry(1, ...detail) : shape === "box" ? new THREE.BoxGeometry(1, 1, 1) :
        new THREE.CapsuleGeometry(...key.split(" ")[1].split(",").map(Number), 6, 16).rotateX(Math.PI / 2);
      const solids = packed(items);
      const mesh = this.mesh(geometry(), items.length);
      mesh.castShadow = mesh.receiveShadow = true;
      this.solids.push({ mesh, solids, poses: this.poses, colour: driven ? DRIVEN : still ? "--ink-3" : "--c0" });
      if (this.ghost && !still) {
        const ghost = this.mesh(geometry(), items.length, { transparent: true, opacity: 0.55, depthWrite: false, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 4 });
        this.solids.push({ mesh: ghost, solids, poses: this.ghost, colour: "--c1", ghost: true });
      }
    }
    this.axles();
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
    this.pins();
    if (this.movie.bodies <= MOST_TRAILS) { this.trails(); }
    for (const centre of this.movie.attractors) {
      const star = new THREE.Mesh(new THREE.SphereGeometry(2 * this.dot, 24, 16), new THREE.MeshLambertMaterial());
      star.position.set(...centre);
      star.userData.colour = "--watch-fill";
      this.world.add(star);
    }
    this.violationScale = (this.movie.violation || []).reduce((a, v) => Math.max(a, Math.abs(v) || 0), 0);
  }

  // The axle of whatever the world holds and lets turn.
  axles() {
    for (const link of this.movie.links) {
      const end = link.kind === "joint" ? link.bodies.indexOf(WORLD_BODY) : -1, body = link.bodies[1 - end];
      const axis = end >= 0 && this.movie.bodies <= 60 ? axisOf(this.movie, body) : null;
      if (!axis) { continue; }
      const reach = Math.max(0.25 * this.size, ...this.movie.solids.filter((s) => s.body === body && s.kind === "box").map((s) => 1.35 * s.size[axis.map(Math.abs).indexOf(Math.max(...axis.map(Math.abs)))]));
      const long = link.anchors[1 - end].every((v) => Math.abs(v) < 1e-9) ? reach : 0.12 * this.size;  // of a hinge at the rim only its pin
      const solids = packed([{ body, offset: link.anchors[1 - end], turn: aim(...axis, 1), scale: [0.5 * this.dot, 0.5 * this.dot, long] }]);
      this.solids.push({ mesh: this.mesh(new THREE.CylinderGeometry(1, 1, 1, 12).rotateX(Math.PI / 2), 1), solids, poses: this.poses, colour: "--ink-3" });
    }
  }

  // Where rods and springs are held by the world.
  pins() {
    const places = new Map();
    for (const link of this.movie.links) {
      if (link.kind === "joint") { continue; }
      link.bodies.forEach((body, end) => { if (body === WORLD_BODY) { places.set(String(link.anchors[end]), link.anchors[end]); } });
    }
    for (const place of places.values()) {
      const pin = new THREE.Mesh(new THREE.SphereGeometry(0.7 * this.dot, 16, 12), new THREE.MeshLambertMaterial());
      pin.position.set(...place);
      pin.userData.colour = "--ink-3";
      this.world.add(pin);
    }
  }

  // The paths of a few bodies, while their places are drawn on them.
  trails() {
    const { position, count, bodies } = this.movie, stride = Math.max(1, Math.floor(count / 600)), places = [];
    for (let body = 0; body < bodies; body += 1) {
      let before = null;
      for (let sample = 0; sample < count; sample += stride) {
        const i = 3 * (sample * bodies + body), now = [position[i], position[i + 1], position[i + 2]];
        if (now.every((v) => Math.abs(v) < 1e6)) {
          if (before) { places.push(...before, ...now); }
          before = now;
        } else { before = null; }
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(places), 3));
    const trail = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    trail.userData.colour = "--ink-3";
    trail.frustumCulled = false;
    this.world.add(trail);
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

  facets(size) { return this.facesAsGeometry(facesOf(size)); }

  facesAsGeometry(faces) {
    const places = faces.flatMap((face) => face.slice(2).flatMap((corner, k) => [...face[0], ...face[k + 1], ...corner]));
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
    mesh.receiveShadow = true;
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
    cancelAnimationFrame(this.due);
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
    this.controls.update();  // tells the listeners, and draws
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

  // One picture a frame, however often something changes before it.
  draw() {
    this.due = this.due || requestAnimationFrame(() => {
      this.due = 0;
      this.renderer.render(this.scene, this.camera);
      this.mark();
    });
  }
}

// Where the browser draws nothing in three dimensions: the curves and numbers say all but that.
class NoView {
  constructor(host, movie) {
    this.movie = movie;
    this.shown = {};
    this.drawn = false;
    host.classList.add("none");
    host.textContent = "This browser has no WebGL, so the scene is not drawn. The curves and numbers are complete.";
  }

  load(movie) { this.movie = movie; }

  show() {}

  say() {}

  paint() {}

  resize() {}
}

// The scene, where it can be drawn.
function sceneOrWords(host, movie) {
  try { return new SceneView(host, movie); } catch (error) { return new NoView(host, movie); }
}
