// The page's own script: state in the address, charts, tables, filters. Works from a file, without a network.
"use strict";

// --- state: everything a reader chose stands in the address after #, so that a link shows the same view ---
const state = {
  read() {
    const hash = location.hash.slice(1);
    return new URLSearchParams(hash.includes("=") ? hash : "");
  },
  get(name) { return this.read().get(name) || ""; },
  set(name, value) {
    const all = this.read();
    if (value) { all.set(name, value); } else { all.delete(name); }
    all.sort();
    const hash = all.toString();
    history.replaceState(null, "", hash ? "#" + hash : location.pathname + location.search);
  },
};

function colour(name) { return getComputedStyle(document.documentElement).getPropertyValue(name).trim(); }

// A script of this site, once unless it fails; a page opened from a file may not fetch.
const scripts = new Map();
function script(address) {
  if (!scripts.has(address)) {
    scripts.set(address, new Promise((done, failed) => {
      const tag = document.createElement("script");
      tag.src = address;
      tag.onload = () => done();
      tag.onerror = () => { scripts.delete(address); failed(new Error(`${address} could not be loaded; reload the page`)); };
      document.head.append(tag);
    }));
  }
  return scripts.get(address);
}

// --- charts ---
// Where tonight.js did not come, the rest of the page works.
const EARLIER = typeof TONIGHT === "undefined" ? [] : TONIGHT.earlier;
const MEASURED = typeof TONIGHT === "undefined" ? "When this was measured is not known: tonight.js could not be loaded; reload the page." : TONIGHT.measured;

const chartData = new Handed();
const charted = (key, packed) => chartData.set(key, packed);  // called by the files of charts/

const parts = new Handed();  // by test, what its page says of tonight's run times
const told = (test, packed) => parts.set(test, packed);

let nights = [];  // day and commit of each
function nightsAre(all) {
  let day = "";
  nights = all.map(([own, commit]) => { day = own || day; return { day, commit }; });
}

// A chart over nights has what changed; what stands still is drawn on to tonight here.
function untilTonight(data) {
  const [first, end] = data.over, last = end === null ? nights.length - 1 : end;
  const named = (at) => (nights[at] ? `${nights[at].day}, ${nights[at].commit}` : "");
  const traces = data.data.map((trace) => {
    const style = trace.meta.style, made = { ...trace };
    if (style === "limit" || style === "reference") { return { ...made, x: [first, last] }; }
    if (trace === data.data[0] && end === null && trace.x.length && trace.x.at(-1) < last) {
      made.x = [...trace.x, last];
      made.y = [...trace.y, trace.y.at(-1)];
      if (trace.hovertext) { made.hovertext = [...trace.hovertext, trace.hovertext.at(-1).replace(/^[^\n]*/, named(last))]; }
    }
    if (!made.hovertext) {
      made.hovertext = made.x.map((at, i) => `${named(at)}\n${made.y[i] === null ? "no value" : Number(made.y[i].toPrecision(5))}`);
      made.hoverinfo = "text";
    }
    return made;
  });
  const count = Math.min(4, last - first + 1);
  const ticks = [...new Set([...Array(count).keys()].map((i) => Math.round(first + (i * (last - first)) / Math.max(1, count - 1))))];
  const days = ticks.map((at) => (nights[at] || { day: "" }).day), years = new Set(days.map((day) => day.slice(0, 4)));
  const words = new Set(days).size < days.length ? ticks.map((at) => nights[at].commit) : days.map((day) => (years.size < 2 ? day.slice(5) : day));
  const pad = 0.03 * (last - first) || 0.5;
  const xaxis = { ...data.layout.xaxis, type: "linear", range: [first - pad, last + pad], tickvals: ticks, ticktext: words, tickangle: 0 };
  return { data: traces, layout: { ...data.layout, xaxis } };
}

