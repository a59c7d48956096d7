/** Work of which only the latest matters. */

/**
 * A function that runs the task after a pause without another call; a call ends the task of the one before.
 * @param {number} pause [ms]
 * @param {(signal: AbortSignal) => Promise<void>} task
 * @param {(error: unknown) => void} fail
 * @returns {() => void}
 */
export function latest(pause, task, fail) {
  let running = new AbortController();
  let timer = 0;
  return () => {
    running.abort();
    clearTimeout(timer);
    const mine = (running = new AbortController());
    timer = window.setTimeout(() => {
      task(mine.signal).catch((error) => mine.signal.aborted || fail(error));
    }, pause);
  };
}
