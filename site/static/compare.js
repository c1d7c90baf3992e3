// Two versions side by side. Every verdict was made by the command's own code; this only shows it.
"use strict";

(function () {
  const source = document.getElementById("comparisons");
  if (!source) { return; }
  const { versions, pairs, texts } = JSON.parse(source.textContent);
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
    const [word, red, page, test, series, old, now, said, sentence, since] = change.map((place) => texts[place]);
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
    return make("div", { class: "card scroll" }, make("table", { class: "cards" }, make("caption", {}, caption), make("thead", {}, row), body));
  }

  function show() {
    const i = versions.findIndex((v) => v.id === before.value), j = versions.findIndex((v) => v.id === after.value);
    if (i === j) {
      told.replaceChildren(make("div", { class: "card pad" }, verdict("pass", "IDENTICAL"), make("p", {}, "The same run on both sides.")));
      return;
    }
    const pair = pairs[i + "," + j];
    const [state, word] = HEADLINES[pair.verdict];
    const counts = Object.entries(pair.counts).map(([name, n]) => n + " " + name.replace(/_/g, " ")).join(", ");
    const parts = [
      make("p", { class: "sub" }, versions[i].label + " → " + versions[j].label),
      make("div", { class: "title-row" }, make("h2", {}, word), verdict(state, "EXIT CODE " + pair.code)),
      make("p", {}, counts + "."),
    ];
    pair.notes.forEach((note) => parts.push(make("p", { class: "small soft" }, note)));
    const shown = pair.changes.filter((c) => !what.value || texts[c[1]] === what.value);
    if (shown.length) {
      parts.push(table("What is not the same, the worst first.",
        [["Series"], ["Before", "num"], ["After", "num"], ["Verdict"]], shown.slice(0, MOST).map(line)));
    }
    if (shown.length > MOST) {
      const body = parts[parts.length - 1].querySelector("tbody");
      const more = make("button", { class: "button", type: "button" }, "Show all " + shown.length);
      more.addEventListener("click", () => { body.append(...shown.slice(MOST).map(line)); more.remove(); });
      parts.push(make("p", { class: "buttons" }, more));
    }
    if (pair.frontiers.length) {
      const lines = pair.frontiers.map((f) => {
        const [test, configuration, ladder, time, error, work] = f.map((place) => texts[place]);
        return make("tr", {}, make("th", { scope: "row" }, test, make("span", { class: "sub" }, ladder)), make("td", { "data-name": "Configuration" }, configuration),
          make("td", { class: "num", "data-name": "Run time" }, time), make("td", { class: "num", "data-name": "Error" }, error), make("td", { class: "num", "data-name": "Work" }, work));
      });
      parts.push(make("section", {}, make("h2", {}, "At equal error, at equal time"), table("After divided by before; below 1 is better.",
        [["Test"], ["Configuration"], ["Run time at equal error", "num"], ["Error at equal time", "num"], ["Work at equal error", "num"]], lines)));
    }
    told.replaceChildren(...parts);
  }

  function find(name) { return name && versions.find((v) => v.id === name || (v.hash && name.length > 3 && v.hash.startsWith(name))); }

  function restore() {
    const last = versions.length - 1;
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
  addEventListener("hashchange", restore);
  document.getElementById("choice").hidden = false;
  restore();
})();
