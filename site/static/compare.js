// Two versions side by side. The newest pairs were judged by the command's own code; any other two nights are
// judged here, by judge.js, from the files of compare/.
"use strict";

(function () {
  const source = document.getElementById("comparisons");
  if (!source) { return; }
  const choices = JSON.parse(source.textContent), own = choices.engines[0][1];
  const versions = choices.nights.map(([id, label, hash]) => ({ id, label, hash }));
  const files = new Handed();
  window.compared = (name, packed) => files.set(name, packed);  // called by each file of compare/
  async function fileOf(name) {
    await script(`compare/${name}.js`);
    return files.read(name);
  }

  let newest = null;  // pairs, texts, words of the series, accepted levels
  async function theNewest() {
    if (newest) { return; }
    const told = await fileOf("newest");
    for (const level of told.accepted) { level.keys = new Set(level.keys); level.low = numberOf(level.low); level.high = numberOf(level.high); }
    newest = told;
  }

  const before = document.getElementById("before"), after = document.getElementById("after");
  const what = document.getElementById("what"), told = document.getElementById("told");
  const HEADLINES = {
    identical: ["pass", "Identical"], same: ["pass", "No regression"],
    regressed: ["fail", "Regressed"], not_comparable: ["none", "Not comparable"],
  };
  const MOST = 100;  // lines shown before the reader asks for all
  const STATES = { improved: "pass", fixed: "pass", not_comparable: "none", accepted: "none", new: "none", changed: "none" };

  function make(tag, attributes, ...children) {
    const element = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes || {})) { element.setAttribute(name, value); }
    element.append(...children);
    return element;
  }

  function verdict(state, word) {
    const icon = document.getElementById("icon-" + state).content.cloneNode(true);
    return make("span", { class: "verdict chip is-" + state }, icon, word);
  }

  function line(change) {
    const [word, red, page, test, series, old, now, said, sentence, since] = change;
    const head = make("th", { scope: "row" }, make("a", { href: page }, test), make("span", { class: "sub" }, series));
    const cell = make("td", { "data-name": "Verdict" });
    cell.append(verdict(red || STATES[word] || "none", said.toUpperCase()), make("span", { class: "sub" }, sentence));
    if (since) { cell.append(make("span", { class: "sub" }, since)); }
    return make("tr", { "data-word": word }, head,
      make("td", { class: "num", "data-name": "Before" }, old), make("td", { class: "num", "data-name": "After" }, now), cell);
  }

  function table(caption, heads, lines) {
    const row = make("tr");
    heads.forEach(([name, kind]) => row.append(make("th", kind ? { scope: "col", class: kind } : { scope: "col" }, name)));
    const body = make("tbody", {}, ...lines);
    return make("div", { class: "card scroll", tabindex: "0", role: "group", "aria-label": "Table" }, make("table", { class: "cards" }, make("caption", {}, caption), make("thead", {}, row), body));
  }

  // Nights stand engine by engine, ours first: which of them one is of, and its place there.
  function engineOf(place) {
    let left = place;
    const which = choices.engines.findIndex(([, count]) => { if (left < count) { return true; } left -= count; return false; });
    return { which, left };
  }

  async function nightAt(place) {
    const { which, left } = engineOf(place);
    return nightOf(await fileOf(`${choices.engines[which][0]}-${Math.floor(left / choices.block)}`), left % choices.block);
  }

  // Two nights judged here, in the form of a stored pair with texts in place of places.
  async function judged(i, j) {
    const [old, now] = [await nightAt(i), await nightAt(j)];
    const changes = [];
    for (const key of new Set([...old.samples.keys(), ...now.samples.keys()])) {
      const change = judgeSeries(key, old.samples.get(key) || null, now.samples.get(key) || null, old.side, now.side, newest.accepted);
      if (change) { changes.push(change); }
    }
    const counts = {};
    for (const { word } of changes) { counts[word] = (counts[word] || 0) + 1; }
    const verdictWord = overall(changes);
    const shown = changes.filter((c) => !["not_measured", "same", "identical"].includes(c.word)).sort(worseFirst);
    const words = (value, unit) => (value === null ? "–" : quantityOf(value, unit, 7));
    return {
      verdict: verdictWord, code: { regressed: 1, not_comparable: 3 }[verdictWord] || 0, frontiers: [],
      counts: Object.fromEntries(Object.entries(counts).sort(([a], [b]) => (a < b ? -1 : 1))),
      notes: ["Values, judged in this page by the command's rules. tracker compare judges the run times of whole ladders and the stability maps, too."],
      changes: shown.map((c) => {
        const [title, page, named] = newest.series[c.definition.test] || [c.definition.test, "index.html", {}];
        const series = named[c.key] || c.key;
        const { unit } = c.definition;
        return [c.word, c.red ? c.stands : "", page, title, series, words(c.before, unit), words(c.after, unit), c.name || c.word.replace(/_/g, " "), c.sentence, c.blame || c.accepted];
      }),
    };
  }

  // Two engines: each one's value of every gate, and whether it keeps the limit. Nothing is red, one is nearer.
  const APART = 0, NEITHER = 1, UNANSWERED = 2, BOTH = 3;  // worst first

  function answer(sample) {
    if (!sample) { return { stands: "none", text: "not asked" }; }
    const text = Number.isFinite(sample.value) ? quantityOf(sample.value, sample.definition.unit, 3) : spaced(sample.outcome);
    return { stands: againstLimit(sample.definition, sample), text };
  }

  async function enginesOf(i, j) {
    await theNewest();
    const nights = [await nightAt(i), await nightAt(j)], which = [i, j].map((place) => engineOf(place).which);
    const names = [i, j].map((place) => (place < own ? choices.engines[0][2] + " " : "") + versions[place].label.split(" · ")[0]), kept = [0, 0], answered = [0, 0], lines = [];
    for (const [title, what, page, limit, keys] of newest.gates) {
      const samples = nights.map((night, side) => night.samples.get(keys[which[side]])), said = samples.map(answer);
      if (!samples[0] && !samples[1]) { continue; }
      const stands = said.map((one) => one.stands), far = samples.map((s) => (s && Number.isFinite(s.value) ? badness(s.definition, s.value) : NaN));
      stands.forEach((one, side) => { kept[side] += one === "pass" ? 1 : 0; answered[side] += one === "none" ? 0 : 1; });
      const decades = far[0] > 0 && far[1] > 0 ? Math.log10(far[1]) - Math.log10(far[0]) : null;
      let group = BOTH, words = "both keep it";
      if (stands.includes("none")) { group = UNANSWERED; words = `only ${names[stands[0] === "none" ? 1 : 0]} answers`; } else if (stands[0] !== stands[1]) {
        group = APART;
        words = `only ${names[stands[0] === "fail" ? 1 : 0]} keeps it`;
      } else if (stands[0] === "fail") { group = NEITHER; words = "neither keeps it"; }
      if (stands[0] === "none" && stands[1] === "none") { words = "neither answers"; }
      if (decades !== null && Math.abs(decades) >= 0.05) { words += `; ${names[decades > 0 ? 0 : 1]} is ${fixed(Math.abs(decades), 1)} decades nearer`; }
      lines.push({ group, size: decades === null ? 0 : Math.abs(decades), title, what, page, limit, said, words });
    }
    lines.sort((a, b) => a.group - b.group || b.size - a.size);
    return { names, kept, answered, lines };
  }

  function showEngines({ names, kept, answered, lines }, i, j) {
    const shown = what.value === "red" ? lines.filter(({ group }) => group <= NEITHER) : lines;
    const cell = ({ stands, text }, name) => make("td", { class: "num", "data-name": name, "data-stands": stands }, make("div", { class: "value" }, text), verdict(stands, { pass: "PASS", fail: "FAIL", followed: "FOLLOWED" }[stands] || "NONE"));
    const row = (one) => make("tr", { "data-group": one.group },
      make("th", { scope: "row" }, make("a", { href: one.page }, one.title), make("span", { class: "sub" }, `${one.what}; limit ${one.limit}`)),
      cell(one.said[0], "Before"), cell(one.said[1], "After"), make("td", { "data-name": "Which keeps it" }, one.words));
    told.replaceChildren(
      make("p", { class: "sub" }, versions[i].label + " → " + versions[j].label),
      make("div", { class: "title-row" }, make("h2", {}, "Two engines on the same questions")),
      make("p", {}, [0, 1].map((side) => `${names[side]} keeps ${kept[side]} of ${answered[side]} limits it has an answer to`).join("; ") + "."),
      make("p", { class: "small soft" }, "Engines are not held to each other’s values: nothing here is red. Which is ahead at equal error stands on the page ", make("a", { href: "engines.html" }, "Engines"), "."),
      ...listed("Every gate that one of them was asked; first those that one of them breaks.", [["Gate"], [names[0], "num"], [names[1], "num"], ["Which keeps the limit"]], shown, row));
    folds(told);
  }

  // A table of as many lines as one reads, and the rest on request.
  function listed(caption, heads, shown, row) {
    if (!shown.length) { return []; }
    const parts = [table(caption, heads, shown.slice(0, MOST).map(row))];
    if (shown.length > MOST) {
      const body = parts[0].querySelector("tbody"), more = make("button", { class: "button", type: "button" }, "Show all " + shown.length);
      more.addEventListener("click", () => { body.append(...shown.slice(MOST).map(row)); more.remove(); });
      parts.push(make("p", { class: "buttons" }, more));
    }
    return parts;
  }

  async function pairOf(i, j) {
    await theNewest();
    const stored = newest.pairs[i + "," + j], plain = (lines) => lines.map((line) => line.map((place) => newest.texts[place]));
    return stored ? { ...stored, changes: plain(stored.changes), frontiers: plain(stored.frontiers) } : judged(i, j);
  }

  let turn = 0;  // a choice made while an earlier one is still loading overrules it
  async function show() {
    const mine = turn += 1;
    const i = versions.findIndex((v) => v.id === before.value), j = versions.findIndex((v) => v.id === after.value);
    if (i === j) {
      told.replaceChildren(make("div", { class: "card pad" }, verdict("pass", "IDENTICAL"), make("p", {}, "The same run on both sides.")));
      told.dataset.shown = `${i},${j}`;
      return;
    }
    const engines = engineOf(i).which !== engineOf(j).which;
    let pair;
    try { pair = await (engines ? enginesOf : pairOf)(i, j); } catch (error) {
      if (mine !== turn) { return; }
      delete told.dataset.shown;
      told.replaceChildren(make("div", { class: "card pad" }, make("p", { class: "is-fail" }, `These two cannot be compared: ${reasonOf(error)}.`)));
      return;
    }
    if (mine !== turn) { return; }
    if (engines) {
      showEngines(pair, i, j);
      told.dataset.shown = `${i},${j}`;
      return;
    }
    const [state, word] = HEADLINES[pair.verdict];
    const counts = Object.entries(pair.counts).map(([name, n]) => n + " " + name.replace(/_/g, " ")).join(", ");
    const parts = [
      make("p", { class: "sub" }, versions[i].label + " → " + versions[j].label),
      make("div", { class: "title-row" }, make("h2", {}, word), verdict(state, "EXIT CODE " + pair.code)),
      make("p", {}, counts + "."),
    ];
    pair.notes.forEach((note) => parts.push(make("p", { class: "small soft" }, note)));
    const shown = pair.changes.filter((c) => !what.value || (what.value === "red" ? c[1] : c[1] === what.value));
    parts.push(...listed("What is not the same, the worst first.", [["Series"], ["Before", "num"], ["After", "num"], ["Verdict"]], shown, line));
    if (pair.frontiers.length) {
      const lines = pair.frontiers.map(([test, configuration, ladder, time, error, work]) =>
        make("tr", {}, make("th", { scope: "row" }, test, make("span", { class: "sub" }, ladder)), make("td", { "data-name": "Configuration" }, configuration),
          make("td", { class: "num", "data-name": "Run time" }, time), make("td", { class: "num", "data-name": "Error" }, error), make("td", { class: "num", "data-name": "Work" }, work)));
      parts.push(make("section", {}, make("h2", {}, "At equal error, at equal time"), table("After divided by before; below 1 is better.",
        [["Test"], ["Configuration"], ["Run time at equal error", "num"], ["Error at equal time", "num"], ["Work at equal error", "num"]], lines)));
    }
    told.replaceChildren(...parts);
    folds(told);
    told.dataset.shown = `${i},${j}`;
  }

  function find(name) { return name && versions.find((v) => v.id === name || (v.hash && name.length > 3 && v.hash.startsWith(name))); }

  function restore() {
    const last = own - 1;
    before.value = (find(state.get("before")) || versions[last - 1]).id;
    after.value = (find(state.get("after")) || versions[last]).id;
    what.value = state.get("show") === "red" ? "red" : "";
    show();
  }

  function chosen() {
    state.set("before", before.value);
    state.set("after", after.value);
    state.set("show", what.value);
    show();
  }

  [before, after, what].forEach((element) => element.addEventListener("change", chosen));
  document.getElementById("swap").addEventListener("click", () => {
    [before.value, after.value] = [after.value, before.value];
    chosen();
  });
  for (const list of [before, after]) {
    list.append(...versions.map(({ id, label }) => make("option", { value: id }, label)).reverse());
  }
  addEventListener("hashchange", restore);
  document.getElementById("choice").hidden = false;
  restore();
})();
