// Plays a movie: the view, one time slider, curves beside it, the moment in the address. Needs scene-view.js.
"use strict";

const LIBRARY = "three-scene.min.js";  // its address stands in the page, under data-three
let libraryAsked = null;

function threeFrom(address) {
  libraryAsked = libraryAsked || script(address);
  return libraryAsked;
}

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name in element && typeof value !== "string") { element[name] = value; } else { element.setAttribute(name, value); }
  }
  element.append(...children);
  return element;
}

function drawnIn(tag, attributes) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) { element.setAttribute(name, value); }
  return element;
}

function figureOf(value, digits = 4) {
  if (!Number.isFinite(value)) { return "not finite"; }
  if (value === 0) { return "0"; }
  const size = Math.abs(value);
  return (size < 1e-3 || size >= 1e5 ? value.toExponential(digits - 2) : String(Number(value.toPrecision(digits)))).replace("-", "−").replace("e+", "e");
}

// --- one curve over time, with a cursor that is the time slider's ---
const WIDE = 320, HIGH = 74;
const LEVEL = 1e-12;  // share of a value below which its changes are rounding, and drawn as none

class TimeCurve {
  // curves: [{ name, values, colour }]; `values` has one number per sample. `ground` is a value that is shown, too.
  constructor(title, unit, curves, onTime, ground = NaN) {
    Object.assign(this, { unit, curves, onTime, ground });
    this.value = make("span", { class: "value" });
    this.svg = drawnIn("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, preserveAspectRatio: "none", "aria-hidden": "true" });
    this.cursor = drawnIn("path", { class: "cursor" });
    this.element = make("div", { class: "curve" }, make("div", { class: "curve-head" }, make("span", {}, title), this.value), this.svg);
    this.fill(curves);
    const choose = (event) => {
      const box = this.svg.getBoundingClientRect();
      onTime(Math.max(0, Math.min(1, (event.clientX - box.left) / box.width)));
    };
    this.svg.addEventListener("pointerdown", (event) => { this.svg.setPointerCapture(event.pointerId); choose(event); });
    this.svg.addEventListener("pointermove", (event) => { if (event.buttons) { choose(event); } });
  }

  fill(curves) {
    this.curves = curves;
    this.svg.replaceChildren();
    let low = Infinity, high = -Infinity;
    for (const curve of curves) {
      for (const v of curve.values) { if (Number.isFinite(v)) { low = Math.min(low, v); high = Math.max(high, v); } }
    }
    if (Number.isFinite(this.ground)) { low = Math.min(low, this.ground); high = Math.max(high, this.ground); }
    if (!(high - low > LEVEL * Math.max(Math.abs(low), Math.abs(high)))) { const pad = Math.abs(low) || 1; low -= pad; high += pad; }
    for (const curve of curves) {
      let path = "", pen = "M";
      const n = curve.values.length, stride = Math.max(1, Math.floor(n / 640));
      for (let i = 0; i < n; i += stride) {
        const v = curve.values[i];
        if (!Number.isFinite(v)) { pen = "M"; continue; }
        path += `${pen}${((i / Math.max(1, n - 1)) * WIDE).toFixed(1)} ${(HIGH - 4 - ((v - low) / (high - low)) * (HIGH - 8)).toFixed(1)}`;
        pen = "L";
      }
      this.svg.append(drawnIn("path", { d: path, class: `line c${curve.colour}` }));
    }
    this.svg.append(this.cursor);
  }

  show(share) {
    const x = (share * WIDE).toFixed(1);
    this.cursor.setAttribute("d", `M${x} 0V${HIGH}`);
    const told = this.curves.map((curve) => figureOf(curve.values[Math.round(share * (curve.values.length - 1))]));
    this.value.textContent = `${told.join(" · ")} ${this.unit}`.trim();
  }
}

// Largest over a sample's values of a flat array.
function largestEach(flat, width, count) {
  const out = new Float64Array(count);
  for (let i = 0; i < count; i += 1) {
    let most = 0;
    for (let k = 0; k < width; k += 1) { const v = Math.abs(flat[i * width + k]); if (!(v <= most)) { most = v; } }
    out[i] = most;
  }
  return out;
}

// Largest distance between two sets of positions, per sample.
function apart(one, other, bodies, count) {
  const out = new Float64Array(count);
  for (let i = 0; i < count; i += 1) {
    let most = 0;
    for (let b = 0; b < bodies; b += 1) {
      const k = 3 * (i * bodies + b), d = Math.hypot(one[k] - other[k], one[k + 1] - other[k + 1], one[k + 2] - other[k + 2]);
      if (!(d <= most)) { most = d; }
    }
    out[i] = most;
  }
  return out;
}

class Player {
  // `box` is a figure whose still picture the player replaces; `name` is what its time is called in the address.
  constructor(box, movie, name, View = SceneView) {
    Object.assign(this, { box, name, playing: false, speed: 1, sample: 0, cost: 0 });
    this.stage = make("div", { class: "stage" });
    this.play = make("button", { type: "button", class: "play" }, "Play");
    this.slider = make("input", { type: "range", min: "0", step: "any", "aria-label": "Time" });
    this.clock = make("output", { class: "clock" });
    this.tools = make("div", { class: "player-tools" });
    this.controls = make("div", { class: "player-bar" }, this.play, this.slider, this.clock);
    this.curvesBox = make("div", { class: "curves" });
    this.element = make("div", { class: "player", tabIndex: -1 }, this.stage, this.controls, this.tools, this.curvesBox);
    box.prepend(this.element);
    this.view = new View(this.stage, movie);
    this.view.say("The scene in three dimensions");
    this.play.addEventListener("click", () => this.toggle());
    this.slider.addEventListener("input", () => { this.pause(); this.seek(Number(this.slider.value)); this.remember(); });
    this.element.addEventListener("keydown", (event) => {
      if (event.key === " " && event.target !== this.play && event.target.tagName !== "SELECT" && event.target.type !== "checkbox") { event.preventDefault(); this.toggle(); }
    });
    document.addEventListener("theme", () => { this.view.paint(); if (this.second) { this.second.paint(); } });
    this.tool("speed", make("label", {}, "speed ", this.select([["0.1", "× 0.1"], ["0.25", "× 0.25"], ["1", "× 1"], ["4", "× 4"]], "1", (v) => { this.speed = Number(v); })));
    this.tool("ghost", this.check("ghost", true, (on) => { this.view.shown.ghost = on; this.view.show(this.sample); }));
    this.tool("forces", this.check("contact forces", true, (on) => { this.view.shown.forces = on; this.view.show(this.sample); }));
    this.tool("cones", this.check("friction cones (orange: sliding)", true, (on) => { this.view.shown.cones = on; this.view.show(this.sample); }));
    this.worst = this.tool("worst", make("button", { type: "button", class: "button" }, "Largest error"));
    this.worst.addEventListener("click", () => this.toWorst());
    this.use(movie);
    const at = Number(state.get(name));
    this.seek(at > 0 ? at / movie.step : 0);
    addEventListener("hashchange", () => { if (!this.playing) { this.seek((Number(state.get(name)) || 0) / this.movie.step); } });
  }

