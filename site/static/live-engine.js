// The native engine as WebAssembly, and the scenes a reader can play with. No page here: the tests run the same
// file in Node and compare every bit with the native engine.
"use strict";

const SOLVERS = ["direct", "iterative"];
const FRICTIONS = ["cone", "box", "scaled_box"];
const STATUS = ["completed", "diverged", "not finite", "timed out", "unsettled"];
const METHODS = {  // of particle scenes: what the step is asked for
  plain: {}, curved: { corrections: 1 }, "curved twice": { corrections: 2 },
  "order 4": { composition: 4 }, "order 6": { composition: 6 }, "order 8": { composition: 8 },
};
const WORLD = -1, ORIGIN = [0, 0, 0];

class LiveEngine {
  // `code`: the module's bytes, or the module once compiled.
  static async from(code) {
    const memory = () => new DataView(engine.native.memory.buffer);
    // What WASI's C library wants of its system: a clock, and nowhere to write.
    const system = {
      clock_time_get: (id, precision, at) => { memory().setBigUint64(at, BigInt(Math.round(performance.now() * 1e6)), true); return 0; },
      proc_exit: () => { throw new Error("the engine stopped"); },
    };
    const engine = new LiveEngine();
    engine.module = code instanceof WebAssembly.Module ? code : await WebAssembly.compile(code);
    const imports = {};
    for (const { module: from, name } of WebAssembly.Module.imports(engine.module)) {
      imports[from] = imports[from] || {};
      imports[from][name] = system[name] || (() => 52);  // not supported
    }
    engine.native = (await WebAssembly.instantiate(engine.module, imports)).exports;
    if (engine.native._initialize) { engine.native._initialize(); }
    return engine;
  }

  sine(angle) { return this.native.live_sine(angle); }
  cosine(angle) { return this.native.live_cosine(angle); }

  // A scene is built by the calls below; what is drawn of it is kept beside.
  begin(rigid, gravity, timeStep, method = {}) {
    this.native.live_begin(rigid ? 1 : 0);
    this.native.live_gravity(...gravity);
    this.native.live_method(timeStep, 1, method.corrections || 0, method.composition || 2, 0, SOLVERS.indexOf(method.solver || "direct"),
      FRICTIONS.indexOf(method.friction || "cone"), method.iterations || 50, 1e-10);
    this.drawn = { rigid, timeStep, gravity, bodies: 0, solids: [], links: [], attractors: [], rows: 0, joints: 0, touching: [] };
  }

  particle(mass, position, velocity = ORIGIN) {
    this.native.live_particle(mass, ...position, ...velocity);
    return this.body("particle", [], position, [1, 0, 0, 0], false);
  }

  body(kind, size, position, orientation, fixed) {
    const index = this.drawn.bodies;
    this.drawn.bodies += 1;
    this.drawn.solids.push({ kind, size, position, orientation, fixed, body: index });
    return index;
  }

  material(surface) {
    this.native.live_material(surface.friction || 0, surface.restitution || 0, surface.compliance || 0, 4.5 * this.drawn.timeStep, 0);
  }

  plane(surface) {
    this.native.live_body(1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0);
    this.material(surface);
    this.native.live_plane(0, 0, 1);
    return this.body("plane", [0, 0, 1], ORIGIN, [1, 0, 0, 0], true);
  }

  box(mass, size, position, surface, velocity = ORIGIN, turn = ORIGIN) {
    const [x, y, z] = size, moment = (square) => (mass * square) / 12.0;
    this.native.live_body(0, mass, moment(y * y + z * z), moment(x * x + z * z), moment(x * x + y * y), ...position, 1, 0, 0, 0);
    this.native.live_velocity(...velocity, ...turn);
    this.material(surface);
    this.native.live_box(...size);
    const body = this.body("box", size, position, [1, 0, 0, 0], false);
    this.drawn.touching.push(body);
    return body;
  }

  sphere(mass, radius, position, surface, velocity = ORIGIN) {
    const moment = 0.4 * mass * (radius * radius);
    this.native.live_body(0, mass, moment, moment, moment, ...position, 1, 0, 0, 0);
    this.native.live_velocity(...velocity, 0, 0, 0);
    this.material(surface);
    this.native.live_sphere(radius);
    const body = this.body("sphere", [radius], position, [1, 0, 0, 0], false);
    this.drawn.touching.push(body);
    return body;
  }

