// What scripts of data hand over: base64 of deflated bytes, as a page opened from a file may not fetch. Also in workers.
"use strict";

const DAMAGED = "a file of numbers is damaged; reload the page";

// Errors of ours say what lacks. Any other comes of data that are not what they should be; the browser's log has it.
function reasonOf(error) {
  if (error.constructor === Error) { return error.message; }
  console.error(error);
  return DAMAGED;
}

function inflated(packed) {
  if (typeof DecompressionStream === "undefined") { throw new Error("this browser has no DecompressionStream, which unpacks the numbers; newer ones have it"); }
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}

// By key: packed until it is first read, then what its JSON says, the same for all who read it meanwhile.
class Handed extends Map {
  reading = new Map();

  read(key) {
    if (!this.reading.has(key)) { this.reading.set(key, this.unpack(key)); }
    return this.reading.get(key);
  }

  async unpack(key) {
    if (!this.has(key)) { throw new Error(DAMAGED); }  // the script was cut short: it ran, but handed over nothing
    this.set(key, await inflated(this.get(key)).json());
    return this.get(key);
  }
}