// The numbers of a chart as a table, made when a reader opens it.
const TABLE_ROWS = 60;
function tableOf(box, data) {
  const details = document.createElement("details"), summary = document.createElement("summary");
  summary.textContent = "Data table";
  details.append(summary);
  details.addEventListener("toggle", () => {
    if (details.open && details.children.length < 2) { details.append(tableWith(box, data)); scrollers(); }
  });
  return details;
}

function tableWith(box, data) {
  const { columns, rows } = data.data[0]?.type === "heatmap" ? cellsOf(data) : pointsOf(data);
  const every = Math.ceil(rows.length / TABLE_ROWS) || 1;
  const around = document.createElement("div"), table = document.createElement("table"), caption = table.createCaption();
  const title = box.querySelector("h3").textContent;
  around.className = "scroll";
  around.setAttribute("role", "region");
  around.setAttribute("aria-label", `Data: ${title} against ${columns[1]}`);
  caption.textContent = title + (every > 1 ? `; every ${every}th point, all of them in the data files` : "");
  const line = (part, cells, tag) => {
    const row = part.insertRow();
    for (const cell of cells) {
      const made = document.createElement(tag);
      made.className = "num";
      if (tag === "th") { made.scope = "col"; }
      made.textContent = cell;
      row.append(made);
    }
  };
  line(table.createTHead(), columns, "th");
  const body = table.createTBody();
  rows.filter((_, i) => i % every === 0).forEach((cells) => line(body, cells, "td"));
  around.append(table);
  return around;
}

function plainText(text) { return new DOMParser().parseFromString(String(text).replaceAll("<br>", " "), "text/html").body.textContent; }

function pointsOf(data) {
  const { xaxis, yaxis } = data.layout, number = (v) => (v === null ? "no value" : String(Number(v.toPrecision(6))));
  const shown = data.data.filter((trace) => trace.meta.style !== "limit" && (!trace.meta.night || trace.meta.night === earlierNight()));
  const name = (at) => (data.over ? nights[at]?.day || at : plainText(xaxis.ticktext?.[xaxis.tickvals.indexOf(at)] ?? number(at)));
  const rows = shown.flatMap((trace) => trace.x.map((at, i) => [plainText(trace.name), name(at), number(trace.y[i])]));
  return { columns: ["line", plainText(xaxis.title?.text || "x"), plainText(yaxis.title?.text || "value")], rows };
}

function cellsOf(data) {
  const { xaxis, yaxis } = data.layout, cells = data.data[0];
  const said = (text) => { const lines = text.split("\n"); return [lines[0], lines[1], lines[2]].map((one) => plainText(one).replace(/^.*: /, "")); };
  return { columns: [xaxis.title.text, yaxis.title.text, "outcome"].map(plainText), rows: cells.text.flat().map(said) };
}

const CONFIG = {
  responsive: true, displaylogo: false, showSendToCloud: false, plotlyServerURL: "", displayModeBar: "hover",
  modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d"], scrollZoom: false,
};
const CELLS = ["#0072b2", "#56b4e9", "#e69f00", "#d55e00", "#5b2333", "#8a939c"];

// The earlier night that stands in short dashes beside tonight: the reader's choice, or the first that is offered.
function earlierNight() {
  const offered = [...EARLIER.map(([key]) => key), "none"];
  return offered.includes(state.get("night")) ? state.get("night") : offered[0];
}