  // Ends are bodies by number, or places in the world.
  ends(first, second) {
    const body = (end) => (typeof end === "number" ? end : WORLD), place = (end) => (typeof end === "number" ? ORIGIN : end);
    return { bodies: [body(first), body(second)], anchors: [place(first), place(second)] };
  }

  distance(first, second, restLength, compliance, damping) {
    const { bodies, anchors } = this.ends(first, second);
    this.native.live_distance(...bodies, ...anchors[0], ...anchors[1], restLength, compliance, damping);
    this.drawn.links.push({ kind: "distance", bodies, anchors, row: this.drawn.rows });
    this.drawn.rows += 1;
  }

  centre(strength, position) {
    this.native.live_centre(strength, ...position);
    this.drawn.attractors.push(position);
  }

  lock(first, second, at, compliance) {
    this.native.live_lock(first, second, ...at, compliance, compliance, 2.0 * this.drawn.timeStep);
    const middle = (body) => (body === WORLD ? ORIGIN : this.drawn.solids[body].position);
    const anchors = [first, second].map((body) => at.map((v, k) => v - middle(body)[k]));
    this.drawn.links.push({ kind: "joint", bodies: [first, second], anchors, row: this.drawn.joints });
    this.drawn.joints += 1;
  }

  observe(name, index = -1, every = 1) {
    const letters = new Uint8Array(this.native.memory.buffer, this.native.live_name(), 64);
    letters.fill(0);
    letters.set(new TextEncoder().encode(name));
    return this.native.live_observe(index, -1, every);
  }

  values(observable) {
    const width = this.native.live_width(observable), samples = this.native.live_samples(observable);
    return { width, samples, values: new Float64Array(this.native.memory.buffer, this.native.live_values(observable), width * samples).slice() };
  }

  // Run the scene that was built and read its motion: a movie for the player, every sample in float64. `limit` is
  // wall time in s, 0 for none.
  run(steps, every = 1, limit = 0) {
    const { drawn } = this;
    const asked = { position: this.observe("position", -1, every), energy: this.observe("energy", -1, every), kinetic: this.observe("kinetic_energy", -1, every) };
    if (drawn.rigid) { asked.orientation = this.observe("orientation", -1, every); }
    if (drawn.rows) { asked.violation = this.observe("violation", -1, every); }
    const joints = Array.from({ length: drawn.joints }, (_, joint) => this.observe("violation", joint, every));
    const forces = drawn.touching.map((body) => this.observe("contact_force", body, every));
    if (forces.length) { asked.penetration = this.observe("penetration", -1, every); }
    const points = drawn.cones ? this.observe("contact_points", drawn.cones, every) : -1;
    const status = this.native.live_run(steps, limit);
    const read = Object.fromEntries(Object.entries(asked).map(([name, number]) => [name, this.values(number).values]));
    const count = this.native.live_samples(asked.position);
    const movie = {
      ...drawn, ...read, step: every * drawn.timeStep, count, status: STATUS[status], steps: this.native.live_steps(),
      seconds: this.native.live_seconds(), stateHash: this.stateHash(), orientation: read.orientation || null,
    };
    if (joints.length) {
      movie.rows = joints.length;
      movie.violation = new Float64Array(count * joints.length);
      movie.violationUnit = "m or rad";
      joints.forEach((number, joint) => {
        const { width, values } = this.values(number);
        for (let i = 0; i < count; i += 1) {
          for (let k = 0; k < width; k += 1) { movie.violation[i * joints.length + joint] = Math.max(movie.violation[i * joints.length + joint], Math.abs(values[i * width + k])); }
        }
      });
    }
    movie.cones = points < 0 ? null : this.contactPoints(points, drawn.cones);
    if (forces.length) {
      movie.contact = new Float64Array(3 * count * drawn.bodies);
      forces.forEach((number, i) => {
        const { values } = this.values(number);
        for (let s = 0; s < count; s += 1) { movie.contact.set(values.subarray(3 * s, 3 * s + 3), 3 * (s * drawn.bodies + drawn.touching[i])); }
      });
    }
    return movie;
  }

  // Ten numbers a point: where, axis, force (N), friction. Axes and forces of what the upper body feels.
  contactPoints(observable, most) {
    const { samples, values } = this.values(observable);
    const parts = { point: [0, 3], axis: [3, 3], force: [6, 3], friction: [9, 1] }, found = {};
    for (const [name, [first, width]] of Object.entries(parts)) {
      found[name] = new Float64Array(samples * most * width);
      for (let i = 0; i < samples * most; i += 1) { found[name].set(values.subarray(10 * i + first, 10 * i + first + width), i * width); }
    }
    const { axis, force } = found, pull = this.drawn.gravity;
    for (let i = 0; i < axis.length; i += 3) {
      if (axis[i] * pull[0] + axis[i + 1] * pull[1] + axis[i + 2] * pull[2] <= 0) { continue; }
      for (let k = i; k < i + 3; k += 1) { axis[k] = -axis[k]; force[k] = -force[k]; }
    }
    return found;
  }

