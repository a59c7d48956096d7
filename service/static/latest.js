/** Work of which only the latest matters. */

/**
 * A function that ends what it began before, and gives the signal of what begins now. Requests that carry the signal
 * throw where their answer is late, so that it never takes the place of a newer one.
 * @returns {() => AbortSignal}
 */
export function newest() {
  let running = new AbortController();
  return () => {
    running.abort();
    running = new AbortController();
    return running.signal;
  };
}

/** Begin what decides which measurement and which fits the page is about; what decided that before has ended. */
export const subject = newest();

/**
 * A function that runs the task after a pause without another call; a call ends the task of the one before.
 * @param {number} pause [ms]
 * @param {(signal: AbortSignal) => Promise<void>} task
 * @param {(error: unknown) => void} fail
 * @returns {() => void}
 */
export function latest(pause, task, fail) {
  const begin = newest();
  let timer = 0;
  return () => {
    clearTimeout(timer);
    const mine = begin();
    timer = window.setTimeout(() => task(mine).catch((error) => mine.aborted || fail(error)), pause);
  };
}
