// The page on which the engine itself runs: sliders, the player, and what the run cost.
"use strict";

// The module stands in a script as base64 of its deflated bytes: a page opened from a file may not fetch.
async function moduleBytes() {
  const packed = Uint8Array.from(atob(LIVE_MODULE), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

class LivePage {
  constructor(box, engine) {
    Object.assign(this, { box, engine, player: null, costs: [] });
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
        clearTimeout(this.waiting);
        this.waiting = setTimeout(() => this.run(false), 30);
      };
      input.addEventListener("input", change);
      return make("div", { class: "live-field" }, make("label", { for: id }, p.label), input, told);
    }));
  }

  run(other) {
    const parameters = this.parameters(), scene = LIVE_SCENES[this.name];
    const every = Math.max(1, Math.floor((scene.duration * parameters.rate) / 1200));
    const movie = simulateLive(this.engine, this.name, parameters, { every, limit: 8 });
    if (this.player) {
      this.player.use(movie, !other);
      if (other) { this.player.view.load(movie); this.player.seek(0); }
    } else { this.player = new Player(this.figure, movie, "t"); this.figure.classList.add("moving"); }
    const perStep = movie.seconds / Math.max(1, movie.steps);
    if (other) { this.costs = []; }
    this.costs.push(perStep * 1e6);
    this.say(movie, perStep);
    clearTimeout(this.later);
    this.later = setTimeout(() => this.sayOrder(parameters), 120);
  }

  say(movie, perStep) {
    const drift = movie.energy.reduce((most, e) => Math.max(most, Math.abs(e - movie.energy[0])), 0);
    const largest = movie.violation ? movie.violation.reduce((most, g) => Math.max(most, Math.abs(g) || 0), 0) : null;
    const lines = [
      ["outcome", ["completed", "unsettled"].includes(movie.status) ? movie.status : `${movie.status} after ${movie.steps} steps`],
      ["steps", `${movie.steps} of h = ${figureOf(movie.timeStep)} s`],
      ["run time", `${figureOf(perStep * 1e6, 3)} µs a step, ${figureOf(movie.seconds * 1e3, 3)} ms in all`],
      ["largest change of energy", `${figureOf(drift)} J`],
      ...(movie.ratio ? [["friction / normal force", `${figureOf(movie.ratio[movie.count - 1])} in the end; µ = ${movie.bound}, tan of the slope ${figureOf(Math.tan((this.parameters().angle * Math.PI) / 180))}`]] : []),
      ...(largest === null ? [] : [["largest violation", `${figureOf(largest)} ${movie.violationUnit || "m"}`]]),
      ["order of accuracy", "…"],
      ["final state", movie.stateHash],
    ];
    this.facts.replaceChildren(...lines.flatMap(([name, value]) => [make("dt", {}, name), make("dd", { "data-fact": name }, value)]));
    const recent = this.costs.slice(-60);
    this.plot.replaceChildren(recent.length < 2 ? "" : new TimeCurve("run time of the last runs", "µs a step", [{ values: recent, colour: 2 }], () => {}).element);
    if (recent.length > 1) { this.plot.querySelector(".value").textContent = `${figureOf(recent[recent.length - 1], 3)} µs a step`; }
  }

  sayOrder(parameters) {
    const place = this.facts.querySelector('[data-fact="order of accuracy"]');
    if (!LIVE_SCENES[this.name].smooth) { place.textContent = "none: contacts make the motion jump"; return; }
    const order = observedOrder(this.engine, this.name, parameters);
    place.textContent = Number.isFinite(order) ? `${order.toFixed(2)} of the positions (h halved twice, first second)` : "not measurable here: the differences are rounding, or a run failed";
  }
}

(async function live() {
  const box = document.querySelector(".live");
  if (!box) { return; }
  const note = box.querySelector(".live-note");
  try {
    await threeFrom(box.dataset.three);
    await script(box.dataset.module);
    box.page = new LivePage(box, await LiveEngine.from(await moduleBytes()));
    note.hidden = true;
  } catch (error) {
    note.textContent = `The engine cannot run in this browser: ${error.message}.`;
  }
})();
