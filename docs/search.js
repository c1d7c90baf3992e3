// The search of every page: sections that hold every word, those with the words in their heading first. What is searched
// comes as a script (search-sections.js, made by docs/reference.py), since a page opened from a folder may not fetch.
"use strict";
const MOST = 40, AROUND = 90;
const address = document.currentScript.dataset.sections, root = address.slice(0, -"search-sections.js".length);
const box = document.getElementById("mkdocs-search-query"), list = document.getElementById("mkdocs-search-results");

function passage(text, words) {
  const at = Math.max(0, text.toLowerCase().indexOf(words[0]) - AROUND), line = document.createElement("p");
  let rest = text.slice(at, at + 3 * AROUND);
  for (;;) {
    const hits = words.map((word) => [rest.toLowerCase().indexOf(word), word]).filter(([place]) => place >= 0).sort((a, b) => a[0] - b[0]);
    if (!hits.length) { break; }
    const [place, word] = hits[0], mark = document.createElement("mark");
    mark.textContent = rest.slice(place, place + word.length);
    line.append(rest.slice(0, place), mark);
    rest = rest.slice(place + word.length);
  }
  line.append(rest);
  return line;
}

function look() {
  if (typeof SECTIONS === "undefined") { return; }  // they are on their way, and look when they come
  const words = box.value.toLowerCase().split(/\s+/).filter(Boolean);
  const found = !words.length ? [] : SECTIONS.map(([place, page, heading, text]) => {
    const head = `${page} ${heading}`.toLowerCase(), all = `${head} ${text}`.toLowerCase();
    return words.every((word) => all.includes(word)) ? { place, page, heading, text, rank: words.filter((word) => head.includes(word)).length } : null;
  }).filter(Boolean).sort((a, b) => b.rank - a.rank);
  const count = document.createElement("p");
  count.setAttribute("role", "status");
  count.textContent = words.length ? `${found.length} section${found.length === 1 ? "" : "s"}` : "";
  list.replaceChildren(count);
  for (const one of found.slice(0, MOST)) {
    const link = document.createElement("a");
    link.href = root + one.place;
    link.textContent = one.page === one.heading ? one.page : `${one.page}: ${one.heading}`;
    list.append(link, passage(one.text, words));
  }
}

box.addEventListener("focus", () => {
  const tag = document.createElement("script");
  tag.src = address;
  tag.onload = look;
  document.head.append(tag);
}, { once: true });
box.addEventListener("input", look);
box.form.addEventListener("submit", (event) => event.preventDefault());
