/** The service: requests with the key, errors as its sentences, and a job's events. */

const KEY = "brdf-api-key";

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

/** @type {() => Promise<void>} what gets a key from the person; resolves when there is one to try */
let askForKey = async () => undefined;

/** @param {() => Promise<void>} ask */
export function onMissingKey(ask) {
  askForKey = ask;
}

/** @param {string} key kept for this tab only */
export function useKey(key) {
  sessionStorage.setItem(KEY, key);
}

/** @returns {boolean} */
export function hasKey() {
  return sessionStorage.getItem(KEY) !== null;
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
    const key = sessionStorage.getItem(KEY);
    if (key !== null) headers.set("authorization", `Bearer ${key}`);
    const answer = await sent(path, { ...rest, headers, ...(json === undefined ? {} : { body: JSON.stringify(json) }) });
    if (answer.ok) return answer;
    if (answer.status !== 401) throw new Refusal(answer.status, await answer.json().catch(() => ({})));
    await askForKey();
  }
}

/**
 * @param {string} path
 * @param {RequestInit} options
 */
async function sent(path, options) {
  try {
    return await fetch(path, options);
  } catch (error) {
    if (error instanceof DOMException && error.name === "AbortError") throw error;
    throw new Error("The service could not be reached. Check that it runs, and try again.");
  }
}

/**
 * The JSON that a path answers with.
 * @param {string} path
 * @param {RequestInit & {json?: unknown}} options
 * @returns {Promise<any>}
 */
export async function get(path, options = {}) {
  return (await ask(path, options)).json();
}

/**
 * Every event of a fit, until it has ended; a stream that breaks is taken up again.
 * @param {string} id
 * @param {(event: any) => void} hear
 * @param {AbortSignal} signal
 */
export async function follow(id, hear, signal) {
  for (let last = "", over = false; !over && !signal.aborted; ) {
    try {
      const headers = { accept: "text/event-stream", ...(last ? { "last-event-id": last } : {}) };
      const answer = await ask(`/v1/fits/${id}/events`, { headers, signal });
      for await (const event of events(/** @type {ReadableStream} */ (answer.body))) {
        last = event.id || last;
        over = event.name !== "progress";
        hear(event.data);
      }
    } catch (error) {
      if (signal.aborted || error instanceof Refusal) throw error;
    }
    if (!over) await new Promise((done) => setTimeout(done, 1000));
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
