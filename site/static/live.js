// The page on which the engine itself runs, in a worker: sliders, the player, and what the run cost.
"use strict";

const PATIENCE = 250;  // ms that a newer question waits for the answer to an older one

// The engine in a worker. Only the newest question is worth an answer: older ones are ended.
class EngineWorker {
  constructor(answer) {
    this.answer = answer;
    this.address = URL.createObjectURL(new Blob([LIVE_WORKER], { type: "text/javascript" }));
    this.started = 0;
    this.open({ packed: LIVE_MODULE });
  }

  open(code) {
    this.ready = false;
    this.worker = new Worker(this.address);
    this.worker.onmessage = ({ data }) => this.hear(data);
    this.worker.onerror = (error) => this.answer({ failed: error.message || "its worker does not start" });
    this.worker.postMessage(code);
  }

  hear(data) {
    if (data.ready) { this.ready = true; this.module = data.module; } else { this.asked = null; this.answer(data); }
    this.send();
  }

  ask(question) {
    this.next = question;
    this.send();
    if (this.next && this.ready) {
      clearTimeout(this.waiting);
      this.waiting = setTimeout(() => this.restart(), Math.max(0, this.started + PATIENCE - performance.now()));
    }
  }

  send() {
    if (!this.ready || this.asked || !this.next) { return; }
    clearTimeout(this.waiting);
    this.asked = this.next;
    this.next = null;
    this.started = performance.now();
    this.worker.postMessage(this.asked);
  }

  restart() {
    if (!this.asked || !this.next) { return; }
    this.worker.terminate();
    this.asked = null;
    this.open({ module: this.module });
  }
}

class LivePage {
  constructor(box) {
    Object.assign(this, { box, player: null, costs: [], id: 0 });
    this.engine = new EngineWorker((told) => this.hear(told));
    this.form = box.querySelector(".live-form");
    this.facts = box.querySelector(".live-facts");
    this.about = box.querySelector(".live-about");
    this.figure = box.querySelector("figure");
    this.plot = box.querySelector(".live-costs");
    const scene = make("select", { id: "live-scene" }, ...Object.entries(LIVE_SCENES).map(([name, s]) => make("option", { value: name }, s.title)));
    scene.addEventListener("change", () => { this.clear(); state.set("scene", scene.value); this.open(); });
    this.scene = scene;
    this.head = make("div", { class: "live-field" }, make("label", { for: "live-scene" }, "scene"), scene);
    addEventListener("hashchange", () => this.open());
    this.open();
  }

  // Parameters of another scene do not stay in the address.
  clear() {
    for (const name of Object.keys(LIVE_SCENES[this.name].parameters)) { state.set(`p.${name}`, ""); }
    state.set("t", "");
    state.set("over", "");
  }

  // What else may be drawn over the run: a finer step, or another choice of the scene's first list.
  others() {
    const [key, list] = Object.entries(LIVE_SCENES[this.name].parameters).find(([, p]) => p.options) || [];
    const now = this.parameters(), words = (value) => value.replaceAll("_", " ");
    const found = { "h/4": { finer: 4, name: "a step of h/4" } };
    for (const value of list ? list.options : []) {
      if (value !== now[key]) { found[value] = { finer: 1, parameters: { [key]: value }, name: `${list.label} ${words(value)}` }; }
    }
    return found;
  }

  parameters() {
    const found = defaults(this.name);
    for (const [name, p] of Object.entries(LIVE_SCENES[this.name].parameters)) {
      const given = state.get(`p.${name}`);
      if (p.options ? p.options.includes(given) : given !== "" && Number(given) >= p.low && Number(given) <= p.high) { found[name] = p.options ? given : Number(given); }
    }
    return found;
  }

  open() {
    const wanted = state.get("scene");
    const name = LIVE_SCENES[wanted] ? wanted : Object.keys(LIVE_SCENES)[0];
    const other = name !== this.name;
    this.name = name;
    if (other) { this.shownFrom = this.id + 1; }
    this.scene.value = name;
    this.about.textContent = LIVE_SCENES[name].about;
    this.fields();
    this.run(other);
  }

  fields() {
    const now = this.parameters();
    this.form.replaceChildren(this.head, ...Object.entries(LIVE_SCENES[this.name].parameters).map(([name, p]) => {
      const id = `live-${name}`, told = make("output", { for: id });
      const input = p.options
        ? make("select", { id }, ...p.options.map((value) => make("option", { value }, value.replaceAll("_", " "))))
        : make("input", { id, type: "range", min: String(p.low), max: String(p.high), step: String(p.step) });
      input.value = String(now[name]);
      const say = () => { told.textContent = p.options ? "" : `${input.value} ${p.unit}`.trim(); };
      say();
      const change = () => {
        say();
        state.set(`p.${name}`, input.value === String(p.value) ? "" : input.value);
        if (p.options) { this.overField(); }
        this.run(false);
      };
      input.addEventListener("input", change);
      return make("div", { class: "live-field" }, make("label", { for: id }, p.label), input, told);
    }), this.over = make("div", { class: "live-field" }));
    this.overField();
  }