function dressTrace(trace) {
  const meta = trace.meta || {};
  const dressed = { ...trace }, lines = (texts) => (Array.isArray(texts) ? texts.map(lines) : texts.replaceAll("\n", "<br>"));
  for (const name of ["text", "hovertext"]) { if (trace[name]) { dressed[name] = lines(trace[name]); } }
  if (meta.role === "cells") {
    const last = CELLS.length - 1;
    dressed.colorscale = CELLS.flatMap((c, i) => [[i / CELLS.length, c], [(i + 1) / CELLS.length, c]]);
    return { ...dressed, zmin: -0.5, zmax: last + 0.5, showscale: false, xgap: 1, ygap: 1 };
  }
  if (meta.role === "prediction") {
    return { ...dressed, line: { color: colour("--ink"), width: 2.5 }, fillcolor: "rgba(0,0,0,0)" };
  }
  if (meta.night) { dressed.visible = meta.night === earlierNight(); }
  const paint = meta.style === "limit" || meta.style === "failed" || meta.style === "broken" ? colour("--fail-fill") : colour("--c" + meta.colour);
  dressed.line = { width: meta.style === "front" ? 1.5 : 2, ...trace.line, color: paint };
  if (meta.style === "front") { dressed.opacity = 0.65; }
  if (trace.marker) {
    const crowded = trace.x.length > 60 && meta.style === "both";
    dressed.marker = { ...trace.marker, color: paint, size: meta.style === "failed" || meta.style === "broken" ? 10 : crowded ? 3 : 7 };
    if (meta.style === "failed" || meta.style === "broken") { dressed.marker.line = { width: 2.5, color: paint }; }
  }
  return dressed;
}

function dressLayout(layout, title) {
  const grid = colour("--line-soft");
  const ink = colour("--ink-2");
  const axis = (given) => ({
    gridcolor: grid, linecolor: colour("--line"), zerolinecolor: colour("--line"), tickcolor: colour("--line"),
    automargin: true, exponentformat: "power", ...given,
    ...(given && given.range ? { range: [...given.range] } : {}),  // the library writes into what it is given
    title: { ...(given || {}).title, font: { color: colour("--ink"), size: 13 }, standoff: 8 },
  });
  const shapes = (layout.shapes || []).map((shape) => {
    if (shape.meta === "ring") {
      const r = shape.radius;
      return { type: "circle", x0: -r, x1: r, y0: -r, y1: r, layer: "below", line: { color: colour("--line"), width: 1 } };
    }
    const log = layout.yaxis.type === "log";
    const band = { type: "rect", xref: "paper", x0: 0, x1: 1, layer: "below", line: { width: 0 }, fillcolor: colour("--c2"), opacity: 0.16 };
    return { ...band, y0: shape.low === null ? (log ? 1e-300 : 0) : shape.low, y1: shape.high };
  });
  const onLine = { xref: "paper", x: 1, xanchor: "right", borderpad: 1 };
  const annotations = (layout.annotations || []).map((a) => ({ showarrow: false, ...(a.meta === "line" ? onLine : {}), font: { size: 11, color: ink, shadow: "auto" }, yanchor: "bottom", ...a }));
  return {
    ...layout, shapes, annotations, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: 12, color: ink },
    xaxis: axis(layout.xaxis), yaxis: axis(layout.yaxis), margin: { l: 58, r: 14, t: 12, b: 46 },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom", font: { size: 11 } },
    hoverlabel: { bgcolor: colour("--raised"), bordercolor: colour("--line"), font: { color: colour("--ink"), size: 12.5 }, align: "left" },
    modebar: { orientation: "v", bgcolor: "rgba(0,0,0,0)", color: colour("--ink-3"), activecolor: colour("--accent") },
    hovermode: "closest", dragmode: "zoom", colorway: ["#0072b2"],
  };
}

// Our own marks of a logarithmic axis fit the whole chart; a part of it is marked by the library.
function freeTicks(layout) {
  for (const axis of [layout.xaxis, layout.yaxis]) {
    if (axis.type === "log") { axis.tickmode = "auto"; axis.minor = { showgrid: false }; axis.dtick = "D2"; }
  }
}

function rangesOf(name) {
  const parts = state.get("z." + name).split(",").map(Number);
  return parts.length === 4 && parts.every(Number.isFinite) ? parts : null;
}

