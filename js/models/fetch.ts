import { fetchFile } from "../platform/index.js";
import { throwIfAborted } from "./abort.js";
import { modelError } from "./errors.js";
import type { ModelCallOptions } from "./types.js";

/** Name of the browser cache for weights. */
const CACHE = "depthstitch-models";

/**
 * Fetches a file, or takes it from the browser's cache. In Node `file:` URLs are read from disk, and nothing is cached.
 *
 * @throws {StitchError} `model-load-failed` with the URL and, if the server responded, its `status`; `aborted`.
 */
export async function fetchBytes(
  address: string | URL,
  cached: boolean,
  { onProgress, signal }: ModelCallOptions,
): Promise<Uint8Array> {
  const url = String(address);
  const fail = (cause: unknown) => {
    throwIfAborted(signal);
    throw modelError(`${url} could not be fetched`, cause);
  };
  const cache = cached && /^(https?:|[^:]*$)/.test(url) ? await openCache() : undefined;
  const hit = await cache?.match(url);
  if (hit) return read(hit, fail, onProgress);
  const response = (await fetchFile(address, signal ? { signal } : {}).catch(fail)) as Response;
  if (!response.ok) {
    const { status, statusText } = response;
    throw modelError(`${url} responded ${status} ${statusText}`.trim(), undefined, { status });
  }
  // Servers of single-page applications answer every URL with a page.
  const type = response.headers.get("Content-Type") ?? "";
  if (type.startsWith("text/html")) throw modelError(`${url} is an HTML page, not a network`);
  const bytes = await read(response, fail, onProgress);
  // Failing to cache, for example on a full disk, is not an error.
  await cache?.put(url, new Response(bytes)).catch(() => undefined);
  return bytes;
}

async function openCache(): Promise<Cache | undefined> {
  // There is no cache in Node, on insecure origins, and if the user disabled it.
  return globalThis.caches?.open(CACHE).catch(() => undefined);
}

async function read(
  response: Response,
  fail: (cause: unknown) => void,
  onProgress: ModelCallOptions["onProgress"],
): Promise<Uint8Array<ArrayBuffer>> {
  const encoded = response.headers.has("Content-Encoding");
  const total = encoded ? 0 : Number(response.headers.get("Content-Length") ?? 0);
  const parts: Uint8Array[] = [];
  let loaded = 0;
  const report = (fraction: number) => onProgress?.({ stage: "download", fraction, loaded, total });
  const reader = response.body?.getReader();
  for (;;) {
    const part = await reader?.read().catch(fail);
    if (!part?.value) break;
    parts.push(part.value);
    loaded += part.value.length;
    if (loaded < total || total === 0) report(total === 0 ? 0 : loaded / total);
  }
  report(1);
  const bytes = new Uint8Array(loaded);
  let at = 0;
  for (const part of parts) {
    bytes.set(part, at);
    at += part.length;
  }
  return bytes;
}