  stateHash() {
    const bytes = new Uint8Array(this.native.memory.buffer, this.native.live_state_hash(), 64);
    return new TextDecoder().decode(bytes.subarray(0, bytes.indexOf(0)));
  }
}

// --- the scenes: parameters with their range, and how they are built ---
const number = (label, low, high, step, value, unit = "") => ({ label, low, high, step, value, unit });
const choice = (label, options, value) => ({ label, options, value });
const stepsPerSecond = (value = 60) => ({ ...number("steps per second", 15, 480, 15, value, "1/s"), isRate: true });

const LIVE_SCENES = {
  pendulum: {
    title: "Pendulum", about: "A bob on a rigid rod of 1 m. Plain SPOOK stretches the rod where the bob is fast; the curved step does not.",
    duration: 10, smooth: true,
    parameters: { method: choice("method", Object.keys(METHODS), "plain"), rate: stepsPerSecond(), angle: number("start", 5, 170, 5, 90, "° from hanging"), gravity: number("gravity", 0, 25, 0.01, 9.81, "m/s²") },
    build(engine, p, h) {
      engine.begin(false, [0, 0, -p.gravity], h, METHODS[p.method]);
      const turn = (p.angle * Math.PI) / 180;
      const bob = engine.particle(1, [engine.sine(turn), 0, -engine.cosine(turn)]);
      engine.distance(ORIGIN, bob, 1, 1e-13, h);
    },
  },
  chain: {
    title: "Chain", about: "Spheres in a level row, held by rods of 1 m; the free end whips. Small steps or a higher order keep its energy.",
    duration: 10, smooth: true,
    parameters: { method: choice("method", Object.keys(METHODS), "plain"), rate: stepsPerSecond(), links: number("links", 1, 40, 1, 26), compliance: number("log₁₀ compliance", -13, -8, 1, -12, "m/N") },
    build(engine, p, h) {
      engine.begin(false, [0, 0, -9.81], h, METHODS[p.method]);
      let before = ORIGIN;
      for (let i = 1; i <= p.links; i += 1) {
        const sphere = engine.particle(1, [i, 0, 0]);
        engine.distance(before, sphere, 1, Number(`1e${p.compliance}`), h);
        before = sphere;
      }
    },
  },
  edge: {
    title: "The edge of stability", about: "A chain of rods falls as it swings. With damping it stays together at any time step; without, the stretch that a step leaves is returned as motion, and where the step is long or the compliance small the chain explodes. Turn the damping from 0.1 to 0.",
    duration: 5, smooth: true,
    parameters: { rate: stepsPerSecond(30), damping: number("damping τ/h", 0, 5, 0.05, 0, "steps"), compliance: number("log₁₀ compliance", -13, -2, 1, -13, "m/N"), links: number("links", 1, 12, 1, 3) },
    build(engine, p, h) {
      engine.begin(false, [0, 0, -9.81], h);
      let before = ORIGIN;
      for (let i = 1; i <= p.links; i += 1) {
        const sphere = engine.particle(1, [i, 0, 0]);
        engine.distance(before, sphere, 1, Number(`1e${p.compliance}`), p.damping * h);
        before = sphere;
      }
    },
  },
  slope: {
    title: "Box on an inclined plane", about: "The plane is drawn level and gravity is tilted instead. Below the friction angle the box stays, and friction over normal force is the tangent of the slope; beyond it slides, and the ratio is µ.",
    duration: 3, smooth: false, ratio: true,
    parameters: { friction: choice("friction model", FRICTIONS, "cone"), rate: stepsPerSecond(), angle: number("slope", 0, 60, 0.5, 20, "°"), direction: number("direction", 0, 90, 5, 0, "°"), mu: number("friction µ", 0, 1.5, 0.05, 0.5) },
    build(engine, p, h) {
      const tilt = (p.angle * Math.PI) / 180, along = (p.direction * Math.PI) / 180, pull = -10 * engine.sine(tilt);
      engine.begin(true, [pull * engine.cosine(along), pull * engine.sine(along), -10 * engine.cosine(tilt)], h, { friction: p.friction });
      engine.plane({ friction: p.mu });
      engine.box(1, [1, 1, 1], [0, 0, 0.5], { friction: p.mu });
      engine.drawn.cones = 4;
    },
  },
  oscillator: {
    title: "Oscillator", about: "A mass on one compliant row: its stiffness and damping time are SPOOK's own. With the damping at 0 the energy stays, at any stiffness.",
    duration: 5, smooth: true, spring: (p) => 1 / p.stiffness,
    parameters: { rate: stepsPerSecond(), stiffness: number("stiffness", 1, 400, 1, 50, "N/m"), damping: number("damping τ/h", 0, 10, 0.25, 0, "steps") },
    build(engine, p, h) {
      engine.begin(false, [0, 0, 0], h);
      const mass = engine.particle(1, [0, 0, 2]);
      engine.distance([0, 0, -64], mass, 64, 1 / p.stiffness, p.damping * h);
    },
  },
  planetarium: {
    title: "Planetarium", about: "A planet around a fixed sun. At speed 1 the orbit is a circle, below it falls inwards; high orders keep the ellipse.",
    duration: 40, smooth: true,
    parameters: { method: choice("method", Object.keys(METHODS), "plain"), rate: { ...stepsPerSecond(60), low: 5, high: 240, step: 5 }, speed: number("speed", 0.4, 1.35, 0.05, 0.8, "m/s") },
    build(engine, p, h) {
      engine.begin(false, [0, 0, 0], h, METHODS[p.method]);
      engine.centre(1, ORIGIN);
      engine.particle(1, [1, 0, 0], [0, p.speed, 0]);
    },
  },
  beam: {
    title: "Beam", about: "Boxes locked to each other, the first to the world. The locks' compliance makes the beam bend.",
    duration: 4, smooth: true,
    parameters: { rate: stepsPerSecond(), boxes: number("boxes", 1, 40, 1, 12), compliance: number("log₁₀ compliance", -12, -2, 0.5, -4, "m/N, rad/(N m)") },
    build(engine, p, h) {
      engine.begin(true, [0, 0, -9.81], h);
      const compliance = p.compliance === Math.round(p.compliance) ? Number(`1e${p.compliance}`) : Math.sqrt(10) * Number(`1e${Math.floor(p.compliance)}`);
      for (let i = 0; i < p.boxes; i += 1) {
        engine.box(2.5, [0.125, 0.1, 0.1], [0.125 * (i + 0.5), 0, 0.5], {});
        engine.lock(i - 1, i, [0.125 * i, 0, 0.5], compliance);
      }
      engine.drawn.touching = [];
    },
  },
  pile: {
    title: "A small pile", about: "Boxes and balls fall on a plane and on each other.",
    duration: 4, smooth: false,
    parameters: { friction: choice("friction model", FRICTIONS, "cone"), solver: choice("solver", SOLVERS, "direct"), rate: stepsPerSecond(), count: number("bodies", 1, 24, 1, 10), mu: number("friction µ", 0, 1.2, 0.05, 0.4), restitution: number("restitution", 0, 1, 0.05, 0.1) },
    build(engine, p, h) {
      engine.begin(true, [0, 0, -9.81], h, { friction: p.friction, solver: p.solver });
      const surface = { friction: p.mu, restitution: p.restitution };
      engine.plane(surface);
      for (let i = 0; i < p.count; i += 1) {
        const place = [0.3 * ((i * 7) % 5 - 2) / 2, 0.3 * ((i * 3) % 5 - 2) / 2, 0.6 + 0.75 * i];
        if (i % 3 === 2) { engine.sphere(1, 0.3, place, surface); } else { engine.box(1, [0.6, 0.5, 0.4], place, surface, ORIGIN, [0, 0, 0.5]); }
      }
    },
  },
};