  tool(name, element) { element.dataset.tool = name; this.tools.append(element); return element; }

  select(options, chosen, act) {
    const select = make("select", {}, ...options.map(([value, label]) => make("option", { value }, label)));
    select.value = chosen;
    select.addEventListener("change", () => act(select.value));
    return select;
  }

  check(label, on, act) {
    const input = make("input", { type: "checkbox", checked: on });
    input.addEventListener("change", () => act(input.checked));
    return make("label", {}, input, ` ${label}`);
  }

  // Show another movie; where the old one stood, in seconds, stays.
  use(movie, keepCamera = false) {
    const seconds = this.movie ? this.sample * this.movie.step : 0;
    this.movie = movie;
    if (this.view.movie !== movie) { this.view.load(movie, keepCamera); }
    this.slider.max = String(movie.count - 1);
    const tools = Object.fromEntries([...this.tools.children].map((tool) => [tool.dataset.tool, tool]));
    tools.ghost.hidden = !movie.ghost;
    tools.ghost.lastChild.textContent = ` ghost: ${movie.ghost ? movie.ghost.name : ""}`;
    tools.forces.hidden = !movie.contact;
    tools.cones.hidden = !movie.cones;
    const given = [];
    if (movie.ghost) { movie.error = apart(movie.position, movie.ghost.position, movie.bodies, movie.count); given.push([movie.ghost.title || "difference from the reference run", "m", [{ values: movie.error, colour: 1 }]]); }
    if (movie.rows) { movie.largest = largestEach(movie.violation, movie.rows, movie.count); given.push([`largest ${movie.violationName || "violation"}`, movie.violationUnit || "m", [{ values: movie.largest, colour: 1 }]]); }
    if (movie.energy) { given.push(["energy", "J", movie.ghost && movie.ghost.energy ? [{ values: movie.energy, colour: 0 }, { values: movie.ghost.energy, colour: 1 }] : [{ values: movie.energy, colour: 0 }]]); }
    if (movie.penetration) { given.push(["deepest penetration", "m", [{ values: movie.penetration, colour: 3 }]]); }
    if (movie.ratio) { given.push(["friction / normal force, and µ", "", [{ values: movie.ratio, colour: 0 }, { values: movie.ratio.map(() => movie.bound), colour: 1 }], 0]); }
    this.worst.hidden = !movie.error && !movie.largest;
    this.worst.textContent = movie.error ? "Largest distance" : `Largest ${movie.violationName || "violation"}`;
    this.curves = given.map(([title, unit, curves, ground]) => new TimeCurve(title, unit, curves, (share) => { this.pause(); this.seek(share * (this.movie.count - 1)); this.remember(); }, ground));
    this.curvesBox.replaceChildren(...this.curves.map((curve) => curve.element));
    this.seek(seconds / movie.step);
  }