function drawChart(box) {
  const plot = box.querySelector(".plot");
  const given = chartData.get(box.dataset.key), data = given.over ? untilTonight(given) : given;
  const layout = dressLayout(data.layout);
  const zoom = rangesOf(box.id);
  if (zoom) {
    layout.xaxis.range = zoom.slice(0, 2);
    layout.yaxis.range = zoom.slice(2);
    freeTicks(layout);
  }
  plot.hidden = false;
  if (!box.classList.contains("drawn")) { box.append(tableOf(box, { ...data, over: given.over })); }
  box.classList.add("drawn");
  const drawing = Plotly.react(plot, data.data.map(dressTrace), layout, CONFIG).then(() => { box.dataset.drawn = ""; });
  if (!plot.dataset.live) {
    plot.dataset.live = "1";
    plot.on("plotly_relayout", () => {
      const words = (axes) => [...axes.xaxis.range, ...axes.yaxis.range].map((v) => Number(v.toPrecision(6))).join(",");
      const now = words(plot.layout);
      if (now === plot.dataset.shown) { return; }
      plot.dataset.shown = now;
      state.set("z." + box.id, data.layout.xaxis.range && data.layout.yaxis.range && now === words(data.layout) ? "" : now);
      drawChart(box);
    });
  }
  return drawing;
}

function charts() {
  const boxes = document.querySelectorAll("figure.chart[data-file]");
  if (!boxes.length || typeof Plotly === "undefined") { return; }
  const seen = new Set();
  const show = async (box) => {
    try {
      await script(box.dataset.file);
      if ((await chartData.read(box.dataset.key)).over) {
        await script(box.dataset.file.replace(/[^/]*$/, "nights.js"));
        if (!nights.length) { throw new Error(DAMAGED); }
      }
      seen.add(box);
      await drawChart(box);
    } catch (error) {
      seen.delete(box);
      missing(box, reasonOf(error));
    }
  };
  const watch = new IntersectionObserver((entries) => {
    for (const entry of entries) {
      if (entry.isIntersecting) { watch.unobserve(entry.target); show(entry.target); }
    }
  }, { rootMargin: "600px 0px" });
  boxes.forEach((box) => watch.observe(box));
  document.addEventListener("theme", () => seen.forEach(drawChart));
  addEventListener("hashchange", () => seen.forEach(drawChart));
  const tools = document.getElementById("earlier"), choice = document.getElementById("night");
  if (tools) {
    for (const [key, words] of [...EARLIER, ["none", "none"]]) { choice.append(new Option(words, key)); }
    const restore = () => { choice.value = earlierNight(); };
    choice.addEventListener("change", () => {
      state.set("night", choice.selectedIndex ? choice.value : "");
      seen.forEach(drawChart);
    });
    addEventListener("hashchange", restore);
    tools.hidden = !EARLIER.length;
    restore();
  }
}

function missing(box, reason) {
  const note = document.createElement("p");
  note.className = "chart-note";
  note.textContent = `This chart is not drawn: ${reason}.`;
  box.querySelector(".plot").hidden = true;
  box.append(note);
}

// What is another every night stands in scripts, so that a page stands still as long as its values do.
async function tonight() {
  const measured = document.getElementById("measured-when"), times = document.getElementById("run-times");
  if (measured) {
    measured.textContent = MEASURED;
    measured.hidden = false;
  }
  if (!times) { return; }
  let text;  // made by the templates, as the page itself
  try {
    await script(times.dataset.file);
    text = await parts.read(times.dataset.test);
  } catch (error) {
    const note = document.createElement("p");
    note.className = "small soft";
    note.textContent = `The run times are not shown: ${reasonOf(error)}.`;
    times.replaceChildren(note);
    return;
  }
  if (text) { times.innerHTML = text; }
  folds(times);
  scrollers();
}

// --- tables ---
function sortable(table) {
  table.querySelectorAll("thead th[aria-sort]").forEach((head) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => sortBy(table, head, head.getAttribute("aria-sort") === "ascending"));
  });
}