function defaults(name) {
  return Object.fromEntries(Object.entries(LIVE_SCENES[name].parameters).map(([key, p]) => [key, p.value]));
}

// A scene run for its duration, or for a number of steps; `finer` divides the time step.
function simulateLive(engine, name, parameters, { steps = 0, finer = 1, every = 1, limit = 0 } = {}) {
  const scene = LIVE_SCENES[name], p = { ...defaults(name), ...parameters };
  const h = 1 / (p.rate * finer);
  scene.build(engine, p, h);
  const movie = engine.run(steps || Math.round(scene.duration * p.rate) * finer, every * finer, limit);
  if (scene.spring) { movie.stored = storedEnergy(movie, scene.spring(p)); movie.violationName = "extension"; }
  return scene.ratio ? { ...movie, ratio: forceRatio(movie), bound: p.mu } : movie;
}

// What rows that are springs have stored at each sample, J: extension² / (2 compliance).
function storedEnergy(movie, compliance) {
  const stored = new Float64Array(movie.count);
  movie.violation.forEach((g, i) => { stored[Math.floor(i / movie.rows)] += (g * g) / (2 * compliance); });
  return stored;
}

// The energy that the motion should keep, J, and the share of it that came or went: of the most that moved or was
// stored, as a level of potential energy is a free choice.
function energyOf(movie) {
  const total = movie.energy.map((e, i) => e + (movie.stored ? movie.stored[i] : 0));
  let scale = 0, change = 0;
  for (let i = 0; i < movie.count; i += 1) {
    scale = Math.max(scale, movie.kinetic[i], movie.stored ? movie.stored[i] : 0);
    if (!(Math.abs(total[i] - total[0]) <= Math.abs(change))) { change = total[i] - total[0]; }
  }
  return { total, change, scale };
}