  // Another movie in a picture of its own beside the first, on the same slider and seen from the same place.
  beside(movie, name = "") {
    if (this.second) {
      this.second.close();
      this.second = null;
      this.stages.replaceWith(this.stage);
    }
    if (movie) {
      const stage = make("div", { class: "stage" }), named = (words, part) => make("div", {}, part, make("p", { class: "stage-name" }, words));
      this.stages = make("div", { class: "stages-beside" });
      this.stage.replaceWith(this.stages);
      this.stages.append(named("tonight", this.stage), named(name, stage));
      this.second = new SceneView(stage, { ...movie, ghost: null });
      this.second.say(`The scene as it moved: ${name}`);
      const follow = (from, to) => from.controls.addEventListener("change", () => {
        if (to.camera.position.distanceToSquared(from.camera.position) < 1e-18) { return; }
        to.camera.position.copy(from.camera.position);
        to.controls.target.copy(from.controls.target);
        to.controls.update();
        to.draw();
      });
      follow(this.view, this.second);
      follow(this.second, this.view);
    }
    this.view.resize();
    this.seek(this.sample);
  }

  toWorst() {
    const values = this.movie.error || this.movie.largest;
    let at = 0;
    values.forEach((v, i) => { if (!(v <= values[at])) { at = i; } });
    this.pause();
    this.seek(at);
    this.remember();
  }

  seek(sample) {
    this.sample = Math.max(0, Math.min(this.movie.count - 1, sample || 0));
    const from = performance.now();
    this.view.show(this.sample);
    if (this.second) { this.second.show(this.sample); }
    this.cost = performance.now() - from;  // ms of script for this picture
    this.slider.value = String(this.sample);
    const seconds = this.sample * this.movie.step;
    this.slider.setAttribute("aria-valuetext", `${seconds.toFixed(2)} seconds`);
    this.clock.textContent = `${seconds.toFixed(2)} s`;
    const share = this.movie.count > 1 ? this.sample / (this.movie.count - 1) : 0;
    this.curves.forEach((curve) => curve.show(share));
  }

  remember() { state.set(this.name, this.sample > 0 ? (this.sample * this.movie.step).toPrecision(5) : ""); }

  pause() { this.playing = false; this.play.textContent = "Play"; }

  toggle() {
    if (this.playing) { this.pause(); this.remember(); return; }
    this.playing = true;
    this.play.textContent = "Pause";
    if (this.sample >= this.movie.count - 1) { this.seek(0); }
    let before = null;
    const step = (now) => {
      if (!this.playing) { return; }
      if (before !== null) { this.seek(this.sample + (this.speed * (now - before)) / 1000 / this.movie.step); }
      before = now;
      if (this.sample >= this.movie.count - 1) { this.pause(); this.remember(); return; }
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