function sortBy(table, head, down) {
  const column = head.cellIndex;
  const body = table.tBodies[0];
  const key = (line) => {
    const cell = line.cells[column];
    const given = cell.dataset.value;
    return given !== undefined && given !== "" && !Number.isNaN(Number(given)) ? Number(given) : cell.textContent.trim();
  };
  const compare = (a, b) => (typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b)));
  const lines = [...body.rows].sort((a, b) => (down ? -1 : 1) * compare(key(a), key(b)));
  body.append(...lines);
  table.querySelectorAll("thead th[aria-sort]").forEach((th) => th.setAttribute("aria-sort", "none"));
  head.setAttribute("aria-sort", down ? "descending" : "ascending");
}

// --- long lists: the first entries and a button for the rest ---
const FIRST = { charts: { wide: 12, narrow: 5 }, rows: { wide: 40, narrow: 5 } };  // as site.css hides them

function fold(list) {
  const kind = list.tagName === "TBODY" ? "rows" : "charts", first = FIRST[kind], count = list.children.length;
  if (count <= first.narrow + 1 || list.dataset.fold) { return; }
  list.dataset.fold = kind;
  const head = list.querySelector(":scope > tr.topic");  // of a topic the line for the rest stays in the table
  const button = document.createElement("button"), line = document.createElement(head ? "tr" : "p");
  button.type = "button";
  button.className = "button";
  button.textContent = kind === "rows" ? `Show all ${count - (head ? 1 : 0)} rows` : "Show all of them";
  button.addEventListener("click", () => {
    const next = [...list.children].find((entry) => !entry.checkVisibility());
    unfold(list);
    next?.querySelector("a, summary, button")?.focus();
  });
  line.className = count > first.wide ? "fold-more" : "fold-more narrow";
  if (head) {
    const cell = document.createElement("td");
    cell.colSpan = head.cells[0].colSpan;
    cell.append(button);
    line.append(cell);
    list.append(line);
  } else {
    line.append(button);
    (list.closest(".scroll") || list).after(line);
  }
  list.foldLine = line;
}

function unfold(list) {
  list.dataset.fold = "open";
  list.foldLine?.remove();
}

function folds(within = document) {
  within.querySelectorAll(".card.scroll > table > tbody, .cause > .scroll > table > tbody, .charts").forEach(fold);
}

// What an address names, or a reader looks for, is not hidden.
function unfoldTo(element) {
  const list = element?.parentElement?.closest("[data-fold]");
  if (list) { unfold(list); unfoldTo(list); }
}

// --- the filter of a list: what it hides is a line of a table, a chart, or a group of lines, with data-state ---
function filter() {
  const tools = document.getElementById("filter");
  if (!tools) { return; }
  const search = document.getElementById("search"), show = document.getElementById("show"), none = document.getElementById("none-found");
  const groups = [...document.querySelectorAll("details.cause")];
  const lines = groups.length ? groups : [...tools.parentElement.querySelectorAll(".charts .cell, tbody tr:not(.topic, .fold-more)")];
  const known = new Map();
  const textOf = (element) => {
    if (!known.has(element)) { known.set(element, `${element.dataset.search || ""} ${element.textContent}`.toLowerCase()); }
    return known.get(element);
  };
  const apply = () => {
    const words = search.value.toLowerCase().split(/[\s:,_-]+/).filter(Boolean);  // in any order
    const fits = (element) => words.every((word) => textOf(element).includes(word));
    const kind = show ? show.value : "";
    if (words.length || kind) { document.querySelectorAll("[data-fold]").forEach(unfold); }
    lines.forEach((line) => {
      line.hidden = !(fits(line) && (!kind || line.dataset.state === kind));
      const head = line.querySelector("summary");
      if (head) {  // of a group only the series that fit, unless the group itself does
        const whole = fits(head);
        line.querySelectorAll("tbody tr").forEach((row) => { row.hidden = !whole && !fits(row); });
        if (words.length && !whole && !line.hidden) { line.open = true; }
      }
    });
    document.querySelectorAll("tr.topic").forEach((head) => {  // gone with the last of its lines
      head.hidden = [...head.parentElement.rows].every((row) => row === head || row.hidden);
    });
    if (none) { none.hidden = lines.some((line) => !line.hidden) || !lines.length; }
  };
  const restore = () => { search.value = state.get("q"); if (show) { show.value = state.get("show"); } apply(); };
  search.addEventListener("input", () => { state.set("q", search.value.trim()); apply(); });
  show?.addEventListener("change", () => { state.set("show", show.value); apply(); });
  addEventListener("hashchange", restore);
  tools.hidden = false;
  restore();
}