// Friction over normal force of all that touches the level ground, at each sample; no number where nothing presses.
function forceRatio(movie) {
  const ratio = new Float64Array(movie.count);
  for (let i = 0; i < movie.count; i += 1) {
    let x = 0, y = 0, z = 0;
    for (let k = 3 * i * movie.bodies; k < 3 * (i + 1) * movie.bodies; k += 3) { x += movie.contact[k]; y += movie.contact[k + 1]; z += movie.contact[k + 2]; }
    ratio[i] = z > 0 ? Math.sqrt(x * x + y * y) / z : NaN;
  }
  return ratio;
}

// Order of accuracy by halving the step twice: log2 |x(h) − x(h/2)| / |x(h/2) − x(h/4)|, each the largest of the first
// second: at one moment alone a difference may happen to change its sign.
function observedOrder(engine, name, parameters) {
  const p = { ...defaults(name), ...parameters }, steps = Math.max(1, Math.round(p.rate));
  const runs = [1, 2, 4].map((finer) => simulateLive(engine, name, parameters, { steps: steps * finer, finer }));
  if (runs.some((movie) => movie.status !== "completed")) { return NaN; }
  const width = 3 * runs[0].bodies;
  const at = (movie, sample) => Math.round((sample * runs[0].step) / movie.step) * width;
  const gap = (one, other) => {
    let most = 0;
    for (let sample = 0; sample < runs[0].count; sample += 1) {
      for (let k = 0; k < width; k += 1) { most = Math.max(most, Math.abs(one.position[at(one, sample) + k] - other.position[at(other, sample) + k])); }
    }
    return most;
  };
  const coarse = gap(runs[0], runs[1]), fine = gap(runs[1], runs[2]);
  return coarse > 1e-13 && fine > 1e-13 ? Math.log2(coarse / fine) : NaN;
}

// In a worker: answers questions one after the other. The page ends the worker when it no longer wants the answer.
async function serve({ data }) {
  if (data.packed || data.module) {
    try { serve.engine = await LiveEngine.from(data.module || (await inflated(data.packed).arrayBuffer())); } catch (error) {
      postMessage({ failed: error.message });  // the page does not hear of a promise that fails
      return;
    }
    postMessage({ ready: true, module: serve.engine.module });
    return;
  }
  const { id, name, parameters, order, over } = data;
  try {
    if (order) { postMessage({ id, order: observedOrder(serve.engine, name, parameters) }); return; }
    const { duration } = LIVE_SCENES[name], every = Math.max(1, Math.floor((duration * parameters.rate) / 1200));
    const movie = simulateLive(serve.engine, name, parameters, { every, limit: 8 });
    const other = over && simulateLive(serve.engine, name, { ...parameters, ...over.parameters }, { every, finer: over.finer, limit: 8 });
    postMessage({ id, movie, other }, [...new Set([movie, other].flatMap(buffersOf))]);
  } catch (error) { postMessage({ id, failed: error.message }); }
}

const buffersOf = (thing) => (ArrayBuffer.isView(thing) ? [thing.buffer] : thing && typeof thing === "object" && !Array.isArray(thing) ? Object.values(thing).flatMap(buffersOf) : []);

if (typeof WorkerGlobalScope !== "undefined") { onmessage = serve; }
if (typeof module !== "undefined") { module.exports = { LiveEngine, LIVE_SCENES, simulateLive, observedOrder, defaults, energyOf }; }
