// Recorded motion of a night: loads a trajectory when its figure is seen, decodes it, hands it to the player.
"use strict";

const recordings = new Map();  // by key, as the files of replay/ hand them over

// Called by each file of replay/.
function recorded(key, data) { recordings.set(key, data); }

// Sixteen-bit differences over samples, the low bytes of all before the high ones, deflated. 65535 is no value.
async function unpacked(channel, count) {
  const bytes = new Uint8Array(await inflated(channel.data).arrayBuffer());
  const n = bytes.length / 2, width = n / count, out = new Float32Array(n);
  const last = new Uint16Array(width);
  for (let i = 0; i < n; i += 1) {
    const column = i % width;
    last[column] += bytes[i] | (bytes[n + i] << 8);
    out[i] = last[column] === 65535 ? NaN : channel.low + last[column] * channel.step;
  }
  return out;
}

async function movieOf(data) {
  const channels = {};
  for (const channel of data.channels) { channels[channel.name] = await unpacked(channel, data.count); }
  return {
    step: data.step, count: data.count, bodies: data.bodies, solids: data.solids, links: data.links, rows: data.rows,
    gravity: data.gravity, attractors: data.attractors, position: channels.position,
    orientation: channels.orientation || null, violation: channels.violation || null, contact: channels.contact_force || null,
    cones: channels.cone_point ? { point: channels.cone_point, axis: channels.cone_axis, force: channels.cone_force, friction: channels.cone_friction } : null,
    energy: channels.energy || null, penetration: channels.penetration || null,
    ghost: channels.exact_position
      ? { name: data.exact, position: channels.exact_position, orientation: channels.exact_orientation || null } : null,
  };
}

async function movieFrom(source) {
  if (!recordings.has(source.key)) { await script(source.address); }
  if (!recordings.has(source.key)) { throw new Error(DAMAGED); }
  return movieOf(recordings.get(source.key));
}

function sameScene(one, other) { return one.bodies === other.bodies && one.count === other.count && one.step === other.step; }

const TOLD = 1e-4;  // of the reach of its bodies: what the stored digits can tell
const SEEN = 0.05;  // of half the picture: what an eye sees

// The first sample at which two nights are so far apart, in metres; -1 if there is none.
function firstDifference(one, other, far) {
  return apart(one.position, other.position, one.bodies, one.count).findIndex((d) => !(d <= far));
}

function reachOf(movie) { return movie.position.reduce((most, v) => Math.max(most, Math.abs(v) || 0), 0); }

function halfPicture(movie) {
  const { low, high } = extentOf(movie);
  return Math.hypot(...high.map((v, k) => v - low[k])) / 2;
}

async function startReplay(box) {
  const sources = JSON.parse(box.querySelector(".replay-sources").textContent);
  const say = (words) => { box.querySelector(".replay-note").textContent = words; };
  try {
    await threeFrom(box.dataset.three);
    for (const source of sources) { source.address = box.dataset.root + source.address; }
    const tonight = await movieFrom(sources[0]);
    const player = new Player(box, tonight, "t", sceneOrWords), { drawn } = player.view;
    box.classList.toggle("moving", drawn);  // without, the still picture stays
    box.player = player;
    if (sources.length < 2) { return; }
    const other = player.select([["", tonight.ghost ? tonight.ghost.name : "nothing"], ...sources.slice(1).map((s) => [s.key, s.label])], "", (key) => {
      state.set("against", key);
      return laid(key);
    });
    const first = make("button", { type: "button", class: "button", hidden: true }, "First difference");
    first.addEventListener("click", () => { player.pause(); player.seek(Number(first.dataset.sample)); player.remember(); });
    let night = null, label = "", asked = "";
    const beside = player.check("side by side", state.get("beside") === "1", (on) => { state.set("beside", on ? "1" : ""); player.beside(on ? night : null, label); });
    beside.hidden = true;
    async function against(key) {
      const source = sources.find((s) => s.key === key);
      beside.hidden = !source || !drawn;
      player.beside(null);
      asked = key;
      say("");
      if (!source) { first.hidden = true; player.use(tonight, true); player.view.load(tonight, true); return; }
      const loaded = await movieFrom(source);
      if (asked !== key) { return; }  // another was chosen while this one came
      night = loaded;
      label = source.label;
      beside.querySelector("input").disabled = !sameScene(tonight, night);
      if (!sameScene(tonight, night)) {
        first.hidden = true;
        player.use(tonight, true);
        say(`${source.label} was recorded with other steps or bodies, so it cannot be laid over tonight.`);
        return;
      }
      const at = firstDifference(tonight, night, TOLD * reachOf(tonight));
      first.hidden = false;
      first.disabled = at < 0;
      first.textContent = at < 0 ? "No difference" : "First difference";
      first.dataset.sample = String(at);
      first.dataset.seen = String(firstDifference(tonight, night, SEEN * halfPicture(tonight)));
      player.use({ ...tonight, ghost: { name: source.label, position: night.position, orientation: night.orientation, energy: night.energy } }, true);
      if (drawn && beside.querySelector("input").checked) { player.beside(night, label); }
    }
    // Whatever keeps a night from being shown, tonight stays.
    async function laid(key) {
      try { await against(key); } catch (error) {
        if (asked !== key) { return; }
        first.hidden = beside.hidden = true;
        player.use(tonight, true);
        say(`The motion of that night cannot be shown: ${reasonOf(error)}.`);
      }
    }
    player.tools.prepend(make("label", {}, "against ", other), first, beside);
    const begun = state.get("against") || box.dataset.against || "";
    if (begun) { other.value = begun; await laid(begun); }
    if (state.get("at") === "first") {  // a reader from the list of causes wants to see it go wrong
      state.set("at", "");
      if (!first.hidden && first.dataset.seen >= 0) { player.seek(Number(first.dataset.seen)); player.remember(); } else if (!first.hidden) { player.toWorst(); }
    }
  } catch (error) {
    say(`The motion is not shown: ${reasonOf(error)}. The picture shows the start.`);
  }
}

(function replays() {
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) { watch.unobserve(entry.target); startReplay(entry.target); }
    }
  }, { rootMargin: "200px 0px" });
  document.querySelectorAll("figure.replay").forEach((box) => {
    if (state.get("at")) { box.scrollIntoView({ block: "center" }); }
    watch.observe(box);
  });
})();
