import { fetchFile } from "#platform";
import { throwIfAborted } from "./abort.js";
import { modelError } from "./errors.js";
import type { ModelCallOptions } from "./types.js";

/** The browser's cache that weights are kept in. */
const CACHE = "depthstitch-models";

/**
 * The bytes behind an address, from the browser's cache if they have been fetched before. In Node, `file:` addresses are
 * read from disk, and nothing is cached.
 *
 * @throws {StitchError} `model-load-failed` with the address and, where there was an answer, its `status`; `aborted`.
 */
export async function fetchBytes(
  address: string | URL,
  cached: boolean,
  { onProgress, signal }: ModelCallOptions,
): Promise<Uint8Array> {
  const where = String(address);
  const fail = (cause: unknown) => {
    throwIfAborted(signal);
    throw modelError(`${where} could not be fetched`, cause);
  };
  const cache = cached && /^(https?:|[^:]*$)/.test(where) ? await openCache() : undefined;
  const kept = await cache?.match(where);
  if (kept) return read(kept, fail, onProgress);
  const response = (await fetchFile(address, signal ? { signal } : {}).catch(fail)) as Response;
  if (!response.ok) {
    const { status, statusText } = response;
    throw modelError(`${where} answered ${status} ${statusText}`.trim(), undefined, { status });
  }
  // What a server with one page for every address says.
  const type = response.headers.get("Content-Type") ?? "";
  if (type.startsWith("text/html")) throw modelError(`${where} is a page, not a network`);
  const bytes = await read(response, fail, onProgress);
  // A full disk is no reason to fail: the next call will fetch again.
  await cache?.put(where, new Response(bytes)).catch(() => undefined);
  return bytes;
}

async function openCache(): Promise<Cache | undefined> {
  // There is none in Node, on pages without TLS, and where the user forbids it.
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