  overField() {
    const select = make("select", { id: "live-over" }, make("option", { value: "" }, "nothing"), ...Object.entries(this.others()).map(([key, one]) => make("option", { value: key }, one.name)));
    select.value = this.others()[state.get("over")] ? state.get("over") : "";
    select.addEventListener("change", () => { state.set("over", select.value); this.run(false); });
    this.over.replaceChildren(make("label", { for: "live-over" }, "draw over it"), select);
  }

  run(other) {
    this.other = this.other || other;
    this.id += 1;
    clearTimeout(this.later);
    const over = this.others()[state.get("over")];
    this.asked = { id: this.id, name: this.name, parameters: this.parameters(), over };
    this.engine.ask(this.asked);
  }

  hear({ id, movie, other, order, failed }) {
    if (failed) { this.note(`The engine cannot run in this browser: ${failed}.`); return; }
    if (order !== undefined) { if (id === this.id) { this.sayOrder(order); } return; }
    if (movie.bodies === 0 || id < this.shownFrom) { return; }  // of the scene that was left
    const energy = energyOf(movie);
    movie.energy = energy.total;
    if (other) {
      const { name } = this.asked.over || { name: "" };
      movie.ghost = { name, title: `distance from ${name}`, position: other.position, orientation: other.orientation, energy: energyOf(other).total };
    }
    if (!this.player) { this.player = new Player(this.figure, movie, "t", sceneOrWords); this.figure.classList.add("moving"); } else {
      this.player.use(movie, !this.other);
      if (this.other) { this.player.seek(0); }
    }
    if (this.other) { this.costs = []; }
    this.other = false;
    const perStep = movie.seconds / Math.max(1, movie.steps);
    this.costs.push(perStep * 1e6);
    this.say(movie, perStep, energy);
    this.note("");
    this.box.page = this;
    if (id !== this.id) { return; }
    if (LIVE_SCENES[this.name].smooth) { this.later = setTimeout(() => this.engine.ask({ id, name: this.name, parameters: this.parameters(), order: true }), 120); } else { this.sayOrder(null); }
  }

  note(words) {
    const note = this.box.querySelector(".live-note");
    note.hidden = !words;
    note.textContent = words;
  }

  say(movie, perStep, energy) {
    const largest = movie.violation ? movie.violation.reduce((most, g) => Math.max(most, Math.abs(g) || 0), 0) : null;
    const lines = [
      ["outcome", ["completed", "unsettled"].includes(movie.status) ? movie.status : `${movie.status} after ${movie.steps} steps`],
      ["steps", `${movie.steps} of h = ${figureOf(movie.timeStep)} s`],
      ["run time", `${figureOf(perStep * 1e6, 3)} µs a step, ${figureOf(movie.seconds * 1e3, 3)} ms in all`],
      ["energy gained or lost", energy.scale > 0 ? `${figureOf((100 * energy.change) / energy.scale)} % of ${figureOf(energy.scale)} J, the most that moved${movie.stored ? " or was stored" : ""}` : "none: nothing moves"],
      ...(movie.ratio ? [["friction / normal force", `${figureOf(movie.ratio[movie.count - 1])} in the end; µ = ${movie.bound}, tan of the slope ${figureOf(Math.tan((this.parameters().angle * Math.PI) / 180))}`]] : []),
      ...(movie.error ? [["largest distance", `${figureOf(movie.error.reduce((most, d) => Math.max(most, d), 0))} m from ${movie.ghost.name}`]] : []),
      ...(largest === null ? [] : [[`largest ${movie.violationName || "violation"}`, `${figureOf(largest)} ${movie.violationUnit || "m"}`]]),
      ["order of accuracy", "…"],
      ["final state", movie.stateHash],
    ];
    this.facts.replaceChildren(...lines.flatMap(([name, value]) => [make("dt", {}, name), make("dd", { "data-fact": name }, value)]));
    const recent = this.costs.slice(-60);
    this.plot.replaceChildren(recent.length < 2 ? "" : new TimeCurve("run time of the last runs", "µs a step", [{ values: recent, colour: 2 }], () => {}).element);
    if (recent.length > 1) { this.plot.querySelector(".value").textContent = `${figureOf(recent[recent.length - 1], 3)} µs a step`; }
  }

  sayOrder(order) {
    const place = this.facts.querySelector('[data-fact="order of accuracy"]');
    if (order === null) { place.textContent = "none: contacts make the motion jump"; return; }
    place.textContent = Number.isFinite(order) ? `${order.toFixed(2)} of the positions (h halved twice, first second)` : "not measurable here: the differences are rounding, or a run failed";
  }
}

(async function live() {
  const box = document.querySelector(".live");
  if (!box) { return; }
  try {
    await Promise.all([script(box.dataset.module), threeFrom(box.dataset.three)]);
    prepareView();
    await new Promise((done) => setTimeout(done));
    new LivePage(box);
  } catch (error) {
    box.querySelector(".live-note").textContent = `The engine cannot run in this browser: ${error.message}.`;
  }
})();
