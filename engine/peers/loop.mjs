// What every engine in JavaScript shares: the task as JSON on standard input, and the loop with its clock; the answer
// is a line of JSON and the float64 states. A state is 13 numbers a body: position, orientation (w, x, y, z),
// velocity, angular velocity (SI, world axes); then the forces of constraints that are asked for, one number for a rod's
// tension, six for a joint's force and torque; then the deepest penetration, if asked for.
import { readFileSync, writeSync } from "node:fs";

const BLOCK = 1000; // steps between two looks at the clock where nothing is recorded between
const began = performance.now();

export const read = () => JSON.parse(readFileSync(0, "utf8"));

/// Take all steps of the task and answer. `step()` takes one, `state()` is what is to be kept of now.
export function run(task, step, state) {
  const width = state().length;
  const states = new Float64Array((task.every_step ? task.steps + 1 : 2) * width);
  let kept = 0;
  const keep = () => states.set(state(), kept++ * width);
  const started = performance.now();
  let spent = 0;
  let done = 0;
  let status = "completed";
  let failure = "";
  keep();
  while (done < task.steps && status === "completed") {
    const stop = task.every_step ? done + 1 : Math.min(done + BLOCK, task.steps);
    const from = performance.now();
    for (; done < stop; done += 1) step();
    const now = performance.now();
    spent += now - from;
    if (task.every_step || done === task.steps) keep();
    if (!state().every(Number.isFinite)) {
      status = "not_finite";
      failure = `a value is not finite by step ${done}`;
    } else if (task.time_limit !== null && now - started > 1000 * task.time_limit && done < task.steps) {
      status = "timed_out";
      failure = `the time limit of ${task.time_limit} s was reached before step ${done + 1}`;
    }
  }
  const seconds = { seconds: spent / 1000, setup_seconds: (started - began) / 1000 };
  const head = JSON.stringify({ kept, steps: done, status, failure, ...seconds });
  answer(Buffer.concat([Buffer.from(`${head}\n`), Buffer.from(states.buffer, 0, 8 * kept * width)]));
}

function answer(bytes) {
  for (let sent = 0; sent < bytes.length; ) {
    try {
      sent += writeSync(1, bytes, sent);
    } catch (error) {
      if (error.code !== "EAGAIN") throw error; // the reader is slower than we are
    }
  }
}
