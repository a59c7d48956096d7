/** The service: requests with the key, errors as its sentences, and a job's events. */

const KEY = "brdf-api-key";
const PLAIN = /^[\x21-\x7e]+$/; // what a header may carry
const AGAIN = [408, 429, 500, 502, 503, 504]; // refusals that may be over soon
const LONGEST = 10_000; // between two attempts [ms]

/** An error that the service tells in one sentence. */
export class Refusal extends Error {
  /**
   * @param {number} status
   * @param {{detail?: string, field?: string}} problem
   */
  constructor(status, problem) {
    super(problem.detail ?? `The service answered with status ${status}.`);
    this.status = status;
    this.field = problem.field ?? null;
  }
}

/** An error that lies between the page and the service. */
export class Unreached extends Error {}

/** @type {() => void} what is done once the service answers after it did not */
let reached = () => undefined;
let lost = false;

/** @param {() => void} listener */
export function onReached(listener) {
  reached = listener;
}

/** @type {() => Promise<void>} what gets a key from the person; resolves when there is one to try */
let askForKey = async () => undefined;

/** @param {() => Promise<void>} ask */
export function onMissingKey(ask) {
  askForKey = ask;
}

/** Keep a key, for this tab only; throws where no service could have given it. @param {string} key */
export function useKey(key) {
  if (!PLAIN.test(key)) throw new Error("Expected a key of plain letters, digits and signs, without spaces or accents. Copy it once more.");
  sessionStorage.setItem(KEY, key);
}

/** @returns {string | null} */
function storedKey() {
  const key = sessionStorage.getItem(KEY);
  return key !== null && PLAIN.test(key) ? key : null;
}

/** @returns {boolean} */
export function hasKey() {
  return storedKey() !== null;
}

/**
 * The response to a request; asks for a key where one is needed, and throws a Refusal where the service refuses.
 * @param {string} path
 * @param {RequestInit & {json?: unknown}} options
 * @returns {Promise<Response>}
 */
export async function ask(path, options = {}) {
  const { json, ...rest } = options;
  const headers = new Headers(options.headers);
  if (json !== undefined) headers.set("content-type", "application/json");
  for (;;) {
    const key = storedKey();
    if (key !== null) headers.set("authorization", `Bearer ${key}`);
    const answer = await sent(path, { ...rest, headers, ...(json === undefined ? {} : { body: JSON.stringify(json) }) });
    if (answer.ok) return answer;
    if (answer.status !== 401) throw new Refusal(answer.status, await answer.json().catch(() => ({})));
    if (storedKey() === key) await askForKey(); // else somebody has given another one meanwhile
  }
}

/**
 * @param {string} path
 * @param {RequestInit} options
 */
async function sent(path, options) {
  try {
    const answer = await fetch(path, options);
    if (lost) reached();
    lost = false;
    return answer;
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    lost = true;
    throw new Unreached("The service could not be reached. Check that it runs, and try again.");
  }
}

/**
 * The JSON that a path answers with; throws where it comes after the signal that the request carries has been given.
 * @param {string} path
 * @param {RequestInit & {json?: unknown}} options
 * @returns {Promise<any>}
 */
export async function get(path, options = {}) {
  const found = await (await ask(path, options)).json();
  options.signal?.throwIfAborted();
  return found;
}

/**
 * A fit that has ended, after every event of it on the way; what is lost on the way is told, and asked for again.
 * @param {string} id
 * @param {(event: any) => void} hear
 * @param {(error: unknown) => void} lost is told why nothing is heard, and null once it is heard again
 * @param {AbortSignal} signal
 * @returns {Promise<any>}
 */
export async function followed(id, hear, lost, signal) {
  let last = "";
  let over = false;
  for (let pause = 500; ; pause = Math.min(2 * pause, LONGEST)) {
    try {
      if (over) return await get(`/v1/fits/${id}`, { signal });
      const headers = { accept: "text/event-stream", ...(last ? { "last-event-id": last } : {}) };
      const answer = await ask(`/v1/fits/${id}/events`, { headers, signal });
      lost(null);
      for await (const event of events(/** @type {ReadableStream} */ (answer.body))) {
        signal.throwIfAborted();
        last = event.id || last;
        over = event.name !== "progress";
        pause = 500;
        hear(event.data);
      }
      if (over) continue;
    } catch (error) {
      if (signal.aborted || (error instanceof Refusal && !AGAIN.includes(error.status))) throw error;
      lost(error);
    }
    await new Promise((done) => setTimeout(done, pause));
  }
}

/**
 * Server-sent events of a stream. Read by hand, because EventSource sends no key.
 * @param {ReadableStream} stream
 */
async function* events(stream) {
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (;;) {
    const { value, done } = await reader.read();
    if (done) return;
    text = (text + value).replaceAll("\r\n", "\n");
    const whole = text.split("\n\n");
    text = whole.pop() ?? "";
    for (const block of whole) {
      const field = (/** @type {string} */ name) =>
        block.split("\n").filter((line) => line.startsWith(`${name}:`)).map((line) => line.slice(name.length + 1).trim()).join("\n");
      if (field("data")) yield { name: field("event"), id: field("id"), data: JSON.parse(field("data")) };
    }
  }
}
