// What scripts of data hand over: base64 of deflated bytes, as a page opened from a file may not fetch. Also in workers.
"use strict";

function inflated(packed) {
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}

// By key: packed until it is first read, then what its JSON says.
class Handed extends Map {
  async read(key) {
    if (typeof this.get(key) === "string") { this.set(key, await inflated(this.get(key)).json()); }
    return this.get(key);
  }
}