// --- groups of charts of which the reader sees one kind ---
function switches() {
  document.querySelectorAll(".switch[data-name]").forEach((group) => {
    const name = group.dataset.name;
    const buttons = [...group.querySelectorAll("button")];
    const apply = () => {
      const chosen = state.get(name) || buttons[0].value;
      buttons.forEach((b) => b.setAttribute("aria-pressed", String(b.value === chosen)));
      document.querySelectorAll(`[data-${name}]`).forEach((part) => { part.hidden = part.dataset[name] !== chosen; });
    };
    buttons.forEach((b) => b.addEventListener("click", () => { state.set(name, b.value === buttons[0].value ? "" : b.value); apply(); }));
    addEventListener("hashchange", apply);
    group.hidden = false;
    apply();
  });
}

function openDetails() {
  const meant = () => location.hash.length > 1 && !location.hash.includes("=") && document.querySelector(`details[id="${CSS.escape(location.hash.slice(1))}"]`);
  const named = () => location.hash.length > 1 && !location.hash.includes("=") && document.getElementById(location.hash.slice(1));
  const open = () => { const folded = named(); if (folded && folded.closest("[data-fold]")) { unfoldTo(folded); folded.scrollIntoView(); } const box = meant(); if (box) { box.open = true; box.scrollIntoView(); } };
  addEventListener("hashchange", open);
  open();
  document.querySelectorAll("details[id]").forEach((box) => {
    box.open = state.get("open").split(" ").includes(box.id) || box.open;
    box.addEventListener("toggle", () => {
      const open = [...document.querySelectorAll("details[id][open]")].map((d) => d.id).join(" ");
      state.set("open", open);
    });
  });
}

function late() {
  const note = document.getElementById("late");
  if (!note) { return; }
  const days = Math.floor((Date.now() - Date.parse(note.dataset.started)) / 864e5);
  if (days >= 2) {
    note.textContent = `The newest night is ${days} days old. Nothing was measured since, or the nightly job has stopped.`;
    note.hidden = false;
  }
}

// A table that fits needs no stop of the keyboard's.
function scrollers() {
  document.querySelectorAll(".scroll").forEach((box) => {
    if (box.scrollWidth > box.clientWidth) { box.tabIndex = 0; } else { box.removeAttribute("tabindex"); }
  });
}

charts();
tonight();
scrollers();
addEventListener("resize", scrollers);
addEventListener("load", scrollers);
const grown = new ResizeObserver(scrollers);  // pages as long as the report are laid out part by part
document.querySelectorAll(".scroll > *").forEach((content) => grown.observe(content));
document.addEventListener("toggle", scrollers, true);
document.querySelectorAll("table.sortable").forEach(sortable);
folds();
filter();
switches();
openDetails();
late();
document.querySelectorAll(".scroll > svg.nights").forEach((svg) => { svg.parentElement.scrollLeft = svg.parentElement.scrollWidth; });
// The page says itself when every script has run: a test that drives it need not guess.
document.addEventListener("DOMContentLoaded", () => { document.documentElement.dataset.ready = ""; });
